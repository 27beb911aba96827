"""Plots of a search as SVG text: history of the trials, importance of the parameters, Pareto front.

Optuna's own plots show pruned estimates and training values as if they were results."""

from __future__ import annotations

import io
from collections.abc import Mapping, Sequence
from typing import Any

from scenarios.printable import counted
from tracking.config import Config
from tracking.tuning.comparison import Candidate, TrialRecord
from tracking.tuning.search_plan import SearchPlan

BLUE, ORANGE = "#0b6bcb", "#d4600a"
ROOM = 0.15  # Share of the range of the values that is shown beyond them; worse values are marked at the edge.


def history_plot(plan: SearchPlan, records: Sequence[TrialRecord]) -> str:
    """Returns an SVG text: plot of the first goal's training value of every trial, in the order of the search."""
    goal, trials = plan.goals[0], [t for t in records if t.values]
    figure, axes = _figure(f"{_title(plan)}: {counted(len(records), 'trial')}")
    played = [t for t in trials if not t.pruned]
    for some, face, words in (
        (played, BLUE, "played to the end"), ([t for t in trials if t.pruned], "none", "pruned, estimated")
    ):  # fmt: skip
        axes.scatter([t.number for t in some], [t.values[0] for t in some], facecolor=face, edgecolor=BLUE, label=words)
    best = [t.values[0] for t in played[:1]]
    for t in played[1:]:
        best.append(t.values[0] if goal.gain(best[-1], t.values[0]) > 0 else best[-1])
    axes.step([t.number for t in played], best, where="post", color=ORANGE, label="best so far")
    for t in played:
        if t.params == plan.defaults:
            axes.axhline(t.values[0], color="grey", linestyle="--", label="defaults")
    values = [t.values[0] for t in played]
    if values and min(values) < max(values):  # a trial that loses by far would flatten the rest
        worst = min(values) if goal.higher else max(values)
        edge = worst + (worst - (max(values) + min(values)) / 2) * 2 * ROOM
        beyond = [t.number for t in trials if goal.gain(edge, t.values[0]) < 0]
        axes.plot(beyond, [edge] * len(beyond), "|", color=BLUE, label="far worse" if beyond else None)
        axes.set_ylim(**{"bottom" if goal.higher else "top": edge})
    axes.set(xlabel="trial", ylabel=f"{goal.key}, training scenes (optimised: no result)")
    return _svg(figure, axes)


def importance_plot(plan: SearchPlan, importance: Mapping[str, float], config: Config) -> str:
    """Returns as SVG a bar for the importance of each parameter."""
    ranked = sorted(importance, key=lambda name: importance[name])
    title = f"{_title(plan)}: importance for {plan.goals[0].key} in training (PED-ANOVA)"
    figure, axes = _figure(title, 1 + len(ranked) / 3)
    units = {p.name: p.unit for p in plan.space}
    for changed, ink, words in ((True, ORANGE, "changed by the winner"), (False, BLUE, "left at its default")):
        names = [name for name in ranked if (getattr(plan.base, name) != getattr(config, name)) == changed]
        bars = axes.barh([ranked.index(name) for name in names], [importance[n] for n in names], color=ink, label=words)
        ends = [dict.fromkeys(_short(getattr(one, name)) for one in (plan.base, config)) for name in names]
        axes.bar_label(bars, [f"{' → '.join(e)} {units[n]}" for e, n in zip(ends, names, strict=True)], padding=4)
    axes.set_yticks(range(len(ranked)), ranked)
    axes.set_xlim(right=1.4 * max(importance.values()))
    return _svg(figure, axes)


def pareto_plot(plan: SearchPlan, candidates: Sequence[Candidate], front: Sequence[Candidate]) -> str:
    """Returns as SVG the candidates by the first two goals."""
    one, two = plan.goals[:2]
    figure, axes = _figure(f"{_title(plan)}: {one.key} and {two.key}")
    for some, ink, words in ((front, ORANGE, "Pareto front"), (candidates, BLUE, "dominated")):
        points = sorted(c.validation[:2] for c in some if some is front or c not in front)
        axes.plot(
            *zip(*points, strict=True) if points else ([], []), "o-" if some is front else "o", color=ink, label=words
        )
    for c in candidates:
        axes.annotate("defaults" if c.config == plan.base else f"trial {c.trial}", c.validation[:2])
    axes.set(xlabel=f"{one.key}, validation scenes", ylabel=two.key)
    return _svg(figure, axes)


def _figure(title: str, height: float = 4.0) -> tuple[Any, Any]:
    from matplotlib.figure import Figure

    figure = Figure(figsize=(7.6, height), layout="constrained")
    axes = figure.add_subplot()
    axes.set_title(title, fontsize=10)
    return figure, axes


def _svg(figure: Any, axes: Any) -> str:
    from matplotlib import rc_context

    axes.legend(fontsize=8)
    text = io.StringIO()
    with rc_context({"svg.hashsalt": "flockscope", "svg.fonttype": "none"}):  # the same search, the same bytes
        figure.savefig(text, format="svg", metadata={"Date": None})
    return text.getvalue()


def _title(plan: SearchPlan) -> str:
    return f"{plan.tracker_name} on {plan.suite_name}"


def _short(value: object) -> str:
    return f"{value:.4g}" if isinstance(value, float) else str(value)
