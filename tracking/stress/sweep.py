"""A sweep: trackers and the oracle play scenes at values of axes until the budget is spent.

Without an axis, the scenes are played as they are. Along one axis, values are placed where the curves break. First all
scenes are played at five values. Then, in turn, the widest uncertainty is reduced, of the shares of the oracle first,
of the scores next: if a curve breaks and its breaking point's interval is wider than the distance of the two values
beside it, more seeds are played; else a value is added in the middle of them. Over two axes, all scenes are played at a
grid of five by five values, then with more seeds while there is budget.

The budget is a number of episodes, or a time, which is converted to episodes by the pace so far. Along one axis, the
first round takes at most half of it: with fewer seeds than `start`, or if these would be fewer than two scenes, with
three values of each axis. A later round is played with as many seeds as the rest allows.

The oracle has the detections that a tracker gets, and the true ids: what is lost in its score is not the tracker's
fault. Trackers with different inputs have an oracle each. It does not count as an episode of the budget. Every episode
is stored when it is played, so a sweep that was stopped goes on where it was.
"""

from __future__ import annotations

import hashlib
import json
import shlex
import time
from collections.abc import Callable, Iterable, Sequence
from dataclasses import asdict, dataclass, field
from functools import cached_property
from itertools import product
from typing import Any

import numpy as np

from scenarios.errors import InputError
from scenarios.loading.toml_files import Setting
from sim.hashing import runtime
from sim.types import Array, DetectionMode
from tracking.episodes.episode import streams_for
from tracking.episodes.parallel_episodes import EpisodeTask, opened_sources
from tracking.episodes.sources import Source, sources
from tracking.episodes.tuned_tracker import TunedTracker
from tracking.running.detection_mode import input_kind
from tracking.stress.axes import Axis
from tracking.stress.breaking_points import BreakingPoint, Frontier, breaking_point, frontier
from tracking.stress.scene_player import ORACLE, OracleTask, PlayScenes, Store

FIRST_VALUES = (5, 3)  # the second if the budget allows no two scenes at the first
MOST_VALUES = 17
NARROW = 0.05  # share of the axis: a breaking point is known well enough
ROUNDING = 1e-9
FIRST_SHARE = 0.5  # of the budget, for the first values of one axis

Values = tuple[float, ...]  # one for each axis


@dataclass(frozen=True)
class Plan:
    """The settings of a sweep: scenarios, axes, seeds, score, input and budget."""

    scenarios: tuple[str, ...]
    axes: tuple[Axis, ...]
    seeds: tuple[int, ...]  # all that may be played, the first `start` at once
    start: int
    by: str
    share: float  # the limit: a curve breaks where it falls to this share of its easy value
    detections: DetectionMode
    settings: tuple[str, ...] = ()
    episodes: int | None = None  # budget
    minutes: float | None = None

    def settings_at(self, values: Values) -> tuple[str | Setting, ...]:
        """Returns the settings of scenes at these values, one value for each axis."""
        own = (setting for axis, value in zip(self.axes, values, strict=True) for setting in axis.settings(value))
        return (*self.settings, *own)


@dataclass(frozen=True)
class Scene:
    """A scene (scenario and seed) and the value of each axis with which it is made."""

    source: Source
    values: Values


