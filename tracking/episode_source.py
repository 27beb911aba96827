"""What episodes are played on: a scenario with a seed, a stored or real sequence, a Sequence in memory."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

from scenarios.errors import InputError
from sim.types import Sequence

if TYPE_CHECKING:
    from scenarios.loading.resolve import Entry

What = str | Path | Sequence | Iterable["str | Path | Sequence | Source"]


@dataclass(frozen=True, eq=False)
class Source:
    """One sequence to play on: an entry and its seed, or a path, or a Sequence (which alone cannot be pickled)."""

    name: str
    seed: int = 0
    entry: Entry | None = field(default=None, repr=False)
    path: str = ""
    sequence: Sequence | None = field(default=None, repr=False)

    @cached_property
    def key(self) -> tuple[object, ...]:
        """Equal for sources of the same sequence."""
        if self.entry is not None:
            content = self.entry.scenario.model_dump_json()
            return self.name, self.seed, self.entry.repeat, hashlib.sha256(content.encode()).hexdigest()
        return (str(Path(self.path).resolve()),) if self.path else (id(self.sequence),)

    @property
    def simulated(self) -> bool:
        """Is it made from a scenario?"""
        return self.entry is not None

    @property
    def fps(self) -> float:
        """Frames per second."""
        camera = self.entry.scenario.camera if self.entry is not None else None
        return self.open().fps if camera is None else camera.fps

    def open(self, streams: Iterable[str] = ()) -> Sequence:
        """The sequence; streams: of the pictures that are drawn where it is simulated, of others "left" lets them be
        read."""
        if self.sequence is not None:
            return self.sequence
        if self.entry is not None:
            from sim.sequence import simulate

            return simulate(self.entry.scenario, self.seed, self.entry.repeat, streams)
        from sim.io.source import open_source

        return open_source(self.path, images="left" in streams)[0]


def sources(what: What | Source, seeds: Iterable[int] = range(10), set: Iterable[str] = ()) -> tuple[Source, ...]:
    """The sources of a suite's or scenario's name, of a TOML file, of a folder, dataset or recording, of Sequences, of
    sources themselves, or of a list of such, in order; a scenario with each of the seeds in turn.

    set: `key=value` settings of scenarios. InputError where there is nothing of that name, and for settings or seeds
    without a scenario to apply them to.
    """
    if isinstance(what, str | Path | Sequence | Source):
        what = (what,)
    if not isinstance(seeds, Iterable):
        remedy = f"write for example range({seeds})"
        raise InputError(place="seeds", got=repr(seeds), expected="a range or a list of numbers", remedy=remedy)
    if isinstance(set, str):
        raise InputError(place="set", got=repr(set), expected='a list of "key=value"', remedy=f"write [{set!r}]")
    numbers, settings = tuple(seeds), tuple(set)
    found = tuple(source for one in what for source in _of(one, numbers, settings))
    if not found:
        raise InputError(place="sources", got="none", expected="at least one", remedy="give a suite, or seeds")
    if settings and not any(source.simulated for source in found):
        got, remedy = ", ".join(settings), "leave the settings out"
        raise InputError(place="set", got=got, expected="none for recordings", remedy=remedy)
    return found


def _of(what: str | Path | Sequence | Source, seeds: tuple[int, ...], settings: tuple[str, ...]) -> list[Source]:
    if isinstance(what, Source):
        return [what]
    if isinstance(what, Sequence):
        return [Source(what.name, int(what.source.get("seed", 0)), sequence=what)]
    from scenarios.loading.resolve import names, resolve, suite_names

    text = str(what)
    known = text.endswith(".toml") or text.startswith("suite:") or text in (*names(), *suite_names())
    if not known and Path(what).exists():
        return _stored(Path(what))
    return [Source(e.name, seed, entry=e) for e in resolve(text, settings) for seed in seeds]


def _stored(path: Path) -> list[Source]:
    from sim.io.source import open_source

    found = open_source(path, images=False)
    return [Source(s.name, int(s.source.get("seed", 0)), path=str(s.source.get("path", path))) for s in found]
