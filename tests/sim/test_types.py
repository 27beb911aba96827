"""What holds for every array of the shared types."""

from __future__ import annotations

import numpy as np
import pytest

from sim.types import Detections, Frame, Groups, Near


def points(pos: np.ndarray, score: np.ndarray) -> Detections:
    return Detections(1, 0.0, "ground", pos, score=score)


@pytest.mark.parametrize("kind", [np.float32, np.float16, np.int32, np.int64, ">f8", bool])
def test_numbers_become_float64(kind: type) -> None:
    found = points(np.array([[1, 0]], kind), np.array([1], kind))
    assert found.pos.dtype is found.score.dtype is np.dtype(np.float64)
    assert found.pos.tolist() == [[1, 0]]
    assert found.replace(pos=np.ones((1, 2), kind)).pos.dtype == np.float64


def test_ids_become_int64_but_floats_stay_to_be_named() -> None:
    short = np.array([3], np.int32)
    near = Near(short, short, short, np.array([1.5]))
    assert near.start.dtype is np.dtype(np.int64)
    assert near.b.tolist() == [1.5]
    two = np.zeros((1, 2), np.float32)
    groups = Groups(short, (short,), two, two, np.zeros((1, 2, 2)), np.ones(1), (np.zeros((3, 2), np.float32),))
    assert groups.members[0].dtype is np.dtype(np.int64)
    assert groups.hull[0].dtype is np.dtype(np.float64)
    assert not groups.hull[0].flags.writeable


def test_what_is_right_is_read_only_and_not_copied() -> None:
    pos, image = np.zeros((4, 2)), np.zeros((2, 2, 3), np.uint8)
    found = points(pos, np.ones(4))
    assert np.shares_memory(found.pos, pos)
    assert pos.flags.writeable
    assert np.shares_memory(Frame(1, 0.0, image).image, image)  # type: ignore[arg-type]
    for a in (found.pos, found.score):
        with pytest.raises(ValueError, match="read-only"):
            a[0] = 1.0
