"""The scale of a bare video: learned from lone blobs of the background sample, or refused."""

from __future__ import annotations

import math

import numpy as np
import pytest

from scenarios.errors import InputError
from sim.scene.body import PERSON_HEIGHT
from sim.scene.camera import camera_rotation, misaligned, project
from sim.types import Camera, Tracks
from tests import painted
from tracking.papers.group_pda.from_pixels import ground_view, upright_lines, upright_runs, with_other_pieces
from tracking.papers.group_pda.tracker import GroupPda


def watch(scale: float, sample: np.ndarray) -> tuple[GroupPda, list[Tracks]]:
    """Two people abreast walk through the picture; scale: px per m, as it is told."""
    tracker = GroupPda()
    frames = [[(40.0 + 4 * k, 200.0, painted.TALL), (64.0 + 4 * k, 200.0, painted.TALL)] for k in range(40)]
    return tracker, painted.watched(tracker, frames, scale, sample)


def test_lone_people_in_the_sample_tell_the_scale() -> None:
    sample = painted.sample(np.random.default_rng(0), 14, painted.spread())
    tracker, made = watch(math.nan, sample)
    assert tracker.px_per_m == pytest.approx(painted.TALL / 1.7, rel=0.06)
    assert [len(t.id) for t in made[10:]] == [1] * 30
    assert made[-1].groups is not None
    assert made[-1].groups.size == pytest.approx([2], abs=0.4)
    again, same = watch(tracker.px_per_m, sample)
    assert again.px_per_m == tracker.px_per_m
    assert [t.pos.tobytes() for t in made] == [t.pos.tobytes() for t in same]


def test_two_who_part_split() -> None:
    """0.6 m apart, at 0.6 m/s each from frame 31 on; the ellipses are 1.5 m apart in frame 41."""
    walked = [2.4 * max(k - 30, 0) for k in range(70)]
    frames = [[(148 - w, 200.0, painted.TALL), (172 + w, 200.0, painted.TALL)] for w in walked]
    made = painted.watched(GroupPda(), frames, painted.TALL / 1.7, painted.sample(np.random.default_rng(0)))
    ((kind, start, before, after),) = [
        (e.kind, e.start, e.before, e.after) for t in made for e in t.events if e.kind in ("merge", "split")
    ]
    assert (kind, before, after) == ("split", (1,), (1, 2))
    assert start == pytest.approx(41, abs=10)


def test_who_is_in_front_is_seen_whole() -> None:
    """One behind the other, 30 px further up: the lower 68 px of 98 are the first one's, whose middle is at 166."""
    tracker, r, empty = GroupPda(), np.random.default_rng(0), painted.sample(np.random.default_rng(0))
    painted.watched(tracker, [], painted.TALL / 1.7, empty)
    assert tracker.pixels is not None
    found = tracker.pixels.points(painted.picture([(160.0, 170.0, painted.TALL), (160.0, 200.0, painted.TALL)], r), [])
    assert found is not None
    pixels, middles, _ = found
    rows = tracker.pixels.view.image(middles)[np.abs(pixels[:, 0] - 160) < 3, 1]
    front = rows > 151
    assert rows == pytest.approx(np.where(front, 166, 136), abs=3)
    assert front.mean() == pytest.approx(68 / 98, abs=0.05)


@pytest.mark.parametrize("scale", [math.nan, 0.0, -3.0])
def test_without_a_scale_and_without_anybody_it_is_asked_for(scale: float) -> None:
    with pytest.raises(InputError, match=r"context\.px_per_m"):
        watch(scale, painted.sample(np.random.default_rng(0)))


@pytest.mark.parametrize(("roll", "down", "radial"), [(0.0, 0.0, 0.0), (0.1, 15.0, 0.0), (0.0, 0.0, 0.1)])
def test_the_view_finds_people_on_the_ground_and_upright_lines(roll: float, down: float, radial: float) -> None:
    """Distances on the ground are those of the people whose middles are seen; heads and feet lie on one line."""
    image, position = (640, 480), np.array([3.0, -2.0, 7.0])
    rotation = camera_rotation(math.radians(40), 0.3)
    camera = misaligned(Camera("pinhole", image, (500.0, 500.0), (320.0, 240.0), position, rotation), roll, down)
    camera = camera.replace(radial=radial)
    view = ground_view(camera, (480, 640, 3), 38.0)
    ground = position[:2] + np.array([[0.0, 8.0], [1.5, 8.0], [-3.0, 12.0], [2.0, 6.0]])
    heights = (PERSON_HEIGHT / 2, 0.0, PERSON_HEIGHT)
    middle, feet, heads = (project(camera, np.column_stack([ground, np.full(4, z)]))[0] for z in heights)
    places = view.places(middle)
    apart = [np.hypot(*(p[:, None] - p).T) for p in (places, ground)]
    np.testing.assert_allclose(apart[0], apart[1], atol=1e-9)
    np.testing.assert_allclose(view.image(places), middle)
    above_the_horizon, behind = np.array([[320.0, -2000.0]]), position[None, :2] - 20 * rotation[2, :2]
    assert np.isfinite(view.places(above_the_horizon)).all()
    assert view.image(behind)[0, 1] > 480
    step = 1e-6 * np.eye(2)
    slope = np.stack([(view.image(places + d) - view.image(places - d)) / 2e-6 for d in step], 2)
    np.testing.assert_allclose(view.jacobian(places), slope, rtol=1e-6, atol=1e-6)
    np.testing.assert_allclose(view.along(feet[:, 0], feet[:, 1], heads[:, 1]), heads[:, 0], atol=30 * radial)
    lines, columns = upright_lines(view, (480, 640), 4)
    (line,) = np.flatnonzero(np.abs(lines - 320) <= 2)[:1]
    mask = np.zeros((480, 640), bool)
    for top, bottom in ((100, 150), (200, 230)):
        mask[np.arange(top, bottom), columns[top:bottom, line]] = True
    runs = upright_runs(mask, columns)
    np.testing.assert_array_equal(runs, [[line] * 2, [100, 200], [150, 230]])
    for high, ends in ((140, [[100] * 2, [230] * 2]), (110, [[100, 120], [210, 230]]), (79, [[100, 200], [150, 230]])):
        np.testing.assert_array_equal(with_other_pieces(*runs, np.full(2, high)), ends)
