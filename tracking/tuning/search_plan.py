"""What a search is about, checked before anything is played: tracker, space, scenes, goals.

Training scenes guide the search, validation scenes choose among its best, test scenes (and a suite that was not used)
say what was gained.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

from scenarios.errors import InputError
from sim.types import DetectionMode, Tracker
from sim.versions import runtime
from tracking.config import Config, Param, Value
from tracking.environment.episodes import Source
from tracking.tuning import scenes
from tracking.tuning.goals import ALWAYS, SPEED, Goal, goals
from tracking.tuning.tuned_tracker import Subject, subject_of


@dataclass(frozen=True)
class Plan:
    """A search. base: the defaults, and what was set; space: what is searched; check: a suite that was not used."""

    subject: Subject
    base: Config
    space: tuple[Param, ...]
    suite: tuple[str, ...]
    check: str | None
    seeds: range
    validation: range
    test: range
    check_test: range
    goals: tuple[Goal, ...]
    detections: DetectionMode
    settings: tuple[str, ...]
    trials: int
    prune: float
    finalists: int
    seed: int

    @property
    def tracker(self) -> str:
        """What the tracker is called, without the folder it lies in."""
        return self.subject.name.rpartition("/")[2]

    @property
    def scenes(self) -> str:
        """What the scenes are called, likewise."""
        return ", ".join(map(_bare, self.suite))

    @property
    def defaults(self) -> dict[str, Value]:
        """The first trial."""
        return {p.name: getattr(self.base, p.name) for p in self.space}

    def config(self, values: dict[str, Any]) -> Config:
        """The config of a trial; InputError where its own check refuses these values together."""
        return type(self.base).from_dict({**self.base.as_dict(), **values})

    @cached_property
    def training(self) -> tuple[Source, ...]:
        """Episodes of a trial."""
        return scenes.of(self.suite, self.seeds, self.settings)

    @cached_property
    def validating(self) -> tuple[Source, ...]:
        """Episodes by which the best are judged once more."""
        return scenes.of(self.suite, self.validation, self.settings)

    @cached_property
    def testing(self) -> dict[str, tuple[Source, ...]]:
        """Episodes by which the winner is judged, by what they are called."""
        found = {self.scenes: scenes.of(self.suite, self.test, self.settings)}
        if self.check is not None:
            sensor = [text for text in self.settings if text.startswith("sensor.")]
            found[_bare(self.check)] = scenes.of((self.check,), self.check_test, sensor)
        return found

    def identity(self) -> dict[str, Any]:
        """What makes a trial's value what it is: a study goes on under the same only."""
        return {
            "tracker": self.tracker,
            "code": self.subject.code,
            "versions": _digest(version for name, version in runtime().items() if name != "cpu"),
            "suite": self.scenes,
            "seeds": text(self.seeds),
            "motions": _digest(source.key for source in self.training),
            "detections": self.detections,
            "objective": ", ".join(goal.key for goal in self.goals),
            "searched": ", ".join(p.name for p in self.space),
            "ranges": _digest(repr(p) for p in self.space),
            "fixed": _digest(self.base.as_dict().items()),
            "prune": self.prune,
            "seed": self.seed,
        }


def plan(
    tracker: str | type[Tracker],
    suite: scenes.Scenes,
    trials: int,
    *,
    seeds: range | None = None,
    validation: range | None = None,
    test: range | None = None,
    check: str | None = "",
    objective: str | Iterable[str] = (),
    detections: DetectionMode | None = None,
    only: Iterable[str] = (),
    set: Iterable[str] = (),
    prune: float = 0.1,
    finalists: int = 5,
    seed: int = 0,
) -> Plan:
    """The plan of these wishes (`tracking.tune` explains them), the rest by default; InputError where one cannot be."""
    _positive(trials, prune, finalists, seed)
    subject = subject_of(tracker)
    own, settings = _sorted_settings(set)
    names = scenes.named(suite)
    count = scenes.scenes(names, settings, "--suite")
    other = scenes.unused(names) if check == "" else check
    several = _check_suite(names, other)
    base, mode = subject.config_class().with_set(*own), detections or subject.detections
    if mode != "file" and any(setting.startswith("sensor.") for setting in settings):
        remedy = "leave the sensor out, or add --detections file"
        raise InputError(place="--sensor, --set sensor", got=f"--detections {mode}", expected="file", remedy=remedy)
    made = Plan(
        subject, base, _space(base, own, tuple(only), mode), names, other,
        scenes.chosen_seeds(seeds, "train", count), scenes.chosen_seeds(validation, "val", count),
        scenes.chosen_seeds(test, "test", count), scenes.chosen_seeds(test, "test", several),
        goals([objective] if isinstance(objective, str) else tuple(objective) or (subject.objective,)),
        mode, settings, trials, prune, finalists, seed,
    )  # fmt: skip
    subject.accept(made.training[0], made.detections)
    return made


