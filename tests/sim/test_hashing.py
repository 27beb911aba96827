import numpy as np
import pytest

from sim.hashing import canonical_hash
from sim.types import Near


def test_equal_content_equal_hash():
    a = np.arange(6.0).reshape(2, 3)
    assert canonical_hash(a) == canonical_hash(np.asfortranarray(a)) == canonical_hash(a.astype(">f8"))
    assert canonical_hash({"b": 1, "a": None}) == canonical_hash({"a": None, "b": 1})
    quiet, payload = np.array([np.nan]), np.array([0x7FF8000000000001], np.uint64).view(np.float64)
    assert canonical_hash(quiet) == canonical_hash(payload)


@pytest.mark.parametrize(
    ("a", "b"),
    [
        (np.zeros((2, 3)), np.zeros((3, 2))), (np.zeros(2), np.zeros(2, np.int64)),
        (np.array([1.0, 2.0]), np.array([2.0, 1.0])), (np.array([1.0]), np.array([np.nextafter(1.0, 2.0)])),
        (np.zeros(1), -np.zeros(1)), (1, 1.0), (1, True), ("1", 1), ("ab", ("a", "b")), (("a", "bc"), ("ab", "c")),
        ((), None), (((1,), 2), ((1, 2),)), ("x", b"x"),
    ],
)  # fmt: skip
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
