"""Keeps opened sequences between episodes on the same sources, so that motions, truths and detections are computed
once.

The memory is bounded by the bytes of the arrays that they hold.

Also here: the sequences that episodes are played on: scenarios with seeds, stored or real recordings, sequences in
memory.

`sources` turns the names, files or sequences that a user gives into `Source`s; `Source.open` makes or reads one.
"""

from __future__ import annotations

import hashlib
import pickle
from collections import OrderedDict
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field, replace
from functools import cache, cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

from scenarios.errors import InputError
from sim.types import Frame, Sequence, Truth

if TYPE_CHECKING:
    from scenarios.loading.resolve import Entry
    from tracking.scoring.evaluation import Scorer

T = TypeVar("T")
SourceSpec = str | Path | Sequence | Iterable["str | Path | Sequence | Source"]


@dataclass(frozen=True, eq=False)
class Source:
    """One sequence to play on: a scenario entry with its seed, a path, or a Sequence in memory (exactly one of these).

    A source with a Sequence in memory cannot be pickled.
    """

    name: str  # of the scenario or sequence
    seed: int = 0  # of the simulation, or stated by the recording, else 0
    entry: Entry | None = field(default=None, repr=False)
    path: str = ""
    sequence: Sequence | None = field(default=None, repr=False)

    @cached_property
    def key(self) -> tuple[object, ...]:
        """A tuple that is equal for two sources exactly if they are of the same sequence. It is computed once."""
        if self.entry is not None:
            content = self.entry.scenario.model_dump_json()
            return self.name, self.seed, self.entry.repeat, hashlib.sha256(content.encode()).hexdigest()
        return (str(Path(self.path).resolve()),) if self.path else (id(self.sequence),)

    @property
    def simulated(self) -> bool:
        """True if the sequence is simulated from a scenario, False if it is stored or in memory."""
        return self.entry is not None

    def open(self, streams: Iterable[str] = ()) -> Sequence:
        """Returns the sequence: simulated, read from its path, or the one in memory. streams: the pictures to draw or
        read, some of "left", "right" and "background"; a stored sequence is read with pictures if "left" is among them.
        """
        if self.sequence is not None:
            return self.sequence
        if self.entry is not None:
            from sim.sequence import simulate

            return simulate(self.entry.scenario, self.seed, self.entry.repeat, streams)
        from tracking.recordings.source import open_source

        return open_source(self.path, images="left" in streams)[0]


def sources(what: SourceSpec | Source, seeds: Iterable[int] = range(10), set: Iterable[str] = ()) -> tuple[Source, ...]:
    """Returns the sources that `what` stands for; each scenario or suite entry gives one source per seed, in order.

    If a name is both in the catalogue and a folder, the catalogue is used.

    Args:
        what: The name of a suite or scenario, a TOML file, a folder, dataset or recording, a Sequence, a Source, or a
            list of these.
        seeds: Seeds with which scenarios are simulated; they have no effect on other sources.
        set: Settings "key=value" of the scenarios.

    Raises:
        InputError: A name is unknown, a file or setting is wrong, there is no source, or there are settings but no
            scenario.
    """
    if isinstance(what, str | Path | Sequence | Source):
        what = (what,)
    if not isinstance(seeds, Iterable):
        remedy = f"write for example range({seeds})"
        raise InputError(place="seeds", got=repr(seeds), expected="a range or a list of numbers", remedy=remedy)
    if isinstance(set, str):
        raise InputError(place="set", got=repr(set), expected='a list of "key=value"', remedy=f"write [{set!r}]")
    numbers, settings = tuple(seeds), tuple(set)
    found = tuple(source for item in what for source in _sources_of(item, numbers, settings))
    if not found:
        raise InputError(place="sources", got="none", expected="at least one", remedy="give a suite, or seeds")
    if settings and not any(source.simulated for source in found):
        got, remedy = ", ".join(settings), "leave the settings out"
        raise InputError(place="set", got=got, expected="none for recordings", remedy=remedy)
    return found


