"""The result of a search and its files: parameters as TOML, all figures as JSON, plots as SVG.

No file holds a time, a host or a folder: the same search writes the same bytes.

The plots, by matplotlib, are the history of the trials and the importance of the parameters.
Optuna's own plots show training values as if they were results.
"""

from __future__ import annotations

import io
import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from scenarios.errors import counted
from sim.hashing import installed
from sim.store.atomic import write_file
from sim.store.tables import plain
from tracking.config import Config
from tracking.tuning.adaptive_search import Adapted
from tracking.tuning.candidates import Candidate, Comparison, TrialRecord
from tracking.tuning.search_plan import SearchPlan, seeds_text

BLUE, ORANGE = "#0b6bcb", "#d4600a"
SHOWN = 1.0  # Of the range from the best value to the worst quarter: what is shown beyond; worse ones are marked.
ROOM = 0.1  # of the range that is shown, above the best value


def history_plot(plan: SearchPlan, records: Sequence[TrialRecord]) -> str:
    """Returns an SVG text: plot of the first goal's training value of every trial, in the order of the search."""
    goal, trials = plan.goals[0], [t for t in records if t.values]
    figure, axes = _figure(f"{_title(plan)}: {counted(len(records), 'trial')}")
    numbers, values = [t.number for t in trials], [t.values[0] for t in trials]
    axes.scatter(numbers, values, color=BLUE, label="trials")
    best = values[:1]
    for value in values[1:]:
        best.append(value if goal.gain(best[-1], value) > 0 else best[-1])
    axes.step(numbers, best, where="post", color=ORANGE, label="best so far")
    for t in trials:
        if t.params == plan.defaults:
            axes.axhline(t.values[0], color="grey", linestyle="--", label="defaults")
    if values:  # trials that lose by far would flatten the rest
        bad = float(np.quantile(values, 0.25 if goal.higher else 0.75))
        edge = bad + SHOWN * (bad - best[-1])
        beyond = [t.number for t in trials if goal.gain(edge, t.values[0]) < 0]
        if beyond and bad != best[-1]:
            axes.plot(beyond, [edge] * len(beyond), "|", color=BLUE, label="far worse")
            axes.set_ylim(sorted((edge, best[-1] + ROOM * (best[-1] - edge))))
    axes.xaxis.get_major_locator().set_params(integer=True)
    axes.set(xlabel="trial", ylabel=f"{goal.key}, training scenes (optimised: no result)")
    axes.legend(fontsize=8)
    return _svg(figure)


def importance_plot(plan: SearchPlan, importance: Mapping[str, float]) -> str:
    """Returns an SVG text: bar chart of the importance of each parameter. importance: shares (0 to 1) by name."""
    ranked = sorted(importance, key=lambda name: importance[name])
    title = f"{_title(plan)}: importance for {plan.goals[0].key} in training (PED-ANOVA)"
    figure, axes = _figure(title, 1 + len(ranked) / 3)
    axes.barh(ranked, [importance[name] for name in ranked], color=BLUE)
    return _svg(figure)


def _figure(title: str, height: float = 4.0) -> tuple[Any, Any]:
    from matplotlib.figure import Figure

    figure = Figure(figsize=(7.6, height), layout="constrained")
    axes = figure.add_subplot()
    axes.set_title(title, fontsize=10)
    return figure, axes


def _svg(figure: Any) -> str:
    from matplotlib import rc_context

    text = io.StringIO()
    with rc_context({"svg.hashsalt": "flockscope", "svg.fonttype": "none"}):  # the same search, the same bytes
        figure.savefig(text, format="svg", metadata={"Date": None})
    return text.getvalue()


def _title(plan: SearchPlan) -> str:
    return f"{plan.tracker_name} on {plan.suite_name}"


def short(value: object) -> str:
    """Returns the value of a parameter as text, a float with four significant digits."""
    return f"{value:.4g}" if isinstance(value, float) else str(value)


PACKAGES = ("flockscope", "optuna", "numpy", "scipy", "numba")  # Packages whose versions are written into the files.
MANY = 4  # Greatest number of sensor settings that the text shows one by one.


