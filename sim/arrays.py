"""Arrays as fields of frozen dataclasses: their kinds of number, and how they become read-only."""

from __future__ import annotations

import re
from dataclasses import fields, replace
from functools import cache
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Ints = NDArray[np.int64]
Bools = NDArray[np.bool_]
Image = NDArray[np.uint8]


class Frozen:
    """Makes the arrays of a frozen dataclass read-only and, from any other width of number, float64 or int64.

    What is of the right kind is not copied: the field is a read-only view, and whoever keeps the array itself can
    still write to it. Floats given as ids stay what they are, for the check of a tracker's answer to name them.
    """

    def __post_init__(self) -> None:
        for name, kind, ragged in _array_fields(type(self)):  # type: ignore[arg-type]
            value = getattr(self, name)
            if ragged:
                if value and isinstance(value[0], np.ndarray):
                    object.__setattr__(self, name, tuple(_settled(v, kind) for v in value))
            elif isinstance(value, np.ndarray) and (value.dtype is not kind or value.flags.writeable):
                object.__setattr__(self, name, _settled(value, kind))

    def replace(self, **changes: Any) -> Self:
        """A copy with these fields changed."""
        return replace(self, **changes)  # type: ignore[type-var]


KINDS = {"Array": np.dtype(np.float64), "Ints": np.dtype(np.int64), "Bools": np.dtype(np.bool_)}
KINDS["Image"] = np.dtype(np.uint8)


@cache
def _array_fields(kind: Any) -> tuple[tuple[str, np.dtype[Any], bool], ...]:
    """The fields of a dataclass that are declared as arrays: name, kind of number, whether a tuple of arrays."""
    found = []
    for f in fields(kind):
        declared = re.fullmatch(r"(tuple\[)?(Array|Ints|Bools|Image)\b.*", str(f.type))
        if declared:
            found.append((f.name, KINDS[declared[2]], declared[1] is not None))
    return tuple(found)


def _settled(a: NDArray[Any], kind: np.dtype[Any]) -> NDArray[Any]:
    """The array read-only and of the wanted kind; of its own where numbers could be lost (floats as ids)."""
    if a.dtype is not kind and a.dtype != kind and np.can_cast(a.dtype, kind, "same_kind"):
        a = a.astype(kind)
    if a.flags.writeable:
        a = a.view()
        a.flags.writeable = False
    return a


def no_ids() -> Ints:
    """An empty id array."""
    return np.zeros(0, np.int64)
