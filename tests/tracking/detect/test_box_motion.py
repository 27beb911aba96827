"""A camera that moves is found from boxes alone."""

from __future__ import annotations

import warnings

import numpy as np
import pytest

from sim.types import Array, Context, Detections, Frame
from tracking.detect.box_motion import BoxMotion, shared_difference
from tracking.papers.blob.tracker import Blob

FPS, SCALE = 10.0, 25.0


def people(n: int, k: int, seed: int = 0, speed: float = 1.3) -> Array:
    """Boxes of n people in frame k, with the errors of a detector: centre x, y, height, width, px."""
    r, noise = np.random.default_rng(seed), np.random.default_rng(1000 + k)
    at, angle = r.uniform(100, 500, (n, 2)), r.uniform(0, 2 * np.pi, n)
    moved = at + k / FPS * speed * SCALE * np.column_stack([np.cos(angle), np.sin(angle)])
    return np.column_stack([moved, np.tile([42.0, 16.0], (n, 1))]) + noise.normal(0, 0.8, (n, 4))


def none() -> Array:
    return np.zeros((0, 4))


def test_what_most_boxes_share_is_found_among_those_of_others() -> None:
    first, second = people(8, 0), people(8, 1)
    second[:, :2] += (11.0, -6.0)
    second[7, :2] += (20.0, 9.0)
    found = shared_difference(first, second[::-1])
    assert found is not None
    assert found[0] == pytest.approx((11.0, -6.0), abs=2.5)
    assert found[1] < 3
    assert shared_difference(first[:2], second[:2]) is None
    assert shared_difference(none(), second) is None
    empty = np.concatenate([first, first[:1] * [1, 1, 0, 1], first[:1] * [1, 1, -1, 1]])
    assert np.array_equal(shared_difference(empty, second)[0], found[0]), "boxes of no height"


@pytest.mark.parametrize("together", [True, False])
def test_people_do_not_move_the_camera(together: bool) -> None:
    """Whether they walk apart, or start and stop all together."""
    motion, shift = BoxMotion(FPS), np.zeros(2)
    for k in range(200):
        boxes = people(9, k, speed=0.0 if together else 1.4)
        shift += together * (k // 20 % 2) * np.array([1.4 / FPS * SCALE, 0.0])
        boxes[:, :2] += shift
        assert motion.shift(boxes, none(), SCALE, k / FPS) is None
    assert not motion.moves


@pytest.mark.parametrize("px", [10.0, 25.0])
def test_jumps_of_all_boxes_do(px: float) -> None:
    motion, r = BoxMotion(FPS), np.random.default_rng(3)
    before, off = np.zeros(2), []
    for k in range(40):
        here = r.uniform(-px, px, 2)
        boxes = people(9, k)
        boxes[:, :2] += here
        move = motion.shift(boxes, none(), SCALE, k / FPS)
        if move is not None:
            off.append(move - (here - before))
        before = here
    assert motion.moves
    assert len(off) > 20
    assert np.median(np.abs(off)) < 3


def test_tracks_tell_the_movement_without_that_of_people() -> None:
    motion = BoxMotion(FPS)
    motion.moves = True
    motion.shift(people(6, 0), none(), SCALE, 0.0)
    boxes = people(6, 3, speed=3.0)
    moved = boxes + np.array([9.0, 0.0, 0.0, 0.0])
    found = motion.shift(moved, boxes, SCALE, 0.1)
    assert found == pytest.approx((9.0, 0.0), abs=1e-9)


@pytest.mark.parametrize("px", [0.0, 9.0])
def test_blob_says_once_that_the_camera_moves(px: float) -> None:
    tracker, r, ids = Blob(), np.random.default_rng(5), set[int]()
    tracker.reset(Context(FPS, SCALE, None, None, (600, 600), None), 0)
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        for k in range(60):
            box = people(8, k)
            box[:, :2] += r.normal(0, px, 2) if px else 0.0
            ltwh = np.column_stack([box[:, 0] - box[:, 3] / 2, box[:, 1] - box[:, 2] / 2, box[:, 3], box[:, 2]])
            found = Detections(k + 1, k / FPS, "image", box[:, :2], None, ltwh, np.ones(8))
            ids |= set(tracker.step(Frame(k + 1, k / FPS), found).id.tolist())
    assert len(said) == (px > 0)
    assert tracker.camera_moves == (px > 0)
