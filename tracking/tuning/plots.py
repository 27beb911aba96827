"""Pictures of a search, as SVG: its history, what its parameters were worth, the front of several goals.

Drawn here rather than by a plotting library: they open anywhere, weigh some kilobytes, and the same search gives the
same bytes.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from html import escape
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from tracking.tuning.result import Tuned

WIDTH, HEIGHT = 760, 400
LEFT, RIGHT, TOP, BOTTOM = 70, 20, 78, 48
BARS = 56  # where bars begin
INK, PALE, GRID = "#1b1f24", "#57606a", "#dcdfe4"
BLUE, ORANGE, RED = "#0b6bcb", "#d4600a", "#b42318"
ROW = 24  # height of a bar's row


@dataclass(frozen=True)
class Axes:
    """Two ranges, on the page; both are of round numbers' width at least, never empty."""

    x: tuple[float, float]
    y: tuple[float, float]

    def at(self, x: float, y: float) -> tuple[float, float]:
        """Where a point lies on the page."""
        across = (x - self.x[0]) / (self.x[1] - self.x[0])
        up = (y - self.y[0]) / (self.y[1] - self.y[0])
        return LEFT + across * (WIDTH - LEFT - RIGHT), HEIGHT - BOTTOM - up * (HEIGHT - TOP - BOTTOM)

    def drawn(self, x_label: str, y_label: str) -> list[str]:
        """Grid, numbers and names."""
        (left, bottom), (right, top) = self.at(self.x[0], self.y[0]), self.at(self.x[1], self.y[1])
        made = []
        for value in ticks(*self.y):
            v = self.at(0, value)[1]
            made += [f'<path d="M{left:.1f} {v:.1f}H{right:.1f}" stroke="{GRID}"/>']
            made += [_text(left - 8, v + 4, f"{value:g}", "end", PALE)]
        for value in ticks(*self.x):
            made += [_text(self.at(value, 0)[0], bottom + 18, f"{value:g}", "middle", PALE)]
        made += [_text((left + right) / 2, bottom + 38, x_label, "middle", PALE)]
        return [*made, _text(left, top - 10, y_label, "start", PALE)]


def plots(found: Tuned) -> dict[str, str]:
    """Every picture that the search has something to show in, by the end of its file's name."""
    made = {".history.svg": history(found)}
    if any(found.importance.values()):
        made[".importance.svg"] = importance(found)
    if len(found.plan.goals) > 1:
        made[".front.svg"] = pareto(found)
    return made


def history(found: Tuned) -> str:
    """Training values of the trials in their order: the defaults' as a line, the best so far as steps."""
    goal, trials = found.plan.goals[0], [t for t in found.trials if t.values]
    whole = [t for t in trials if not t.pruned]
    first = next((t.values[0] for t in whole if t.params == found.plan.defaults), None)
    best, steps = math.nan, list[tuple[float, float]]()
    for t in whole:
        better = best != best or goal.gain(best, t.values[0]) > 0
        steps += [] if best != best else [(t.number, best)]
        best = t.values[0] if better else best
        steps += [(t.number, best)]
    steps += [(trials[-1].number, best)] if steps else []
    shown = [t.values[0] for t in trials]
    axes = Axes(_range([0, *(t.number for t in trials)], 0.02), _clear(shown, [t.values[0] for t in whole]))
    inside = [t for t in trials if axes.y[0] <= t.values[0] <= axes.y[1]]
    body = axes.drawn("trial", f"{goal.key}, training scenes (chosen from: no result)")
    if first is not None:
        (u0, v), (u1, _) = axes.at(axes.x[0], first), axes.at(axes.x[1], first)
        body += [f'<path d="M{u0:.1f} {v:.1f}H{u1:.1f}" stroke="{PALE}" stroke-dasharray="5 4"/>']
    body += [_line((axes.at(x, y) for x, y in steps), ORANGE)]
    body += [_dot(*axes.at(t.number, t.values[0]), BLUE, hollow=t.pruned) for t in inside]
    edge = axes.y[0] if goal.higher else axes.y[1]
    for t in trials:
        if t not in inside:
            u, v = axes.at(t.number, edge)
            body += [f'<path d="M{u:.1f} {v - 4:.1f}v8" stroke="{BLUE}"/>']
    outside = len(trials) - len(inside)
    key = [(BLUE, "played to the end"), ("hollow", "given up early, estimated"), (ORANGE, "best so far")]
    key += [("dashes", "defaults")] if first is not None else []
    note = f"; {outside} far below: ticks" if goal.higher else f"; {outside} far above: ticks"
    return _page(f"{_named(found)}: {len(found.trials)} trials" + (note if outside else ""), body, key)


