"""What is kept between episodes on the same sources: motions, truths, detections; bounded by bytes."""

from __future__ import annotations

from collections import Counter, OrderedDict
from collections.abc import Callable, Iterator
from dataclasses import fields, is_dataclass, replace
from functools import cached_property
from types import FunctionType, MethodType
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

from scenarios.errors import InputError
from sim.types import Frame, Truth
from tracking.episode_source import Source

if TYPE_CHECKING:
    from tracking.objective import ObjectiveScorer

T = TypeVar("T")
LIMIT = 256 * 2**20
COUNTS = 2
"""Times that a source's bytes are counted; after that it holds what it will hold."""


class Held:
    """A source that was opened. State: its sequence, detections in memory; truth and background once asked for."""

    def __init__(self, source: Source, streams: tuple[str, ...] = ()) -> None:
        self.source, self._opened = source, source.open(streams)
        opened = self._opened
        made = _remembered(lambda: tuple(opened.without_pictures()))

        def bare() -> Iterator[Frame]:
            return iter(made())

        pictures = opened.has_images or opened.has_right
        self.sequence = replace(opened, bare=bare, frames=opened.frames if pictures else bare)
        if opened.load_background is not None:
            self.sequence = replace(self.sequence, load_background=_remembered(opened.load_background))

    @cached_property
    def truth(self) -> Truth:
        """What is true; InputError where nothing is labelled."""
        truth = self._opened.truth
        if truth is None:
            remedy = "give a sequence with labels: there is nothing to score by"
            raise InputError(file=self.source.name, got="no labels", expected="a truth", remedy=remedy)
        return truth

    @cached_property
    def judge(self) -> ObjectiveScorer:
        """The truth, ready to score answers by."""
        from tracking.objective import ObjectiveScorer

        return ObjectiveScorer(self.truth)


def _remembered(make: Callable[[], T]) -> Callable[[], T]:
    """What `make` makes, made once and kept where `array_bytes` finds it."""
    kept: list[T] = []

    def again() -> T:
        if not kept:
            kept.append(make())
        return kept[0]

    return again


class Cache:
    """Opened sources, the least recently used dropped first. State: those held, and their bytes.

    limit: bytes of arrays that all together may hold; the one in use is held whatever its size. Bytes are counted when
    another source is asked for, the first times: by then it is known what the last one came to hold.
    """

    def __init__(self, limit: int = LIMIT) -> None:
        if limit < 0:
            raise InputError(place="cache", got=limit, expected="bytes, 0 or more", remedy="correct it")
        self.limit = limit
        self._held: OrderedDict[tuple[object, ...], Held] = OrderedDict()
        self._bytes: dict[tuple[object, ...], int] = {}
        self._counted: Counter[tuple[object, ...]] = Counter()

    def __len__(self) -> int:
        return len(self._held)

    @property
    def bytes(self) -> int:
        """Bytes of the arrays held."""
        self._counted.clear()
        self._count_last()
        return sum(self._bytes.values())

    def hold(self, source: Source, streams: tuple[str, ...] = ()) -> Held:
        """The source, opened now or before with these pictures."""
        key = (*source.key, streams)
        if self._held and next(reversed(self._held)) == key:
            return self._held[key]
        self._count_last()
        if key in self._held:
            self._held.move_to_end(key)
            return self._held[key]
        self._make_room()
        self._held[key] = Held(source, streams)
        return self._held[key]

    def _count_last(self) -> None:
        key = next(reversed(self._held), None)
        if key is not None and self._counted[key] < COUNTS:
            self._counted[key] += 1
            self._bytes[key] = array_bytes(self._held[key])

    def _make_room(self) -> None:
        while self._held and sum(self._bytes.values()) > self.limit:
            key, _ = self._held.popitem(last=False)
            del self._bytes[key], self._counted[key]


def array_bytes(thing: object) -> int:
    """Bytes of all arrays that can be reached from here, each counted once."""
    arrays: dict[int, int] = {}
    seen: set[int] = set()
    waiting: list[Any] = [thing]
    while waiting:
        one = waiting.pop()
        if id(one) in seen:
            continue
        seen.add(id(one))
        if isinstance(one, np.ndarray):
            while isinstance(one.base, np.ndarray):
                one = one.base
            arrays[id(one)] = one.nbytes
        else:
            waiting.extend(_parts(one))
    return sum(arrays.values())


def _parts(one: Any) -> list[Any]:
    """What a container, one of our objects, or a function with what it closes over, leads to."""
    if isinstance(one, tuple | list):
        return list(one)
    if isinstance(one, dict):
        return list(one.values())
    if isinstance(one, MethodType):
        return [one.__self__]
    if isinstance(one, FunctionType) or hasattr(one, "__wrapped__"):
        cells = getattr(one, "__closure__", None) or ()
        return [*(c.cell_contents for c in cells), getattr(one, "__wrapped__", None)]
    if type(one).__module__.split(".")[0] not in ("sim", "tracking"):
        return []
    named = [getattr(one, f.name) for f in fields(one)] if is_dataclass(one) and not isinstance(one, type) else []
    return [*named, *getattr(one, "__dict__", {}).values()]
