"""What a search found, and the files that say so: parameters as TOML, all figures as JSON, plots beside them.

No file holds a time, a host or a path: the same search writes the same bytes.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

from tracking.config import Config
from tracking.tuning.judge import Candidate, Comparison
from tracking.tuning.search_plan import Plan, text

VERSIONS = ("flockscope", "optuna", "numpy", "scipy", "numba")
LONG = 40
"""Characters of a setting that are told."""
MANY = 4
"""Settings of a sensor that are told one by one."""


@dataclass(frozen=True)
class Trial:
    """A trial as plots and tables show it: its values by goal (of one that was given up, an estimate), its parameters,
    the training episodes it was played on, and why it could not be."""

    number: int
    values: tuple[float, ...]
    params: dict[str, Any]
    episodes: int
    pruned: bool = False
    error: str = ""


@dataclass(frozen=True)
class Tuned:
    """The result of `tracking.tune`.

    config: the winner, and default what it is compared with; front: of several goals, all that none beats; importance:
    of each parameter in training, shares; comparisons: what was gained on test scenes; taken_back: what the best had
    changed in vain; validation: what the default and the winner reach there.
    """

    plan: Plan = field(repr=False)
    config: Config
    front: tuple[Candidate, ...] = field(repr=False)
    candidates: tuple[Candidate, ...] = field(repr=False)
    trials: tuple[Trial, ...] = field(repr=False)
    importance: Mapping[str, float] = field(repr=False)
    comparisons: tuple[Comparison, ...] = ()
    taken_back: tuple[str, ...] = ()
    validation: tuple[tuple[float, ...], tuple[float, ...]] = ((), ())
    notes: tuple[str, ...] = ()
    study: str = ""

    @property
    def default(self) -> Config:
        """What the winner is compared with: the tracker's defaults, and what was set."""
        return self.plan.base

    @property
    def changed(self) -> dict[str, tuple[Any, Any]]:
        """What the winner changed: default and new value by name."""
        old, new = self.default.as_dict(), self.config.as_dict()
        return {name: (old[name], new[name]) for name in new if old[name] != new[name]}

    @property
    def pruned(self) -> int:
        """Trials that were given up before their last training scene."""
        return sum(trial.pruned for trial in self.trials)

    @property
    def episodes(self) -> int:
        """Training episodes that were played, in trials that had a value."""
        return sum(trial.episodes for trial in self.trials)

    @property
    def impossible(self) -> int:
        """Trials whose parameters the tracker refused."""
        return sum(bool(trial.error) for trial in self.trials)

    def __str__(self) -> str:
        """What was gained, in lines."""
        return "\n".join(self.lines())

    def lines(self, one: Candidate | None = None) -> list[str]:
        """What was done and what came of it, or of one of a front; training scores are not among it."""
        plan = self.plan
        names = ", ".join(goal.key for goal in plan.goals)
        every = len(self.trials) * len(plan.training)
        given_up = f"{self.pruned} given up early, {self.impossible} impossible"
        told = [
            f"{plan.tracker} tuned on {plan.scenes}, detections {plan.detections}, for {names}",
            f"{len(self.trials)} trials, {self.episodes} of {every} episodes played, {given_up}; "
            f"training seeds {text(plan.seeds)}, validation {text(plan.validation)}, test {text(plan.test)}",
        ]
        if plan.settings:
            told.append("scenes with " + ", ".join(_told(plan.settings)))
        before, after = self.validation if one is None else (self.validation[0], one.validation)
        for goal, a, b in zip(plan.goals, before, after, strict=True):
            told.append(f"validation: {goal.key} {a:.4f} → {b:.4f} (chosen by it: no result)")
        if one is not None:
            return [*told, f"one of {len(self.front)} that no other trial beats by all goals"]
        told += [c.line() for c in self.comparisons]
        return [*told, *self.notes]

    def to_toml(self, one: Candidate | None = None) -> str:
        """A file that `flockscope track --params` reads: the winner's, or one's of a front."""
        chosen = self.config if one is None else one.config
        old = self.default.as_dict()
        lines = []
        for line in chosen.to_toml().splitlines():
            name = line.partition(" = ")[0]
            moved = name in old and chosen.as_dict().get(name) != old[name]
            lines.append(f"{line}  # default {old[name]}" if moved else line)
        about = [*self.lines(one), "versions: " + ", ".join(f"{name} {of}" for name, of in versions().items())]
        return "\n".join([*(f"# {line}" for line in about), *lines, ""])

    def as_dict(self) -> dict[str, Any]:
        """All figures, as JSON takes them."""
        plan = self.plan
        return {
            "settings": plan.identity()
            | {
                "trials": plan.trials, "validation": text(plan.validation), "test": text(plan.test),
                "check": list(plan.testing)[1] if plan.check else None, "check_test": text(plan.check_test),
                "set": list(plan.settings),
            },
            "counts": {
                "trials": len(self.trials), "episodes": self.episodes, "pruned": self.pruned,
                "impossible": self.impossible,
            },
            "params": self.config.as_dict(),
            "changed": {name: {"default": a, "tuned": b} for name, (a, b) in self.changed.items()},
            "taken_back": list(self.taken_back),
            "validation": {
                goal.key: {"default": a, "tuned": b}
                for goal, a, b in zip(plan.goals, *self.validation, strict=True)
            },
            "comparisons": [{**asdict(c), "verdict": c.verdict} for c in self.comparisons],
            "candidates": [_candidate(c) for c in self.candidates],
            "front": [_candidate(c) for c in self.front] if len(plan.goals) > 1 else [],
            "importance": dict(self.importance),
            "notes": list(self.notes),
            "versions": versions(),
        }  # fmt: skip

    def write(self, path: str | Path) -> list[Path]:
        """The parameters to `path`, and beside it all figures (.json) and the plots (.history.svg, .importance.svg);
        of several goals each of the front (.front-1.toml …) and .front.svg. What was written."""
        from sim.io.files.atomic import write_file
        from tracking.tuning.plots import plots

        target = Path(path)
        files = {".json": json.dumps(_plain(self.as_dict()), indent=1, allow_nan=False) + "\n", **plots(self)}
        if len(self.plan.goals) > 1:
            files |= {f".front-{k}.toml": self.to_toml(c) for k, c in enumerate(self.front, 1)}
        for suffix, content in files.items():
            write_file(target.with_suffix(suffix), content.encode())
        write_file(target, self.to_toml().encode())
        return [target, *(target.with_suffix(suffix) for suffix in files)]


def _candidate(one: Candidate) -> dict[str, Any]:
    return {
        "trial": one.trial, "training": list(one.training), "validation": list(one.validation),
        "params": one.config.as_dict(),
    }  # fmt: skip


def versions() -> dict[str, str]:
    """Of what the figures depend on."""
    from importlib.metadata import PackageNotFoundError, version

    found = {}
    for name in VERSIONS:
        try:
            found[name] = version(name)
        except PackageNotFoundError:
            found[name] = "unknown"
    return found


def _plain(value: Any) -> Any:
    """NaN and infinity as null, which JSON lacks."""
    if isinstance(value, dict):
        return {key: _plain(v) for key, v in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(v) for v in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def _told(settings: Sequence[str]) -> Iterator[str]:
    """Settings in words: long values, and a detector's profile, stand in the JSON file."""
    sensor = [setting for setting in settings if setting.startswith("sensor.")]
    profile = len(sensor) > MANY
    if profile:
        yield f"a detector of {len(sensor)} settings"
    for setting in settings:
        if not (profile and setting in sensor):
            yield setting if len(setting) <= LONG else setting[: LONG - 2] + " …"
