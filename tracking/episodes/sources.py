"""The sequences that episodes are played on: scenarios with seeds, stored or real recordings, sequences in memory.

`sources` turns the names, files or sequences that a user gives into `Source`s; `Source.open` makes or reads one.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterable
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

from scenarios.errors import InputError
from scenarios.limits import is_whole
from sim.types import Motion, Sequence

if TYPE_CHECKING:
    from scenarios.loading.resolve import Entry
    from scenarios.loading.toml_files import Setting

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

    @cached_property
    def people_key(self) -> tuple[object, ...]:
        """A tuple that is equal for two sources exactly if they have the same people in motion, seen from one place."""
        if self.entry is None:
            return self.key
        people = self.entry.scenario.model_dump_json(exclude={"sensor", "light", "picture"})
        return self.name, self.seed, self.entry.repeat, people

    def open(self, streams: Iterable[str] = (), motion: Motion | None = None) -> Sequence:
        """Returns the sequence: simulated, read from its path, or the one in memory. streams: the pictures to draw or
        read, some of "left", "right" and "background"; a stored sequence is read with pictures if "left" is among them.
        motion: of the simulated people; None simulates it.
        """
        if self.sequence is not None:
            return self.sequence
        if self.entry is not None:
            from sim.sequence import observe

            return observe(self.entry.scenario, motion or self.motion(), streams=streams)
        from tracking.recordings.source import open_source

        return open_source(self.path, images="left" in streams)[0]

    def motion(self) -> Motion:
        """Returns the motion of the people of a simulated source."""
        from sim.crowd.world import run

        assert self.entry is not None, "only a scenario is simulated"
        return run(self.entry.scenario, self.seed, self.entry.repeat)


def sources(
    what: SourceSpec | Source, seeds: Iterable[int] = range(10), set: Iterable[str | Setting] = ()
) -> tuple[Source, ...]:
    """Returns the sources that `what` stands for; each scenario or suite entry gives one source per seed, in order.

    If a name is both in the catalogue and a folder, the catalogue is used.

    Args:
        what: The name of a suite or scenario, a TOML file, a folder, dataset or recording, a Sequence, a Source, or a
            list of these.
        seeds: Seeds with which scenarios are simulated; they have no effect on other sources.
        set: Settings of the scenarios, as of `scenarios.load`.

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
    for seed in numbers:
        if not is_whole(seed, 0):
            got, expected = repr(seed), "whole numbers, 0 or more"
            raise InputError(place="seeds", got=got, expected=expected, remedy="correct it")
    found = tuple(source for item in what for source in _sources_of(item, numbers, settings))
    if not found:
        raise InputError(place="sources", got="none", expected="at least one", remedy="give a suite, or seeds")
    if settings and not any(source.simulated for source in found):
        got, remedy = ", ".join(map(str, settings)), "leave the settings out"
        raise InputError(place="set", got=got, expected="none for recordings", remedy=remedy)
    return found


def _sources_of(
    item: str | Path | Sequence | Source, seeds: tuple[int, ...], settings: tuple[str | Setting, ...]
) -> list[Source]:
    if isinstance(item, Source):
        return [item]
    if isinstance(item, Sequence):
        return [Source(item.name, int(item.source.get("seed", 0)), sequence=item)]
    from scenarios.loading.resolve import is_catalogued, resolve

    if not is_catalogued(str(item)) and Path(item).exists():
        return _stored(Path(item))
    return [Source(e.name, seed, entry=e) for e in resolve(str(item), settings) for seed in seeds]


def _stored(path: Path) -> list[Source]:
    from tracking.recordings.source import open_source

    found = open_source(path, images=False)
    return [Source(s.name, int(s.source.get("seed", 0)), path=str(s.source.get("path", path))) for s in found]
