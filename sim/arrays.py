"""Array types for the fields of frozen dataclasses: Array (float64), Ints (int64), Bools (bool) and Image (uint8).

The base class `Frozen` converts array fields to their declared number type and makes them read-only. `repeated_ids`
finds ids that stand twice in a frame.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import fields
from functools import cache
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Ints = NDArray[np.int64]
Bools = NDArray[np.bool_]
Image = NDArray[np.uint8]


class Frozen:
    """Base class of frozen dataclasses: makes array fields read-only and converts them to the declared number type.

    An array that has the declared type already is not copied: the field is a read-only view of it. An array whose
    conversion would change the kind of number, such as floats where integer ids are declared, keeps its type. The check
    of a tracker's answer can then report it.
    """

    def __post_init__(self) -> None:
        self._settle(_array_fields(type(self)))  # type: ignore[arg-type]

    def _settle(self, kinds: dict[str, tuple[np.dtype[Any], bool]]) -> None:
        for name, (kind, ragged) in kinds.items():
            value = getattr(self, name)
            if ragged:
                if value and isinstance(value[0], np.ndarray):
                    object.__setattr__(self, name, tuple(_settled(v, kind) for v in value))
            elif isinstance(value, np.ndarray) and (value.dtype is not kind or value.flags.writeable):
                object.__setattr__(self, name, _settled(value, kind))

    @classmethod
    def of_settled(cls, *values: Any) -> Self:
        """Returns an object with these values of all fields, in order. Arrays must be read-only and have the declared
        number type: this is not checked."""
        made = object.__new__(cls)
        for name, value in zip(_names(cls), values, strict=True):  # type: ignore[arg-type]
            object.__setattr__(made, name, value)
        return made

    def replace(self, **changes: Any) -> Self:
        """Returns a copy with the given fields changed."""
        made, names, kinds = object.__new__(type(self)), _names(type(self)), _array_fields(type(self))  # type: ignore[arg-type]
        for name in names:
            object.__setattr__(made, name, changes[name] if name in changes else getattr(self, name))
        if unknown := changes.keys() - {*names}:
            raise TypeError(f"{type(self).__name__} has no field {', '.join(unknown)}")
        # The other fields are settled: a long recording has a million frames.
        made._settle({name: kinds[name] for name in changes if name in kinds})
        return made

    def keep(self, rows: Any) -> Self:
        """Returns a copy with only these rows (a mask, or indices in order) of all arrays; empty arrays stay empty."""
        found = {name: getattr(self, name) for name, (_, ragged) in _array_fields(type(self)).items() if not ragged}  # type: ignore[arg-type]
        return self.replace(**{name: a[rows] for name, a in found.items() if a is not None and len(a)})

    def copy(self) -> Self:
        """Returns a copy that shares no array with this object; the arrays of the copy are read-only."""
        made = object.__new__(type(self))
        for name in _names(type(self)):  # type: ignore[arg-type]
            object.__setattr__(made, name, _own(getattr(self, name)))
        return made


KINDS = {"Array": np.dtype(np.float64), "Ints": np.dtype(np.int64), "Bools": np.dtype(np.bool_)}
KINDS["Image"] = np.dtype(np.uint8)


@cache
def _array_fields(kind: Any) -> dict[str, tuple[np.dtype[Any], bool]]:
    found = {}
    for f in fields(kind):
        declared = re.fullmatch(r"(tuple\[)?(Array|Ints|Bools|Image)\b.*", str(f.type))
        if declared:
            found[f.name] = KINDS[declared[2]], declared[1] is not None
    return found


def _settled(a: NDArray[Any], kind: np.dtype[Any]) -> NDArray[Any]:
    if a.dtype is not kind and a.dtype != kind and np.can_cast(a.dtype, kind, "same_kind"):
        a = a.astype(kind)
    if a.flags.writeable:
        a = a.view()
        a.flags.writeable = False
    return a


def read_only(a: NDArray[Any]) -> NDArray[Any]:
    """Returns the array after it was made read-only; so are views that are made of it from now on."""
    a.flags.writeable = False
    return a


@cache
def _names(kind: Any) -> tuple[str, ...]:
    return tuple(f.name for f in fields(kind))


def _own(value: Any) -> Any:
    if isinstance(value, np.ndarray):
        made = np.array(value)
        made.flags.writeable = False
        return made
    if isinstance(value, tuple) and value and isinstance(value[0], np.ndarray):
        return tuple(map(_own, value))
    return value.copy() if isinstance(value, Frozen) else value


def no_ids() -> Ints:
    """Returns an empty array of ids, (0,) int64."""
    return np.zeros(0, np.int64)


def joined(parts: Iterable[Any], *shape: int, kind: Any = np.float64) -> Any:
    """Returns arrays (N, *shape) one behind the other as one of number type `kind`, (0, *shape) for no array."""
    return np.concatenate([np.zeros((0, *shape), kind), *parts])


def repeated_ids(frame: Ints, id: Ints) -> Bools:
    """Returns flags (N,): True for each row whose frame and id both equal those of a row with a smaller index.

    frame, id (N,): in any order.
    """
    order = np.lexsort((id, frame))  # stable: equal rows keep their order
    again = np.zeros(len(order), bool)
    again[order[1:]] = (np.diff(frame[order]) == 0) & (np.diff(id[order]) == 0)
    return again