def importance(found: Tuned) -> str:
    """How much each parameter decided about the first goal in training, and what the winner made of it."""
    ranked = sorted(found.importance.items(), key=lambda pair: -pair[1])
    most, body = max(found.importance.values()), []
    left, wide = 190, WIDTH - 190 - 250
    for k, (name, share) in enumerate(ranked):
        y, bar = BARS + k * ROW, wide * share / most
        old, new = getattr(found.default, name), getattr(found.config, name)
        moved = old != new
        body += [f'<rect x="{left}" y="{y}" width="{bar:.1f}" height="16" fill="{ORANGE if moved else BLUE}"/>']
        body += [_text(left - 8, y + 13, name, "end"), _text(left + bar + 6, y + 13, f"{share:.0%}", fill=PALE)]
        change = f"{_short(old)} → {_short(new)}" if moved else f"{_short(old)}"
        unit = next(p.unit for p in found.plan.space if p.name == name)
        body += [_text(WIDTH - 12, y + 13, f"{change} {unit}".rstrip(), "end", INK if moved else PALE)]
    title = f"{_named(found)}: what decided about {found.plan.goals[0].key} in training (PED-ANOVA)"
    key = [(ORANGE, "changed by the winner"), (BLUE, "left at its default")]
    return _page(title, body, key, BARS + ROW * len(ranked) + 16)


def pareto(found: Tuned) -> str:
    """The first two goals of the candidates on the validation scenes, the front joined."""
    one, two = found.plan.goals[:2]
    points = [c.validation[:2] for c in found.candidates]
    axes = Axes(_range([p[0] for p in points], 0.08), _range([p[1] for p in points], 0.08))
    line = sorted(c.validation[:2] for c in found.front)
    body = axes.drawn(f"{one.key}, validation scenes", two.key)
    body += [_line((axes.at(x, y) for x, y in line), ORANGE)]
    for c in found.candidates:
        u, v = axes.at(*c.validation[:2])
        body += [_dot(u, v, ORANGE if c in found.front else BLUE)]
        name = "defaults" if c.config == found.default else f"trial {c.trial}"
        body += [_text(u - 8, v - 6, name, "end", PALE) if u > WIDTH / 2 else _text(u + 8, v - 6, name, fill=PALE)]
    key = [(ORANGE, "front: no other is better in all"), (BLUE, "beaten")]
    return _page(f"{_named(found)}: {one.key} and {two.key}", body, key)


def ticks(low: float, high: float) -> list[float]:
    """Five or so round numbers in a range."""
    raw = (high - low) / 5
    step: float = 10.0 ** math.floor(math.log10(raw))
    step *= next(m for m in (1, 2, 5, 10) if m * step >= raw * (1 - 1e-9))
    first, last = math.ceil(low / step - 1e-9), math.floor(high / step + 1e-9)
    return [round(k * step, 10) for k in range(first, last + 1)]


def _clear(values: Sequence[float], whole: Sequence[float]) -> tuple[float, float]:
    """The range of those played to the end, and a bit more: a wild trial must not flatten all others."""
    low, high = _range(whole or values, 0.15)
    return max(low, min(values) - 0.02 * (high - low)), min(high, max(values) + 0.1 * (high - low))


def _range(values: Sequence[float], pad: float) -> tuple[float, float]:
    low, high = min(values, default=0.0), max(values, default=1.0)
    room = pad * (high - low) or max(abs(high), 1.0) * 0.05
    return low - room, high + room


def _named(found: Tuned) -> str:
    return f"{found.plan.tracker} on {found.plan.scenes}"


def _short(value: object) -> str:
    return f"{value:.4g}" if isinstance(value, float) else str(value)


def _line(points: Iterable[tuple[float, float]], colour: str) -> str:
    path = " ".join(f"{u:.1f},{v:.1f}" for u, v in points)
    return f'<polyline points="{path}" fill="none" stroke="{colour}" stroke-width="2"/>'


def _dot(u: float, v: float, colour: str, hollow: bool = False) -> str:
    fill = f'fill="#fff" stroke="{colour}"' if hollow else f'fill="{colour}"'
    return f'<circle cx="{u:.1f}" cy="{v:.1f}" r="3.5" {fill}/>'


def _page(title: str, body: list[str], key: list[tuple[str, str]], height: float = HEIGHT) -> str:
    """A picture with its title and, beneath that, what the colours mean."""
    u, shown = 20.0, list[str]()
    for colour, meaning in key:
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
