"""The shared types: arrays, ids that stand twice in a frame, and hashes of content."""

from __future__ import annotations

import numpy as np
import pytest

from sim.arrays import repeated_ids
from sim.hashing import canonical_hash
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


def test_against_pairs_one_by_one():
    draws = np.random.default_rng(0)
    for _ in range(50):
        frame, id = draws.integers(0, 4, (2, 12))
        pairs = list(zip(frame.tolist(), id.tolist(), strict=True))
        assert repeated_ids(frame, id).tolist() == [pair in pairs[:k] for k, pair in enumerate(pairs)]


def test_equal_content_equal_hash():
    a = np.arange(6.0).reshape(2, 3)
    assert canonical_hash(a) == canonical_hash(np.asfortranarray(a)) == canonical_hash(a.astype(">f8"))
    assert canonical_hash({"b": 1, "a": None}) == canonical_hash({"a": None, "b": 1})
    quiet, payload = np.array([np.nan]), np.array([0x7FF8000000000001], np.uint64).view(np.float64)
    assert canonical_hash(quiet) == canonical_hash(payload)


DIFFERENT = [
    (np.zeros((2, 3)), np.zeros((3, 2))), (np.zeros(2), np.zeros(2, np.int64)),
    (np.array([1.0, 2.0]), np.array([2.0, 1.0])), (np.array([1.0]), np.array([np.nextafter(1.0, 2.0)])),
    (np.zeros(1), -np.zeros(1)), (1, 1.0), (1, True), ("1", 1), ("ab", ("a", "b")), (("a", "bc"), ("ab", "c")),
    ((), None), (((1,), 2), ((1, 2),)), ("x", b"x"),
]  # fmt: skip


@pytest.mark.parametrize(("a", "b"), DIFFERENT)
def test_different_content_different_hash(a, b):
    assert canonical_hash(a) != canonical_hash(b)


def test_types_hash_by_their_fields():
    one = np.array([1], np.int64)
    near = Near(one, one, one, one + 1)
    assert canonical_hash(near) == canonical_hash(near.replace())
    assert canonical_hash(near) != canonical_hash(near.replace(a=one + 1))
    with pytest.raises(TypeError):
        canonical_hash(np.array(["a"]))
    with pytest.raises(TypeError):
        canonical_hash(object())
