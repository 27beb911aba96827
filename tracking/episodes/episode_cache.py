"""Keeps opened sequences between episodes on the same sources, so that motions, truths and detections are computed
once. The memory is bounded by the bytes of the arrays that they hold.

What is kept can be computed again, and a sequence consists of functions, which cannot be pickled. So a pickled opened
source is its source alone, and is opened again where it is loaded; a pickled cache is empty. `copy.deepcopy` shares
both.
"""

from __future__ import annotations

import pickle
from collections import OrderedDict
from collections.abc import Callable, Iterator
from dataclasses import fields, replace
from functools import cache, cached_property
from typing import TYPE_CHECKING, Any, TypeVar

from scenarios.errors import InputError
from sim.types import DetectionMode, Frame, Sequence, Truth
from tracking.episodes.sources import Source

if TYPE_CHECKING:
    from tracking.running.prepare import InputFrames
    from tracking.scoring.evaluation import Scorer

T = TypeVar("T")
DEFAULT_LIMIT = 256 * 2**20  # Bytes that a SourceCache keeps by default.


class Kept:
    """Values that are computed once and then kept. State: the values, and their bytes when these were last counted."""

    def __init__(self) -> None:
        self._values: list[object] = []
        self._counted = (0, 0)  # number of values, bytes

    def add(self, value: T) -> T:
        """Keeps a value and returns it."""
        self._values.append(value)
        return value

    def once(self, compute: Callable[[], T]) -> Callable[[], T]:
        """Returns a function that returns what `compute` returns; it calls `compute` once."""
        return cache(lambda: self.add(compute()))

    @property
    def bytes(self) -> int:
        """Number of bytes that the values take, measured by pickling them."""
        if len(self._values) != self._counted[0]:
            arrays: list[pickle.PickleBuffer] = []
            packed = pickle.dumps(self._values, protocol=5, buffer_callback=arrays.append)
            self._counted = len(self._values), len(packed) + sum(array.raw().nbytes for array in arrays)
        return self._counted[1]


class SourcePeople:
    """What sources of one `people_key` have in common: the motion, the truth and its scorer, kept after their first
    use. motion: None if it is not simulated. load_truth: None without labels."""

    def __init__(self, source: Source) -> None:
        self.kept = Kept()
        self.motion = self.kept.add(source.motion()) if source.simulated else None
        self.load_truth: Callable[[], Truth] | None = None
        self._scorer: Scorer | None = None

    def scorer(self, truth: Truth) -> Scorer:
        """Returns the `Scorer` of the truth, which is that of every such source."""
        from tracking.scoring.evaluation import Scorer

        if self._scorer is None:
            self._scorer = self.kept.add(Scorer(truth))
        return self._scorer


class KeptSequence(Sequence):
    """The sequence of an opened source, `opened`."""

    opened: OpenedSource

    def __reduce_ex__(self, protocol: Any) -> str | tuple[Any, ...]:
        own = "opened" in vars(self)  # not so what `dataclasses.replace` makes of it
        return (getattr, (self.opened, "sequence")) if own else super().__reduce_ex__(protocol)


class OpenedSource:
    """A source whose sequence is open; its detections, truth and background are kept after their first use. streams:
    the pictures that are drawn if the source is simulated, some of "left", "right" and "background". people: of another
    source with the same people_key."""

    def __init__(self, source: Source, streams: tuple[str, ...] = (), people: SourcePeople | None = None) -> None:
        self.source, self.streams, self.people, self.kept = source, streams, people or SourcePeople(source), Kept()
        found = source.open(streams, self.people.motion)
        if self.people.load_truth is None and found.load_truth is not None:
            self.people.load_truth = self.people.kept.once(found.load_truth)
        background = found.load_background and self.kept.once(found.load_background)
        self._opened = opened = replace(found, load_truth=self.people.load_truth, load_background=background)
        frames_once = self.kept.once(lambda: tuple(opened.without_pictures()))

        def frames_without_pictures() -> Iterator[Frame]:
            return iter(frames_once())

        pictures = opened.has_images or opened.has_right
        frames = opened.frames if pictures else frames_without_pictures
        values = {each.name: getattr(opened, each.name) for each in fields(opened)}
        self.sequence = KeptSequence(**values | {"bare": frames_without_pictures, "frames": frames})
        object.__setattr__(self.sequence, "opened", self)
        self._inputs: dict[tuple[object, ...], InputFrames] = {}

    def __reduce__(self) -> tuple[Any, ...]:
        return OpenedSource, (self.source, self.streams)

    def __deepcopy__(self, memo: object) -> OpenedSource:
        return self

    @cached_property
    def truth(self) -> Truth:
        """The truth (labels) of the sequence. Raises InputError if it has no labels or they cannot be read."""
        truth = self._opened.truth
        if truth is None:
            remedy = "give a sequence with labels: there is nothing to score by"
            raise InputError(file=self.source.name, got="no labels", expected="a truth", remedy=remedy)
        return truth

    @property
    def scorer(self) -> Scorer:
        """A `Scorer` of the sequence's truth, built on first use. Raises InputError without labels."""
        return self.people.scorer(self.truth)

    def input_frames(self, mode: DetectionMode, needs: tuple[str, ...], seed: int) -> InputFrames:
        """Returns what `tracking.running.prepare.input_frames` does, made on first use."""
        from tracking.running.prepare import input_frames

        key = (mode, "boxes" in needs, "points" in needs, seed if mode == "truth" else 0)
        if key not in self._inputs:
            self._inputs[key] = self.kept.add(input_frames(mode, needs, self.sequence, {}, seed, owned=True))
        return self._inputs[key]


class SourceCache:
    """Opened sources, kept for reuse; the least recently used source is dropped first. len() gives their number.

    limit: number of bytes that all kept sources may take together. It is checked when a new source is opened, before
    that one is added; the source in use is kept whatever its size.
    """

    def __init__(self, limit: int = DEFAULT_LIMIT) -> None:
        self.limit = limit
        self._opened: OrderedDict[tuple[object, ...], OpenedSource] = OrderedDict()

    def __reduce__(self) -> tuple[Any, ...]:
        return SourceCache, (self.limit,)

    def __deepcopy__(self, memo: object) -> SourceCache:
        return self

    def __len__(self) -> int:
        return len(self._opened)

    @property
    def bytes(self) -> int:
        """Number of bytes that all kept sources take, 0 without sources."""
        people = {id(opened.people): opened.people.kept for opened in self._opened.values()}
        return sum(opened.kept.bytes for opened in self._opened.values()) + sum(kept.bytes for kept in people.values())

    def open(self, source: Source, streams: tuple[str, ...] = ()) -> OpenedSource:
        """Returns the opened source: the kept one if it was opened with the same `streams`, else a new one."""
        key = (*source.key, streams)
        if key not in self._opened:
            while self._opened and self.bytes > self.limit:
                self._opened.popitem(last=False)
            others = (opened for opened in self._opened.values() if opened.source.people_key == source.people_key)
            other = next(others, None)
            self._opened[key] = OpenedSource(source, streams, None if other is None else other.people)
        self._opened.move_to_end(key)
        return self._opened[key]