@dataclass
class Sweep:
    """A sweep of several trackers; state: the values and the number of seeds so far, and all scenes that were played.

    Over two axes the values are those of a grid, the last axis fastest.
    """

    plan: Plan
    trackers: dict[str, TunedTracker]
    run_scenes: PlayScenes
    store: Store
    report: Callable[[str], None] = lambda text: None
    values: list[Values] = field(default_factory=list)
    seeds: int = 0
    scenes: dict[tuple[object, ...], Scene] = field(default_factory=dict)
    rounds: int = 0
    stopped: bool = False  # by the budget, before the breaking points were known well enough
    began: float = field(default_factory=time.monotonic)
    _paced: tuple[float, int] = (0.0, 0)  # s, and the trackers' episodes played in them
    _made: dict[tuple[Values, int], tuple[Scene, ...]] = field(default_factory=dict)

    def run(self) -> None:
        """Plays until the breaking points are known, or the budget is spent."""
        self.check_scenes()
        self._begin()
        self.play_values()
        while self._refine():
            self.play_values()

    @property
    def played(self) -> int:
        """Number of the trackers' episodes on the scenes so far, stored ones included."""
        return sum(self.row(name, scene) is not None for scene in self.scenes.values() for name in self.trackers)

    def left(self) -> float:
        """Returns how many episodes the budget still allows, by minutes at the pace so far; inf without a budget."""
        left = np.inf if self.plan.episodes is None else self.plan.episodes - self.played
        if self.plan.minutes is not None:
            seconds, (spent, count) = 60 * self.plan.minutes - (time.monotonic() - self.began), self._paced
            left = min(left, (np.inf if seconds > 0 else 0.0) if not count else seconds * count / spent)
        return left

    @property
    def taken_over(self) -> dict[str, Any]:
        """The number of the trackers' episodes so far that were stored before, and when the last of them was stored."""
        keys = {self._key(name, scene) for scene in self.scenes.values() for name in self.trackers}
        count = len(keys & self.store.taken)
        return {"episodes": count, "stored": self.store.date if count else None}

    def spent(self) -> bool:
        """Returns True if the budget of time or of episodes is spent."""
        return self.left() < 1

    def check_scenes(self) -> None:
        """Raises InputError if a tracker cannot play the scenes, or the two ends of an axis make the same ones."""
        plan, easy = self.plan, tuple(axis.easy for axis in self.plan.axes)
        (first, *_) = sources(plan.scenarios, plan.seeds[:1], plan.settings_at(easy))
        for tracker in self.trackers.values():
            tracker.check_input(first, plan.detections, None)
        for k, axis in enumerate(plan.axes):
            hard = (*easy[:k], axis.hard, *easy[k + 1 :])
            (other, *_) = sources(plan.scenarios, plan.seeds[:1], plan.settings_at(hard))
            unused = plan.detections != "file" and all(s.key.startswith("sensor.") for s in axis.settings(axis.hard))
            if unused or (plan.detections != "image" and _content(first) == _content(other)):
                remedy = f"{first.name} is the same at both ends; pictures are not drawn for these trackers"
                if unused:
                    remedy = f"--detections {plan.detections} does not use [sensor]: leave it out, or vary other keys"
                expected = "an axis that changes the scenes"
                raise InputError(place="--vary", got=axis.name, expected=expected, remedy=remedy)

    def _scenes(self, values: Values) -> tuple[Scene, ...]:
        if (values, self.seeds) not in self._made:
            found = sources(self.plan.scenarios, self.plan.seeds[: self.seeds], self.plan.settings_at(values))
            self._made[values, self.seeds] = tuple(Scene(source, values) for source in found)
        return self._made[values, self.seeds]

    def _begin(self) -> None:
        """Chooses the first values and the number of seeds so that the first round leaves a part of the budget."""
        self.seeds = 1
        if self.plan.minutes is not None:  # for the pace at both ends
            ends = (tuple(axis.easy for axis in self.plan.axes), tuple(axis.hard for axis in self.plan.axes))
            self.play([scene for values in ends for scene in self._scenes(values)], [*self.trackers])
        budget = self.left() + self.played
        if len(self.plan.axes) == 1:
            budget *= FIRST_SHARE
        for count in FIRST_VALUES:
            self.values = list(product(*(axis.spread(count) for axis in self.plan.axes)))
            each = len(self.values) * self._scenes_of_a_seed
            seeds = int(min(budget / (each * len(self.trackers)), self.plan.start))
            if seeds * self._scenes_of_a_seed >= min(2, self.plan.start * self._scenes_of_a_seed):
                break
        self.seeds = max(seeds, 1)

    @cached_property
    def _scenes_of_a_seed(self) -> int:
        return len(sources(self.plan.scenarios, self.plan.seeds[:1], self.plan.settings))

    def play_values(self) -> None:
        """Plays all trackers at the values and with the seeds so far."""
        self.rounds += 1
        self.play([scene for values in self.values for scene in self._scenes(values)], [*self.trackers])

    def play(self, scenes: Sequence[Scene], trackers: Sequence[str]) -> None:
        """Plays the episodes of the trackers and the oracle on these scenes that are not stored."""
        wanted = {(*scene.source.key, scene.values): scene for scene in scenes}
        self.scenes.update(wanted)
        known, (before, count), began = self.store.known, self._paced, time.monotonic()
        players = (*trackers, *dict.fromkeys(self.oracles[name] for name in trackers))
        every = (
            (scene, [name for name in players if self._key(name, scene) not in known]) for scene in wanted.values()
        )
        jobs = [(scene, names) for scene, names in every if names]
        tasks = [tuple(self._task(name, scene.source) for name in names) for scene, names in jobs]
        for (scene, names), outcomes in zip(jobs, self.run_scenes(tasks), strict=True):
            for name, outcome in zip(names, outcomes, strict=True):
                facts = {"tracker": name, "scenario": scene.source.name, "seed": scene.source.seed}
                settings = [*map(str, self.plan.settings_at(scene.values))]
                self.store.add({"key": self._key(name, scene), **facts, "settings": settings, **asdict(outcome)})
                if name in self.trackers:
                    count += 1
                    self._paced = before + time.monotonic() - began, count
                    self.report(" ".join([name, scene.source.name, *(f"{value:g}" for value in scene.values)]))

    def _task(self, name: str, source: Source) -> EpisodeTask | OracleTask:
        if name in self.trackers:
            return EpisodeTask(self.trackers[name], source, {}, self.plan.detections, every_score=True)
        return OracleTask(self._of_oracle(name), source, self.plan.detections)

    @cached_property
    def oracles(self) -> dict[str, str]:
        """By tracker, the name of the oracle that gets the same input."""
        if len({tracker.needs for tracker in self.trackers.values()}) == 1:
            return dict.fromkeys(self.trackers, ORACLE)
        easy, mode = tuple(axis.easy for axis in self.plan.axes), self.plan.detections
        (first, *_) = sources(self.plan.scenarios, self.plan.seeds[:1], self.plan.settings_at(easy))
        kinds = {}
        for name, tracker in self.trackers.items():
            sequence = first.open(streams_for(tracker.tracker, mode))
            frames = () if mode == "image" else sequence.without_pictures()
            kinds[name] = input_kind(tracker.needs, mode, sequence, frames)
        one = len({*kinds.values()}) == 1
        return {name: ORACLE if one else f"{ORACLE} from {kind}" for name, kind in kinds.items()}

    def _of_oracle(self, oracle: str) -> TunedTracker:
        """Returns the first tracker with the input of an oracle."""
        return next(self.trackers[name] for name, own in self.oracles.items() if own == oracle)

    def _key(self, name: str, scene: Scene) -> str:
        tracker = self.trackers.get(name)
        own = str(tracker) if tracker else self._of_oracle(name).needs
        facts = [runtime(), name, own, self.plan.detections, *map(str, scene.source.key)]
        return hashlib.sha256(json.dumps(facts).encode()).hexdigest()[:24]

    @property
    def oracle_names(self) -> tuple[str, ...]:
        """The names of all oracles."""
        return tuple(dict.fromkeys(self.oracles.values()))

    def rows(self) -> list[dict[str, Any]]:
        """Returns the stored episodes of this sweep as dicts, sorted by tracker, scenario, seed and values; "values" is
        a dict by axis, "oracle" the oracle's score (`score`) from the same input."""
        found = []
        for scene in self.scenes.values():
            values = {axis.name: value for axis, value in zip(self.plan.axes, scene.values, strict=True)}
            rows = ((name, self.row(name, scene)) for name in (*self.trackers, *self.oracle_names))
            for name, row in rows:
                if row is not None:
                    best = self.score(self.oracles.get(name, name), scene)
                    found.append({**row, "tracker": name, "values": values, "oracle": best})
        return sorted(found, key=lambda row: (row["tracker"], row["scenario"], row["seed"], *row["values"].values()))

    def row(self, name: str, scene: Scene) -> dict[str, Any] | None:
        """Returns the stored episode of a tracker or the oracle on a scene, None if there is none."""
        return self.store.known.get(self._key(name, scene))

    def score(self, name: str, scene: Scene) -> float:
        """Returns the plan's score of a tracker or the oracle on a scene: 0 if the tracker failed, nan if the episode
        is not played or has no such score."""
        row = self.row(name, scene)
        if row is None:
            return float("nan")
        return 0.0 if row["failed"] else float(row["scores"].get(self.plan.by, "nan"))

    def scores(self, name: str) -> Array:
        """Returns the scores (P, V) of a tracker or the oracle on P scenes at V values, each as `score` returns it."""
        return np.array([[self.score(name, scene) for scene in self._scenes(values)] for values in self.values]).T

    @property
    def way(self) -> Array:
        """The values of the only axis as shares of the way from easy to hard, (V,)."""
        (axis,) = self.plan.axes
        return (np.array([value for (value,) in self.values]) - axis.easy) / (axis.hard - axis.easy)

    def breaks(self) -> dict[str, BreakingPoint]:
        """Returns the breaking point by score of each tracker and oracle on the only axis."""
        names = (*self.trackers, *self.oracle_names)
        return {name: breaking_point(self.way, self.scores(name), self.plan.share) for name in names}

    def share_breaks(self) -> dict[str, BreakingPoint]:
        """Returns the breaking point by share of the oracle of each tracker on the only axis."""
        return {
            name: breaking_point(self.way, self.scores(name), self.plan.share, self.scores(best))
            for name, best in self.oracles.items()
        }

    def frontier(self, name: str) -> Frontier:
        """Returns the frontier of a tracker over two axes."""
        second = self.plan.axes[1]
        way = np.array([*dict.fromkeys(value for _, value in self.values)])
        scores, best = self.scores(name), self.scores(self.oracles[name])
        return frontier((way - second.easy) / (second.hard - second.easy), scores, best, self.plan.share)

    def cell(self, point: BreakingPoint) -> bool:
        """Returns True if the interval of a breaking point is wide, and no narrower than the two values beside it."""
        k = self._place(point)
        gap = self.way[k] - self.way[k - 1]
        return bool(gap > NARROW and point.high - point.low <= gap + ROUNDING)

    def _place(self, point: BreakingPoint) -> int:
        return int(np.clip(np.searchsorted(self.way, point.at), 1, len(self.way) - 1))

    def _refine(self) -> bool:
        """Adds a value or seeds where least is known; returns False if nothing is left to do."""
        if len(self.plan.axes) != 1:
            limited = self.plan.episodes is not None or self.plan.minutes is not None
            return (limited or not self.plan.axes) and self._add_seeds(self.seeds)
        own = (point for name, point in self.breaks().items() if name in self.trackers)
        for points in (self.share_breaks().values(), own):
            # The widest interval comes first; one that is not known at all counts as 0 wide.
            for point in sorted(points, key=lambda p: p.low - p.high if np.isfinite(p.low) else 0.0):
                if np.isfinite(point.at):
                    if point.high - point.low > NARROW and (self._narrow(point) or self._add_seeds(self.seeds)):
                        return True
                elif np.isfinite(point.low) and self._add_seeds(self.seeds):
                    return True
        return False

    def _narrow(self, point: BreakingPoint) -> bool:
        """Adds the middle of the values beside a breaking point, if these are what its interval is wide by."""
        k = self._place(point)
        gap = self.way[k] - self.way[k - 1]
        wide = gap > NARROW / 2 and gap >= point.high - point.low - ROUNDING
        (axis,) = self.plan.axes
        middle = axis.between(*self.values[k - 1], *self.values[k])
        if not wide or len(self.values) >= MOST_VALUES or middle is None:
            return False
        if self.left() < self.seeds * self._scenes_of_a_seed * len(self.trackers):
            self.stopped = True
            return False
        self.values.insert(k, (middle,))
        return True

    def _add_seeds(self, more: int) -> bool:
        """Adds seeds, or as many as the budget allows; returns True if it did."""
        more = min(more, len(self.plan.seeds) - self.seeds)
        allowed = self.left() / (len(self.trackers) * len(self.values) * self._scenes_of_a_seed)
        self.stopped |= more > 0 and allowed < 1
        more = int(min(more, allowed))
        self.seeds += max(more, 0)
        return more > 0


def key_of(setting: str) -> str:
    """Returns the key of a setting "key=value"."""
    return setting.partition("=")[0].strip()


def last_of_each_key(settings: Iterable[str]) -> tuple[str, ...]:
    """Returns the settings "key=value" with each key once: the last value of a key counts."""
    return tuple({key_of(text): text for text in settings}.values())


def generate_command(scenario: str, seed: int, settings: Iterable[str], out: str) -> str:
    """Returns the command line (text) that generates one scene into the folder `out`; of several settings of a key the
    last one counts."""
    words = ["flockscope", "generate", scenario, "--seeds", f"{seed}:{seed + 1}", "--out", out]
    return shlex.join([*words, *(word for text in last_of_each_key(settings) for word in ("--set", text))])


def _content(source: Source) -> bytes:
    from sim.hashing import canonical_hash

    sequence = opened_sources().open(source).sequence
    truth = sequence.truth
    frames = [frame.detections for frame in sequence.without_pictures()]
    return canonical_hash((None if truth is None else truth.pos, sequence.fps, frames)).encode()