def every_score(plan: Plan) -> bool:
    """Must the whole catalogue be computed to know what the goals are about?"""
    return any(goal.key not in (*ALWAYS, SPEED) for goal in plan.goals)


def text(seeds: range) -> str:
    """Seeds as `--seeds` takes them."""
    return f"{seeds.start}:{seeds.stop}"


def _positive(trials: int, prune: float, finalists: int, seed: int) -> None:
    for place, value, good, expected in (
        ("--trials", trials, trials >= 1, "1 or more"),
        ("--prune", prune, 0 <= prune < 1, "a probability, 0 (never) or more and under 1"),
        ("--finalists", finalists, finalists >= 1, "1 or more"),
        ("--seed", seed, seed >= 0, "0 or more"),
    ):
        if not good:
            raise InputError(place=place, got=value, expected=expected, remedy="correct it")


def _sorted_settings(settings: Iterable[str]) -> tuple[list[str], tuple[str, ...]]:
    """Settings of the tracker, and of the scenes (`scenario.` taken away, `sensor.` being a part of them)."""
    own, scenes = [], []
    for setting in settings:
        key, _, value = setting.partition("=")
        if key.strip().startswith(("scenario.", "sensor.")):
            scenes.append(f"{key.strip().removeprefix('scenario.')}={value}")
        else:
            own.append(setting.strip())
    return own, tuple(scenes)


def _check_suite(names: Sequence[str], other: str | None) -> int:
    """How many scenes the suite to check on has; InputError where it shares some with what is tuned on."""
    if other is None:
        return 1
    count = scenes.scenes((other,), (), "--check")
    common = scenes.shared(names, (other,))
    if common:
        got = f"{other}, which has {', '.join(common)} of {', '.join(names)}"
        remedy = "choose another suite, or --check none"
        raise InputError(place="--check", got=got, expected="scenes that are not tuned on", remedy=remedy)
    return count


def _space(base: Config, fixed: Sequence[str], only: tuple[str, ...], mode: DetectionMode) -> tuple[Param, ...]:
    """The tunable parameters that were not set and say something about such detections, or those of `only`."""
    held = {setting.removeprefix("tracker.").partition("=")[0].strip() for setting in fixed}
    idle = "points" if mode == "image" else "pixels"
    for name in only:
        param = base.known(name, "--only")
        reason = "set" if name in held else "not tunable" if not param.tunable else ""
        reason = reason or (f"about {idle} alone" if param.sees == idle else "")
        if reason:
            got, remedy = f"{name}, which is {reason}", "leave it out"
            raise InputError(place="--only", got=got, expected="parameters to search", remedy=remedy)
    found = tuple(p for p in base.space() if p.name in only or not (only or p.name in held or p.sees == idle))
    if not found:
        got = "all of them set" if held else f"{type(base).__name__}, which declares none"
        raise InputError(place="tracker", got=got, expected="parameters to search", remedy="leave one free")
    return found


def _bare(name: str) -> str:
    return Path(name).name if name.endswith(".toml") else name


def _digest(parts: Iterable[object]) -> str:
    return hashlib.sha256(json.dumps([str(part) for part in parts]).encode()).hexdigest()[:12]
