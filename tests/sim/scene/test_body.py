"""Bodies and stairs, and who is visible by boxes alone."""

from __future__ import annotations

import numpy as np
import pytest

from sim.scene.body import BODY, HEAD, ellipsoids, person_boxes
from sim.scene.camera import project
from sim.scene.terrain import height_at
from sim.scene.visibility import with_visibility
from sim.truth.label import bodies
from sim.types import Camera, Scene, Stairs, Truth
from tests.reference_sense import above, crowd, pinhole, surface

CAMERAS = [pinhole(), pinhole(0), pinhole(75, 200, (8, 5, 9)), pinhole(90, 0, (8, 5, 9)), above(), above(25)]


@pytest.mark.parametrize("camera", CAMERAS)
def test_boxes_enclose_the_surface_exactly(camera: Camera) -> None:
    r = np.random.default_rng(0)
    for _ in range(10):
        pos3 = np.array([*r.uniform([4, 3], [12, 9]), r.uniform(0, 1)])
        heading, height = r.uniform(0, 2 * np.pi), r.uniform(1.5, 1.95)
        uv, depth = project(camera, surface(pos3, heading, height))
        if (depth < 0.5).any():
            continue
        left, top, width, tall = person_boxes(camera, pos3[None], np.array([heading]), np.array([height]))[0]
        low, high = uv.min(axis=0), uv.max(axis=0)
        size = max(width, tall)
        assert [left, top] == pytest.approx(low, abs=2e-3 * size)
        assert [left + width, top + tall] == pytest.approx(high, abs=2e-3 * size)
        assert left <= low[0] + 1e-9
        assert top <= low[1] + 1e-9


def test_a_person_is_as_tall_and_wide_as_the_contract_says() -> None:
    camera = above()
    box = person_boxes(camera, np.array([[8.0, 5.0, 0.0]]), np.array([np.pi / 2]), np.array([1.7]))[0]
    assert box[2:] / 40 == pytest.approx([0.27 * 1.7, 0.16 * 1.7])
    assert pytest.approx(1.0) == HEAD.centre + HEAD.up
    assert pytest.approx(0.0) == BODY.centre - BODY.up
    shapes = ellipsoids(np.zeros((1, 3)), np.zeros(1), np.array([1.7]))
    assert np.sqrt(shapes.shape[0, 0, 1, 1]) == pytest.approx(0.135 * 1.7)  # across the heading


def test_who_is_behind_the_camera_has_no_box() -> None:
    box = person_boxes(pinhole(0), np.array([[8.0, -9.0, 6.0], [8.0, -6.0, 6.0]]), np.zeros(2), np.full(2, 1.7))
    assert np.isnan(box).all()


def stairs(steps: int = 10) -> Scene:
    return Scene(
        np.array([20.0, 10.0]), stairs=(Stairs(np.array([5.0, 5.0]), np.array([10.0, 5.0]), 3.0, 1.5, steps, 4.0),)
    )


def test_stairs_rise_from_foot_to_head_and_stay() -> None:
    x = np.linspace(0, 20, 801)
    z = height_at(stairs(), np.column_stack([x, np.full_like(x, 5.0)]))
    assert (z[x <= 5] == 0).all()
    assert z[x == 10] == pytest.approx(1.5)
    assert z[(x >= 10) & (x <= 14)] == pytest.approx(1.5)
    assert (z[x > 14.01] == 0).all()
    up = np.diff(z[(x >= 5) & (x <= 10)])
    assert (up >= 0).all()
    assert up.max() < 0.025 * 0.3 * 2.01  # no jump: at most twice the mean slope
    on_step = height_at(stairs(), np.array([[5.5, 5.0], [6.0, 4.0], [7.5, 5.6]]))
    assert on_step == pytest.approx([0.15, 0.3, 0.75])


def test_beside_stairs_is_level_and_steps_are_felt() -> None:
    assert (height_at(stairs(), np.array([[7.0, 6.6], [7.0, 3.4]])) == 0).all()
    assert height_at(stairs(4), np.array([7.0, 5.0])) != pytest.approx(
        float(height_at(stairs(10), np.array([7.0, 5.0])))
    )
    assert height_at(Scene(np.array([5.0, 5.0])), np.zeros((3, 2, 2))).shape == (3, 2)


def stripped(truth: Truth) -> Truth:
    return truth.replace(visible_box=None, visibility=np.ones(len(truth.id)), truncation=None)


def test_boxes_tell_nearly_what_bodies_tell() -> None:
    truth = bodies(crowd(3, people=25, frames=8), pinhole(20, 0, (8, -8, 4)))
    found = with_visibility(stripped(truth), (640, 480))
    hidden = truth.visibility < 0.95
    assert hidden.sum() > 40
    error = np.abs(found.visibility - truth.visibility)[hidden].mean()
    assert error < 0.2 * (1.0 - truth.visibility)[hidden].mean()
    assert (found.visibility[~hidden] > 0.8).all()
    assert found.truncation == pytest.approx(truth.truncation, abs=0.1)
    seen = np.isfinite(found.visible_box).all(axis=1) & np.isfinite(truth.visible_box).all(axis=1)
    assert np.median(np.abs(found.visible_box - truth.visible_box)[seen]) < 1.0
