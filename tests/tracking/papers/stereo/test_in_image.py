"""Groups in space as groups in the image, for scores beside those of trackers in the image."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.stereo.density import ABOVE, BELOW, in_image
from sim.geometry.polygons import contains
from sim.scene.camera import project
from sim.types import Groups, Tracks
from tests.sim.scene.test_stereo import rig


def test_a_hull_in_the_image_covers_bodies_from_their_feet_to_their_heads() -> None:
    camera, square = rig(30.0), np.array([[0.5, 5.5], [1.5, 5.5], [1.5, 6.5], [0.5, 6.5]])
    pos, one = np.array([[1.0, 6.0, 1.4]]), np.array([7])
    groups = Groups(one, (np.zeros(0, int),), pos, 0 * pos, np.eye(2)[None], np.array([np.nan]), (square,))
    made = in_image(
        Tracks(1, 0.0, "space", "group", one, one, pos, 0 * pos, np.eye(6)[None], None, np.ones(1), groups, ()), camera
    )
    assert made.plane == "image"
    (hull,) = made.groups.hull
    for height, inside in (
        (1.4 - BELOW, True),
        (1.4 + ABOVE, True),
        (1.4 - BELOW - 0.8, False),
        (1.4 + ABOVE + 0.8, False),
    ):
        uv = project(camera, np.array([[1.0, 6.0, height]]))[0]
        assert contains(hull, uv).tolist() == [inside], height
    corners = np.column_stack([square, np.full(4, 1.4)])
    assert contains(hull, project(camera, corners)[0], 0.01).all()
    assert made.pos[0] == pytest.approx(hull.mean(0))
    assert made.groups.id.tolist() == [7]
