"""A sweep: trackers play scenes at values of an axis, placed where the curve bends, until the budget is spent.

First all scenes are played at five values. Then, in turn, the widest uncertainty is reduced: if a curve breaks and its
breaking point's interval is wider than the distance of the two values beside it, more seeds are played; else a value is
added in the middle of them. Without a break, a value is added where the curve is steepest. Every episode is stored when
it is played, so a sweep that was stopped goes on where it was.
"""

from __future__ import annotations

import hashlib
import json
import time
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass, field
from typing import Any

import numpy as np

from scenarios.errors import InputError
from sim.hashing import ENGINE
from sim.types import Array, DetectionMode
from tracking.environment.episode_cache import Source, sources
from tracking.stress.axes import Axis
from tracking.stress.curves import BreakingPoint, breaking_point, curve, overtaking
from tracking.stress.episodes import Contender, EpisodeJob, PlayJobs, Store

FIRST_VALUES = 5
MOST_VALUES = 17
NARROW = 0.05  # share of the axis: a breaking point is known well enough


@dataclass(frozen=True)
class Plan:
    """What is played."""

    scenarios: tuple[str, ...]
    axis: Axis
    seeds: tuple[int, ...]  # all that may be played, the first `start` at once
    start: int
    by: str
    share: float  # a curve breaks where it falls to this share of its easy value
    detections: DetectionMode
    settings: tuple[str, ...] = ()
    episodes: int | None = None  # budget
    minutes: float | None = None


