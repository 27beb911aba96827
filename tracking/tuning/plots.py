"""Plots of a search as SVG text: history of the trials, importance of the parameters, Pareto front.

They are drawn here and not by Optuna, whose plots show neither estimates nor validation values (CONTRIBUTING.md). The
same search gives the same bytes.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from html import escape

from scenarios.errors import counted
from tracking.config import Config
from tracking.tuning.comparison import Candidate, TrialRecord
from tracking.tuning.search_plan import SearchPlan

WIDTH, HEIGHT = 760, 400
"""Size of the page, px."""
LEFT, RIGHT, TOP, BOTTOM = 70, 20, 78, 48
"""Margins of the axes, px."""
BARS_TOP, BAR_ROW = 56, 24
"""Top of the first bar and height of a row of bars, px."""
INK, PALE, GRID = "#1b1f24", "#57606a", "#dcdfe4"
BLUE, ORANGE, RED = "#0b6bcb", "#d4600a", "#b42318"


@dataclass(frozen=True)
class Axes:
    """Axes of a plot; x and y are the ranges (low, high) of the data that fill it."""

    x: tuple[float, float]
    y: tuple[float, float]

    def to_page(self, x: float, y: float) -> tuple[float, float]:
        """Returns the place (u, v) of the data point (x, y) on the page, px from the left and px from the top."""
        across = (x - self.x[0]) / (self.x[1] - self.x[0])
        up = (y - self.y[0]) / (self.y[1] - self.y[0])
        return LEFT + across * (WIDTH - LEFT - RIGHT), HEIGHT - BOTTOM - up * (HEIGHT - TOP - BOTTOM)

    def elements(self, x_label: str, y_label: str) -> list[str]:
        """Returns the SVG elements of grid lines, tick labels and the two axis labels, one text each."""
        (left, bottom), (right, top) = self.to_page(self.x[0], self.y[0]), self.to_page(self.x[1], self.y[1])
        made = []
        for value in ticks(*self.y):
            v = self.to_page(0, value)[1]
            made += [f'<path d="M{left:.1f} {v:.1f}H{right:.1f}" stroke="{GRID}"/>']
            made += [_text(left - 8, v + 4, f"{value:g}", "end", PALE)]
        for value in ticks(*self.x):
            made += [_text(self.to_page(value, 0)[0], bottom + 18, f"{value:g}", "middle", PALE)]
        made += [_text((left + right) / 2, bottom + 38, x_label, "middle", PALE)]
        return [*made, _text(left, top - 10, y_label, "start", PALE)]


def history_plot(plan: SearchPlan, records: Sequence[TrialRecord]) -> str:
    """Returns an SVG text: plot of the first goal's training value of every trial, in the order of the search."""
    goal, trials = plan.goals[0], [t for t in records if t.values]
    unpruned = [t for t in trials if not t.pruned]
    default = next((t.values[0] for t in unpruned if t.params == plan.defaults), None)
    best, steps = math.nan, list[tuple[float, float]]()
    for t in unpruned:
        improves = best != best or goal.gain(best, t.values[0]) > 0
        steps += [] if best != best else [(t.number, best)]
        best = t.values[0] if improves else best
        steps += [(t.number, best)]
    steps += [(trials[-1].number, best)] if steps else []
    values = [t.values[0] for t in trials]
    axes = Axes(_range([0, *(t.number for t in trials)], 0.02), _clipped_range(values, [t.values[0] for t in unpruned]))
    inside = [t for t in trials if axes.y[0] <= t.values[0] <= axes.y[1]]
    body = axes.elements("trial", f"{goal.key}, training scenes (optimised: no result)")
    if default is not None:
        (u0, v), (u1, _) = axes.to_page(axes.x[0], default), axes.to_page(axes.x[1], default)
        body += [f'<path d="M{u0:.1f} {v:.1f}H{u1:.1f}" stroke="{PALE}" stroke-dasharray="5 4"/>']
    body += [_line((axes.to_page(x, y) for x, y in steps), ORANGE)]
    body += [_dot(*axes.to_page(t.number, t.values[0]), BLUE, hollow=t.pruned) for t in inside]
    edge = axes.y[0] if goal.higher else axes.y[1]
    for t in trials:
        if t not in inside:
            u, v = axes.to_page(t.number, edge)
            body += [f'<path d="M{u:.1f} {v - 4:.1f}v8" stroke="{BLUE}"/>']
    outside = len(trials) - len(inside)
    legend = [(BLUE, "played to the end"), ("hollow", "pruned, estimated"), (ORANGE, "best so far")]
    legend += [("dashes", "defaults")] if default is not None else []
    note = f"; {outside} far below: ticks" if goal.higher else f"; {outside} far above: ticks"
    return _page(f"{_title(plan)}: {counted(len(records), 'trial')}" + (note if outside else ""), body, legend)