def _sources_of(
    item: str | Path | Sequence | Source, seeds: tuple[int, ...], settings: tuple[str, ...]
) -> list[Source]:
    if isinstance(item, Source):
        return [item]
    if isinstance(item, Sequence):
        return [Source(item.name, int(item.source.get("seed", 0)), sequence=item)]
    from scenarios.loading.resolve import is_catalogued, resolve

    text = str(item)
    if not is_catalogued(text) and Path(item).exists():
        return _stored(Path(item))
    return [Source(e.name, seed, entry=e) for e in resolve(text, settings) for seed in seeds]


def _stored(path: Path) -> list[Source]:
    from tracking.recordings.source import open_source

    found = open_source(path, images=False)
    return [Source(s.name, int(s.source.get("seed", 0)), path=str(s.source.get("path", path))) for s in found]


DEFAULT_LIMIT = 256 * 2**20  # Bytes that a SourceCache keeps by default.


class OpenedSource:
    """A source whose sequence is open; its detections, truth and background are kept after their first use. streams:
    the pictures that are drawn if the source is simulated, some of "left", "right" and "background"."""

    def __init__(self, source: Source, streams: tuple[str, ...] = ()) -> None:
        self.source, self._kept = source, list[object]()
        found = source.open(streams)
        loads = {name: getattr(found, name) for name in ("load_truth", "load_background")}
        once: dict[str, Any] = {name: self._computed_once(load) for name, load in loads.items() if load is not None}
        self._opened = opened = replace(found, **once)
        frames_once = self._computed_once(lambda: tuple(opened.without_pictures()))

        def frames_without_pictures() -> Iterator[Frame]:
            return iter(frames_once())

        pictures = opened.has_images or opened.has_right
        frames = opened.frames if pictures else frames_without_pictures
        self.sequence = replace(opened, bare=frames_without_pictures, frames=frames)

    def _computed_once(self, compute: Callable[[], T]) -> Callable[[], T]:
        @cache
        def first_result() -> T:
            self._kept.append(found := compute())
            return found

        return first_result

    @cached_property
    def truth(self) -> Truth:
        """The truth (labels) of the sequence. Raises InputError if it has no labels or they cannot be read."""
        truth = self._opened.truth
        if truth is None:
            remedy = "give a sequence with labels: there is nothing to score by"
            raise InputError(file=self.source.name, got="no labels", expected="a truth", remedy=remedy)
        return truth

    @cached_property
    def scorer(self) -> Scorer:
        """A `Scorer` of the sequence's truth, built on first use. Raises InputError without labels."""
        from tracking.scoring.evaluation import Scorer

        self._kept.append(scorer := Scorer(self.truth))
        return scorer

    @property
    def bytes(self) -> int:
        """Number of bytes that detections, truth, background and scorer take so far, measured by pickling them."""
        arrays: list[pickle.PickleBuffer] = []
        packed = pickle.dumps(self._kept, protocol=5, buffer_callback=arrays.append)
        return len(packed) + sum(array.raw().nbytes for array in arrays)


class SourceCache:
    """Opened sources, kept for reuse; the least recently used source is dropped first. len() gives their number.

    limit: number of bytes that all kept sources may take together. It is checked when a new source is opened, before
    that one is added; the source in use is kept whatever its size.
    """

    def __init__(self, limit: int = DEFAULT_LIMIT) -> None:
        self.limit = limit
        self._opened: OrderedDict[tuple[object, ...], OpenedSource] = OrderedDict()
        self._bytes: dict[tuple[object, ...], int] = {}

    def __len__(self) -> int:
        return len(self._opened)

    @property
    def bytes(self) -> int:
        """Number of bytes that all kept sources take, 0 without sources; only the last used one is measured anew."""
        last = next(reversed(self._opened), None)
        for key, opened in self._opened.items():
            if key == last or key not in self._bytes:
                self._bytes[key] = opened.bytes
        return sum(self._bytes.values())

    def open(self, source: Source, streams: tuple[str, ...] = ()) -> OpenedSource:
        """Returns the opened source: the kept one if it was opened with the same `streams`, else a new one."""
        key = (*source.key, streams)
        if key not in self._opened:
            held = self.bytes
            while self._opened and held > self.limit:
                dropped, _ = self._opened.popitem(last=False)
                held -= self._bytes.pop(dropped)
            self._opened[key] = OpenedSource(source, streams)
        self._bytes.pop(key, None)  # it may come to hold more
        self._opened.move_to_end(key)
        return self._opened[key]