@dataclass
class Sweep:
    """A sweep of several trackers; state: the values of the axis and the number of seeds so far."""

    plan: Plan
    trackers: dict[str, Contender]
    play: PlayJobs
    store: Store
    report: Callable[[str], None] = lambda text: None
    values: list[float] = field(default_factory=list)
    seeds: int = 0
    played: int = 0
    _made: dict[tuple[float, int], tuple[Source, ...]] = field(default_factory=dict)

    def run(self) -> None:
        """Plays until the breaking points are known, or the budget is spent."""
        began = time.monotonic()
        self.values, self.seeds = self.plan.axis.spread(FIRST_VALUES), self.plan.start
        self._require_effect()
        self._play()
        while not self._spent(began) and self._refine():
            self._play()

    def _spent(self, began: float) -> bool:
        over = self.plan.minutes is not None and time.monotonic() - began > 60 * self.plan.minutes
        return over or (self.plan.episodes is not None and self.played >= self.plan.episodes)

    def _require_effect(self) -> None:
        """Raises InputError if the two ends of the axis make the same scenes."""
        easy, hard = (self._sources(value)[0] for value in (self.values[0], self.values[-1]))
        if self.plan.detections != "image" and _content(easy) == _content(hard):
            raise InputError(
                place="--vary", got=self.plan.axis.name, expected="an axis that changes the scenes",
                remedy=f"{self.plan.scenarios[0]} is the same at both ends; pictures are not drawn for these trackers",
            )  # fmt: skip

    def _sources(self, value: float) -> tuple[Source, ...]:
        if (value, self.seeds) not in self._made:
            settings = (*self.plan.settings, *self.plan.axis.settings(value))
            self._made[value, self.seeds] = sources(self.plan.scenarios, self.plan.seeds[: self.seeds], settings)
        return self._made[value, self.seeds]

    def _play(self) -> None:
        for name in self.trackers:
            for value in self.values:
                self._play_value(name, value)

    def _play_value(self, name: str, value: float) -> None:
        wanted = {self._key(name, source, value): source for source in self._sources(value)}
        missing = {key: source for key, source in wanted.items() if key not in self.store.known}
        jobs = [EpisodeJob(self.trackers[name], source, self.plan.detections) for source in missing.values()]
        for (key, source), outcome in zip(missing.items(), self.play(jobs), strict=True):
            facts = {"tracker": name, "scenario": source.name, "seed": source.seed, "value": value}
            self.store.add({"key": key, **facts, **asdict(outcome)})
            self.played += 1
            self.report(f"{name}, {self.plan.axis.name} {value:g}")

    def _key(self, name: str, source: Source, value: float) -> str:
        facts = [ENGINE, name, self.trackers[name].code, self.plan.detections, *map(str, source.key), value]
        return hashlib.sha256(json.dumps(facts).encode()).hexdigest()[:24]

    def rows(self) -> list[dict[str, Any]]:
        """Returns the stored episodes of this sweep, by tracker, scenario, seed and value."""
        wanted = (
            self._key(name, s, value) for name in self.trackers for value in self.values for s in self._sources(value)
        )
        found = [self.store.known[key] for key in wanted if key in self.store.known]
        return sorted(found, key=lambda row: (row["tracker"], row["scenario"], row["seed"], row["value"]))

    def scores(self, name: str) -> Array:
        """Returns the scores (P, V) of a tracker by scene and value; nan for an episode without; 0 for a failed one."""
        columns = []
        for value in self.values:
            rows = [self.store.known.get(self._key(name, source, value)) for source in self._sources(value)]
            columns.append([_score(row, self.plan.by) for row in rows])
        return np.array(columns).T

    @property
    def way(self) -> Array:
        """The values as shares of the way from easy to hard, (V,)."""
        axis = self.plan.axis
        return (np.array(self.values) - axis.easy) / (axis.hard - axis.easy)

    def breaks(self) -> dict[str, BreakingPoint]:
        """Returns the breaking point of each tracker."""
        rng = np.random.default_rng(0)
        return {name: breaking_point(self.way, self.scores(name), self.plan.share, rng) for name in self.trackers}

    def overtakings(self) -> Iterator[tuple[str, str, BreakingPoint]]:
        """Yields pairs of trackers of which the first, better at the easy end, falls behind the second."""
        rng = np.random.default_rng(0)
        every = {name: self.scores(name) for name in self.trackers}
        for first in every:
            for second in every:
                ahead = curve(every[first])[0] > curve(every[second])[0]
                if first != second and ahead:
                    point = overtaking(self.way, every[first], every[second], rng)
                    if np.isfinite(point.at):
                        yield first, second, point

    def _refine(self) -> bool:
        """Adds a value or seeds where least is known; returns False if nothing is left to do."""
        for name, point in self.breaks().items():
            if np.isfinite(point.at):
                if point.high - point.low > NARROW and (self._narrow(point) or self._more_seeds()):
                    return True
            elif np.isfinite(point.low):
                if self._more_seeds():
                    return True
            elif len(self.values) < FIRST_VALUES + 2 and self._bend(name):
                return True
        return False

    def _narrow(self, point: BreakingPoint) -> bool:
        """Adds the middle of the values beside a breaking point, if these are what its interval is wide by."""
        k = int(np.clip(np.searchsorted(self.way, point.at), 1, len(self.way) - 1))
        gap = self.way[k] - self.way[k - 1]
        wide = gap > NARROW / 2 and gap >= (point.high - point.low) / 2
        return wide and len(self.values) < MOST_VALUES and self._insert(k)

    def _bend(self, name: str) -> bool:
        """Adds a value where the curve is steepest."""
        steps = np.abs(np.diff(curve(self.scores(name))))
        return bool(np.isfinite(steps).any()) and self._insert(int(np.nanargmax(steps)) + 1)

    def _insert(self, k: int) -> bool:
        middle = self.plan.axis.between(self.values[k - 1], self.values[k])
        if middle is None:
            return False
        self.values.insert(k, middle)
        return True

    def _more_seeds(self) -> bool:
        """Doubles the seeds, or takes as many more as the budget of episodes allows."""
        more = min(self.seeds, len(self.plan.seeds) - self.seeds)
        if self.plan.episodes is not None:
            each = len(self.trackers) * len(self.values) * len(self._sources(self.values[0])) // self.seeds
            more = min(more, (self.plan.episodes - self.played) // each)
        self.seeds += max(more, 0)
        return more > 0


def _score(row: dict[str, Any] | None, by: str) -> float:
    if row is None:
        return float("nan")
    return 0.0 if row["failed"] else float(row["scores"].get(by, "nan"))


def _content(source: Source) -> bytes:
    from sim.hashing import canonical_hash

    sequence = source.open(())
    truth = sequence.truth
    frames = [frame.detections for frame in sequence.without_pictures()]
    return canonical_hash((None if truth is None else truth.pos, sequence.fps, frames)).encode()