@dataclass(frozen=True)
class TuningResult:
    """The result of `tracking.tune`.

    Attributes:
        plan: The plan of the search.
        config: The winning config, with all parameters.
        front: With several goals, the candidates that no other dominates, sorted by the first goal, best first; with
            one goal ().
        candidates: The defaults, then the best trials, with their values on the validation scenes.
        trials: All finished trials in the order of the search, with impossible ones.
        importance: By parameter, the share (0 to 1) of the first goal's training values that it explains.
        comparisons: Comparisons of the winner with the defaults on the test scenes; () if the defaults won.
        validation: The values on the validation scenes, one per goal: a tuple of the defaults, then of the winner.
        notes: Remarks for the reader.
        left_out: A line for each scene whose script did not come true.
        adapted: The policy that was searched on top of the config, and its comparisons with it; None if none was.
        taken_over: The number of "trials" and of held-out "episodes" that an earlier call had stored, and when the last
            trial was "stored", None if there was none. It stands in no file.
    """

    plan: SearchPlan = field(repr=False)
    config: Config
    front: tuple[Candidate, ...] = field(repr=False)
    candidates: tuple[Candidate, ...] = field(repr=False)
    trials: tuple[TrialRecord, ...] = field(repr=False)
    importance: Mapping[str, float] = field(repr=False)
    comparisons: tuple[Comparison, ...] = ()
    validation: tuple[tuple[float, ...], tuple[float, ...]] = ((), ())
    notes: tuple[str, ...] = ()
    left_out: tuple[str, ...] = ()
    taken_over: Mapping[str, Any] = field(default_factory=dict)
    adapted: Adapted | None = None

    @property
    def default(self) -> Config:
        """The config that the winner is compared with: the tracker's defaults with the values that `set` fixed."""
        return self.plan.base

    @property
    def changed(self) -> dict[str, tuple[Any, Any]]:
        """The parameters in which the winner differs from the defaults: by name, (default, new value)."""
        old, new = self.default.as_dict(), self.config.as_dict()
        return {name: (old[name], new[name]) for name in new if old[name] != new[name]}

    @property
    def counts(self) -> dict[str, int]:
        """Numbers of "trials" and of "impossible" ones, whose parameters the tracker refused or failed with."""
        return {"trials": len(self.trials), "impossible": sum(bool(t.error) for t in self.trials)}

    def __str__(self) -> str:
        """Returns the lines of `lines()` (settings, counts, values, comparisons, notes) as one text."""
        return "\n".join(self.lines())

    def lines(self, chosen: Candidate | None = None) -> list[str]:
        """Returns lines of text: settings, counts, validation values, and the comparisons and notes on the winner.
        chosen: a candidate of the front, whose lines are returned instead, without comparisons and notes."""
        plan, seeds = self.plan, {name: seeds_text(seeds) for name, seeds in self.plan.seeds.items()}
        names = ", ".join(goal.key for goal in plan.goals)
        chosen_similarity = plan.options.similarity
        compared = "" if chosen_similarity is None else f", people compared by {chosen_similarity}"
        counts, scenes = self.counts, counted(len(plan.training), "episode")
        lines = [
            f"{plan.tracker_name} tuned on {plan.suite_name}, detections {plan.detections}, for {names}{compared}",
            f"{counted(counts['trials'], 'trial')} of {scenes}, {counts['impossible']} impossible; "
            f"training seeds {seeds['train']}, validation {seeds['val']}, test {seeds['test']}",
        ]
        if plan.scene_settings:
            lines.append("scenes with " + ", ".join(_short_settings(plan.scene_settings)))
        before, after = self.validation if chosen is None else (self.validation[0], chosen.validation)
        for goal, a, b in zip(plan.goals, before, after, strict=True):
            lines.append(f"validation: {goal.key} {a:.4f} → {b:.4f} (chosen by it: no result)")
        if chosen is not None:
            return [*lines, f"one of {len(self.front)} that no other trial beats by all goals"]
        lines += [c.line() for c in self.comparisons]
        lines += [] if self.adapted is None else [f"policy on {c.line()}" for c in self.adapted.comparisons]
        lines += [] if self.adapted is None else [self.adapted.line]
        return [*lines, *self.notes, *(f"left out: {scene}" for scene in self.left_out)]

    def to_toml(self, chosen: Candidate | None = None) -> str:
        """Returns a TOML text of all parameters of the winner, or of `chosen`, a candidate of the front."""
        config = self.config if chosen is None else chosen.config
        old = self.default.as_dict()
        lines = []
        for line in config.to_toml().splitlines():
            name = line.partition(" = ")[0]
            moved = name in old and config.as_dict().get(name) != old[name]
            lines.append(f"{line}  # default {old[name]}" if moved else line)
        packages = ", ".join(f"{name} {version}" for name, version in installed(PACKAGES).items())
        comments = ["flockscope tune:", *self.lines(chosen), f"versions: {packages}"]
        return "\n".join([*(f"# {comment}" for comment in comments), *lines, ""])

    def as_dict(self) -> dict[str, Any]:
        """Returns everything as nested dicts and lists for JSON; an unknown number is nan."""
        plan, seeds = self.plan, {name: seeds_text(seeds) for name, seeds in self.plan.seeds.items()}
        settings = {
            "trials": plan.options.trials, "validation": seeds["val"], "test": seeds["test"],
            "check": plan.check_name, "check_test": seeds["check"], "set": list(plan.scene_settings),
        }  # fmt: skip
        return {
            "settings": plan.identity() | settings,
            "counts": self.counts,
            "params": self.config.as_dict(),
            "changed": {name: {"default": a, "tuned": b} for name, (a, b) in self.changed.items()},
            "validation": {
                goal.key: {"default": a, "tuned": b}
                for goal, a, b in zip(plan.goals, *self.validation, strict=True)
            },
            "comparisons": [{**asdict(c), "indicative": c.indicative, "verdict": c.verdict} for c in self.comparisons],
            "candidates": [_candidate(c) for c in self.candidates],
            "front": [_candidate(c) for c in self.front],
            "importance": dict(self.importance),
            "policy": None if self.adapted is None else _adapted(self.adapted),
            "notes": list(self.notes),
            "left_out": list(self.left_out),
            "versions": installed(PACKAGES),
        }  # fmt: skip

    def write(self, path: str | Path) -> list[Path]:
        """Writes the parameters to `path` (TOML), and beside it all figures (.json), the plots (.svg) and, with several
        goals, the parameters of each candidate of the front. Returns the paths of all files."""
        target = Path(path)
        files = {".json": json.dumps(plain(self.as_dict()), indent=1, allow_nan=False) + "\n", **self.plots()}
        files |= {f".front-{k}.toml": self.to_toml(c) for k, c in enumerate(self.front, 1)}
        if self.adapted is not None and self.adapted.policy is not None:
            files[".policy.toml"] = self.adapted.policy.to_toml()
        for suffix, content in files.items():
            write_file(target.with_suffix(suffix), content.encode())
        write_file(target, self.to_toml().encode())
        return [target, *(target.with_suffix(suffix) for suffix in files)]

    def plots(self) -> dict[str, str]:
        """Returns the plots as SVG text by file suffix: ".history.svg", and if any share is above 0 also
        ".importance.svg"."""
        plots = {".history.svg": history_plot(self.plan, self.trials)}
        if any(self.importance.values()):
            plots[".importance.svg"] = importance_plot(self.plan, self.importance)
        return plots


def _adapted(found: Adapted) -> dict[str, Any]:
    kept = None if found.policy is None else found.policy.as_dict()
    compared = [{**asdict(c), "indicative": c.indicative, "verdict": c.verdict} for c in found.comparisons]
    return {"kept": kept, "comparisons": compared, "why": found.line}


def _candidate(candidate: Candidate) -> dict[str, Any]:
    return {
        "trial": candidate.trial, "training": list(candidate.training), "validation": list(candidate.validation),
        "params": candidate.config.as_dict(),
    }  # fmt: skip


def _short_settings(settings: Sequence[str]) -> list[str]:
    sensor = [setting for setting in settings if setting.startswith("sensor.")]
    if len(sensor) <= MANY:
        return list(settings)
    return [f"a detector of {len(sensor)} settings", *(setting for setting in settings if setting not in sensor)]