def importance_plot(plan: SearchPlan, importance: Mapping[str, float], config: Config) -> str:
    """Returns as SVG a bar for the importance of each parameter."""
    ranked = sorted(importance.items(), key=lambda pair: -pair[1])
    most, body = max(importance.values()), []
    left, wide = 190, WIDTH - 190 - 250
    for k, (name, share) in enumerate(ranked):
        y, bar = BARS_TOP + k * BAR_ROW, wide * share / most
        old, new = getattr(plan.base, name), getattr(config, name)
        changed = old != new
        body += [f'<rect x="{left}" y="{y}" width="{bar:.1f}" height="16" fill="{ORANGE if changed else BLUE}"/>']
        body += [_text(left - 8, y + 13, name, "end"), _text(left + bar + 6, y + 13, f"{share:.0%}", fill=PALE)]
        change = f"{_short(old)} → {_short(new)}" if changed else f"{_short(old)}"
        unit = next(p.unit for p in plan.space if p.name == name)
        body += [_text(WIDTH - 12, y + 13, f"{change} {unit}".rstrip(), "end", INK if changed else PALE)]
    title = f"{_title(plan)}: importance for {plan.goals[0].key} in training (PED-ANOVA)"
    legend = [(ORANGE, "changed by the winner"), (BLUE, "left at its default")]
    return _page(title, body, legend, BARS_TOP + BAR_ROW * len(ranked) + 16)


def pareto_plot(plan: SearchPlan, candidates: Sequence[Candidate], front: Sequence[Candidate]) -> str:
    """Returns as SVG the candidates by the first two goals."""
    one, two = plan.goals[:2]
    points = [c.validation[:2] for c in candidates]
    axes = Axes(_range([p[0] for p in points], 0.08), _range([p[1] for p in points], 0.08))
    line = sorted(c.validation[:2] for c in front)
    body = axes.elements(f"{one.key}, validation scenes", two.key)
    body += [_line((axes.to_page(x, y) for x, y in line), ORANGE)]
    for c in candidates:
        u, v = axes.to_page(*c.validation[:2])
        body += [_dot(u, v, ORANGE if c in front else BLUE)]
        name = "defaults" if c.config == plan.base else f"trial {c.trial}"
        body += [_text(u - 8, v - 6, name, "end", PALE) if u > WIDTH / 2 else _text(u + 8, v - 6, name, fill=PALE)]
    legend = [(ORANGE, "Pareto front"), (BLUE, "dominated")]
    return _page(f"{_title(plan)}: {one.key} and {two.key}", body, legend)


def ticks(low: float, high: float) -> list[float]:
    """Returns round numbers in [low, high] at equal distances (1, 2 or 5 times a power of ten), two to six of them."""
    raw = (high - low) / 5
    step: float = 10.0 ** math.floor(math.log10(raw))
    step *= next(m for m in (1, 2, 5, 10) if m * step >= raw * (1 - 1e-9))
    first, last = math.ceil(low / step - 1e-9), math.floor(high / step + 1e-9)
    return [round(k * step, 10) for k in range(first, last + 1)]


def _clipped_range(values: Sequence[float], unpruned: Sequence[float]) -> tuple[float, float]:
    low, high = _range(unpruned or values, 0.15)
    return max(low, min(values) - 0.02 * (high - low)), min(high, max(values) + 0.1 * (high - low))


def _range(values: Sequence[float], pad: float) -> tuple[float, float]:
    """Returns (low, high): the range of the values, wider by `pad` times its width on both sides; low is below high."""
    low, high = min(values, default=0.0), max(values, default=1.0)
    room = pad * (high - low) or max(abs(high), 1.0) * 0.05
    return low - room, high + room


def _title(plan: SearchPlan) -> str:
    return f"{plan.tracker_name} on {plan.suite_name}"


def _short(value: object) -> str:
    return f"{value:.4g}" if isinstance(value, float) else str(value)


def _line(points: Iterable[tuple[float, float]], colour: str) -> str:
    path = " ".join(f"{u:.1f},{v:.1f}" for u, v in points)
    return f'<polyline points="{path}" fill="none" stroke="{colour}" stroke-width="2"/>'


def _dot(u: float, v: float, colour: str, hollow: bool = False) -> str:
    fill = f'fill="#fff" stroke="{colour}"' if hollow else f'fill="{colour}"'
    return f'<circle cx="{u:.1f}" cy="{v:.1f}" r="3.5" {fill}/>'


def _page(title: str, body: list[str], legend: list[tuple[str, str]], height: float = HEIGHT) -> str:
    u, shown = 20.0, list[str]()
    for colour, meaning in legend:
        if colour == "dashes":
            shown += [f'<path d="M{u - 5:.1f} 36H{u + 7:.1f}" stroke="{PALE}" stroke-dasharray="5 4"/>']
        else:
            shown += [_dot(u, 36, BLUE if colour == "hollow" else colour, hollow=colour == "hollow")]
        shown += [_text(u + 10, 40, meaning, fill=PALE)]
        u += 34 + 6.6 * len(meaning)
    head = (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {height:g}" width="{WIDTH}" height="{height:g}"'
    )
    style = ' font-family="sans-serif" font-size="12"><rect width="100%" height="100%" fill="#fff"/>'
    name = f'<text x="14" y="20" font-weight="600" font-size="13" fill="{INK}">{escape(title)}</text>'
    return "\n".join([head + style, name, *shown, *body, "</svg>", ""])


def _text(x: float, y: float, text: str, anchor: str = "start", fill: str = INK) -> str:
    return f'<text x="{x:.1f}" y="{y:.1f}" text-anchor="{anchor}" fill="{fill}">{escape(text)}</text>'
