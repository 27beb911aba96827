"""The plan of a search, checked before anything is played: tracker, parameters to search, scenes, goals.

Training scenes guide the search. Validation scenes choose among its best trials. Test scenes, and a second suite that
was not tuned on, measure the gain.

Training, validation and test seeds come from ranges that do not overlap: 0:10000, 10000:20000 and 20000:30000. The
second test suite shares no scenario with the suite that is tuned on. Recordings are refused.
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
from scenarios.loading.resolve import is_catalogued, read_suite, suite_file
from scenarios.loading.toml_files import find
from sim.dataset.splits import SPLITS
from sim.hashing import runtime
from sim.types import DetectionMode
from tracking.config import Config, Param, Value
from tracking.episodes.episode import Source, sources
from tracking.episodes.tuned_tracker import TunedTracker, tuned_tracker
from tracking.parameter_space import space_of
from tracking.tuning.candidates import FAST_KEYS, SPEED, Goal, goals_of
from tracking.tuning.options import TuneOptions

# Of each split: name of its option, name in texts, least number of episodes that its default seeds make.
SPLIT_OPTIONS = {
    "train": ("seeds", "training", 16),
    "val": ("validation", "validation", 48),
    "test": ("test", "test", 100),
}

LEAST_SEEDS = 2  # Least number of default seeds of each scene.

CHECK_SUITES = ("friends-meet", "crossing")  # Candidates for the default of --check, in order of preference.


def chosen_seeds(seeds: range | None, split: str, scenes: int) -> range:
    """Returns the seeds, or if they are None the default: the first seeds of the split ("train", "val" or "test"), as
    many as make enough episodes with this number of scenes. Raises InputError for seeds of another split."""
    low, high = next((low, high) for name, low, high in SPLITS if name == split)
    option, word, episodes = SPLIT_OPTIONS[split]
    if seeds is None:
        return range(low, low + max(LEAST_SEEDS, -(-episodes // scenes)))
    if not (isinstance(seeds, range) and low <= seeds.start < seeds.stop <= high):
        raise InputError(
            place=f"--{option}", got=seeds_text(seeds), expected=f"{word} seeds, a range out of {low}:{high}",
            remedy=f"write for example {low}:{low + 4}: training, validation and test are kept apart",
        )  # fmt: skip
    return seeds


def count_scenes(names: Sequence[str], settings: Sequence[str], option: str) -> int:
    """Returns the number of scenes of the suites, scenarios and files `names`, each with one seed. Raises InputError,
    about `option`, for recordings and unknown names."""
    for name in names:
        if not is_catalogued(name) and Path(name).exists():
            raise InputError(
                file=name, place=option, got="a recording or stored data",
                expected="scenes to simulate: nothing is tuned on what was recorded",
                remedy="give a suite or scenario; `flockscope fit sensor` imitates the detector of a recording",
            )  # fmt: skip
    try:
        return len(sources(names, (0,), settings))
    except InputError as error:
        raise error if error.place else error.replaced(place=option) from None


def default_check_suite(names: Sequence[str]) -> str | None:
    """Returns the first of friends-meet and crossing that shares no scenario with `names`, None if there is none."""
    return next((suite for suite in CHECK_SUITES if not shared_scenarios(names, (suite,))), None)


def shared_scenarios(names: Sequence[str], others: Sequence[str]) -> list[str]:
    """Returns the names of the scenarios that both lists of suites, scenarios and files contain, sorted; [] if none."""
    common = {file for name in names for file in _files(name)} & {file for name in others for file in _files(name)}
    return sorted(Path(file).stem for file in common)


def _files(name: str) -> list[str]:
    suite = suite_file(name)
    if suite is None:
        return [str(find(name).resolve())]
    return [str(find(row.scenario, beside=suite.parent).resolve()) for row in read_suite(suite).entry]


@dataclass(frozen=True)
class SearchPlan:
    """The plan of a search: options that fit together, and everything that follows from them."""

    options: TuneOptions
    tracker: TunedTracker
    base: Config  # its config with the values that the option `set` fixed
    space: tuple[Param, ...]  # the parameters to search
    suite: tuple[str, ...]  # names of what is tuned on
    check: str | None  # second suite to test on
    seeds: dict[str, range]  # by name of the split, and "check": test seeds of the second suite
    goals: tuple[Goal, ...]  # at least one; the first decides
    detections: DetectionMode
    scene_settings: tuple[str, ...]  # "key=value" overrides of the scenes

    @property
    def tracker_name(self) -> str:
        """The name of the tracker: as registered, "file.py:Class" without the folder, or the name of the class."""
        return self.tracker.name.rpartition("/")[2]

    @property
    def suite_name(self) -> str:
        """The names of the suites, scenarios and files that are tuned on, joined by ", "; without folders."""
        return ", ".join(map(_without_folder, self.suite))

    @property
    def check_name(self) -> str | None:
        """The name of the second suite without its folder, None if there is none; " (--check)" is appended if it equals
        `suite_name`."""
        name = None if self.check is None else _without_folder(self.check)
        return f"{name} (--check)" if name == self.suite_name else name

    @property
    def defaults(self) -> dict[str, Value]:
        """The values of the searched parameters in the first trial, a dict by parameter name."""
        return {p.name: getattr(self.base, p.name) for p in self.space}

    @property
    def needs_every_score(self) -> bool:
        """True if some goal is other than objective, HOTA, group_F1 and frames/s: all scores must then be computed."""
        return any(goal.key not in (*FAST_KEYS, SPEED) for goal in self.goals)

    def config(self, values: dict[str, Any]) -> Config:
        """Returns the base config with these values by parameter name. Raises InputError if they are not allowed."""
        return type(self.base).from_dict({**self.base.as_dict(), **values})

    @cached_property
    def training(self) -> tuple[Source, ...]:
        """The sources of the training episodes of each trial: every scene of the suite with every training seed."""
        return sources(self.suite, self.seeds["train"], self.scene_settings)

    @cached_property
    def validation(self) -> tuple[Source, ...]:
        """The sources of the episodes that choose among the best trials."""
        return sources(self.suite, self.seeds["val"], self.scene_settings)

    @cached_property
    def tests(self) -> dict[str, tuple[Source, ...]]:
        """The sources of the test episodes, by `suite_name` and `check_name`."""
        found = {self.suite_name: sources(self.suite, self.seeds["test"], self.scene_settings)}
        if self.check is not None and self.check_name is not None:
            sensor = [setting for setting in self.scene_settings if setting.startswith("sensor.")]
            found[self.check_name] = sources((self.check,), self.seeds["check"], sensor)
        return found

    def identity(self) -> dict[str, Any]:
        """Returns a dict, for JSON, of everything that the value of a trial depends on; long parts are hashed."""
        return {
            "tracker": self.tracker_name,
            "code": self.tracker.code,
            "step_timeout": self.options.step_timeout,
            "versions": _digest(runtime().values()),
            "suite": self.suite_name,
            "seeds": seeds_text(self.seeds["train"]),
            "motions": _digest(source.key for source in self.training),
            "detections": self.detections,
            "similarity": self.options.similarity or "by the data",
            "objective": ", ".join(goal.key for goal in self.goals),
            "searched": ", ".join(p.name for p in self.space),
            "ranges": _digest(repr(p) for p in self.space),
            "fixed": _digest(self.base.as_dict().items()),
            "seed": self.options.seed,
        }


def search_plan(options: TuneOptions) -> SearchPlan:
    """Returns the plan that follows from the options, with defaults for everything that the options leave open. Raises
    InputError if options are wrong or contradict each other."""
    tracker = tuned_tracker(options.tracker, options.step_timeout)
    fixed, scene_settings = _split_settings(options.set)
    suite = (str(options.suite),) if isinstance(options.suite, str | Path) else tuple(map(str, options.suite))
    scenes = count_scenes(suite, scene_settings, "--suite")
    check = default_check_suite(suite) if options.check == "" else options.check
    check_scenes = _count_check_scenes(suite, check)
    base, detections = tracker.config_class().with_set(*fixed), options.detections or tracker.detections
    if detections != "file" and any(setting.startswith("sensor.") for setting in scene_settings):
        remedy = "remove the sensor, or add --detections file"
        raise InputError(
            place="--sensor, --set sensor", got=f"--detections {detections}", expected="file", remedy=remedy
        )
    space = _space(base, fixed, tuple(options.only), detections)
    given = {"train": options.seeds, "val": options.validation, "test": options.test}
    seeds = {split: chosen_seeds(own, split, scenes) for split, own in given.items()}
    seeds["check"] = chosen_seeds(options.test, "test", check_scenes)
    keys = (options.objective,) if isinstance(options.objective, str) else tuple(options.objective)
    goals = goals_of(keys or (tracker.objective,))
    plan = SearchPlan(options, tracker, base, space, suite, check, seeds, goals, detections, scene_settings)
    tracker.check_input(plan.training[0], detections, options.similarity)
    return plan


def seeds_text(seeds: range) -> str:
    """Returns a range of seeds as "start:stop", stop excluded, as the option `--seeds` takes it."""
    return f"{seeds.start}:{seeds.stop}" if isinstance(seeds, range) else repr(seeds)


def _split_settings(settings: Iterable[str]) -> tuple[list[str], tuple[str, ...]]:
    tracker, scenes = [], []
    for setting in settings:
        key, _, value = setting.partition("=")
        if key.strip().startswith(("scenario.", "sensor.")):
            scenes.append(f"{key.strip().removeprefix('scenario.')}={value}")
        else:
            tracker.append(setting.strip())
    return tracker, tuple(scenes)


def _count_check_scenes(suite: Sequence[str], check: str | None) -> int:
    if check is None:
        return 1
    count = count_scenes((check,), (), "--check")
    common = shared_scenarios(suite, (check,))
    if common:
        got = f"{check}, which has {', '.join(common)} of {', '.join(suite)}"
        remedy = "choose another suite, or --check none"
        raise InputError(place="--check", got=got, expected="scenes that are not tuned on", remedy=remedy)
    return count


def _space(base: Config, settings: Sequence[str], only: tuple[str, ...], mode: DetectionMode) -> tuple[Param, ...]:
    fixed = {setting.removeprefix("tracker.").partition("=")[0].strip() for setting in settings}
    useful = [p for p in space_of(type(base), mode) if p.name not in fixed]
    found = tuple(p for p in useful if p.name in only or not only)
    for name in only:
        if base.known(name, "--only") not in found:
            expected = "tunable parameters that have an effect with these detections and are not set"
            raise InputError(place="--only", got=name, expected=expected, remedy="remove it")
    if not found:
        got = "all of them set" if fixed else f"{type(base).__name__}, which declares none"
        raise InputError(place="tracker", got=got, expected="parameters to search", remedy="leave one free")
    return found


def _without_folder(name: str) -> str:
    return Path(name).name if name.endswith(".toml") else name


def _digest(parts: Iterable[object]) -> str:
    return hashlib.sha256(json.dumps([str(part) for part in parts]).encode()).hexdigest()[:12]
