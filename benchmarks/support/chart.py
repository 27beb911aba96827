"""Line charts with bands as SVG, for the figures of the docs: `lines([Panel(...), …], path)`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from html import escape
from pathlib import Path

import numpy as np

COLOURS = ("#0072b2", "#d55e00", "#009e73", "#aa3377", "#8a6d00", "#5c5c5c")
WIDTH, HEIGHT, LEFT, RIGHT, TOP, BOTTOM = 460, 300, 56, 12, 34, 46
KEY = 22
"""px: a panel, its margins, a row of the key."""


@dataclass(frozen=True)
class Panel:
    """One chart.

    curves: name → values, or (values, low, high), at `x`; vertical: vertical lines by name; ticks: names of the values
    of `x`; y_range: None stands for the range of the curves.
    """

    title: str
    x: Sequence[float]
    curves: Mapping[str, object]
    x_label: str
    y_label: str = ""
    y_range: tuple[float, float] | None = None
    ticks: Sequence[str] | None = None
    vertical: Mapping[str, float] = field(default_factory=dict)


def lines(panels: Sequence[Panel], path: Path, columns: int = 2) -> Path:
    """Writes the charts as an SVG file, in rows of `columns`, with one key beneath, and returns its path.

    The same numbers give the same bytes.
    """
    columns = min(columns, len(panels))
    names = list(dict.fromkeys(name for panel in panels for name in panel.curves))
    colour = {name: COLOURS[k % len(COLOURS)] for k, name in enumerate(names)}
    rows = -(-len(panels) // columns)
    wide = columns * WIDTH
    in_row = max(1, wide // 240)
    high = rows * HEIGHT + -(-len(names) // in_row) * KEY + 10
    body = [_panel(p, k % columns * WIDTH, k // columns * HEIGHT, colour) for k, p in enumerate(panels)]
    for k, name in enumerate(names):
        x, y = 20 + k % in_row * 240, rows * HEIGHT + 14 + k // in_row * KEY
        body.append(f'<line x1="{x}" y1="{y}" x2="{x + 22}" y2="{y}" stroke="{colour[name]}" stroke-width="2.5"/>')
        body.append(_text(x + 28, y + 4, name))
    wide += RIGHT  # the label of the last tick extends beyond the panel
    head = f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {wide} {high}" width="{wide}" height="{high}"'
    style = ' font-family="sans-serif" font-size="12"><rect width="100%" height="100%" fill="#fff"/>'
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text("\n".join([head + style, *body, "</svg>", ""]), encoding="utf-8")
    return path


def _panel(panel: Panel, left: float, top: float, colour: Mapping[str, str]) -> str:
    x = np.asarray(panel.x, float)
    curves = {
        name: [np.asarray(c, float) for c in (v if isinstance(v, tuple) else (v,))] for name, v in panel.curves.items()
    }
    low, high = panel.y_range or _range(curves)
    x0, x1 = (float(x.min()), float(x.max())) if np.ptp(x) else (float(x[0]) - 1, float(x[0]) + 1)

    def at(a: np.ndarray, b: np.ndarray) -> np.ndarray:
        u = left + LEFT + (a - x0) / (x1 - x0) * (WIDTH - LEFT - RIGHT)
        v = top + TOP + (high - b) / (high - low) * (HEIGHT - TOP - BOTTOM)
        return np.stack([u, v], axis=-1)

    clip = f"clip-{left:g}-{top:g}"
    (u, v), size = at(np.array(x0), np.array(high)), (WIDTH - LEFT - RIGHT, HEIGHT - TOP - BOTTOM)
    body = [_text(left + LEFT, top + 20, panel.title, weight="600"), *_axes(panel, at, x, x0, x1, low, high)]
    if any(len(value) == 3 for value in curves.values()):
        frame = f'<rect x="{u:.1f}" y="{v:.1f}" width="{size[0]}" height="{size[1]}"/>'
        body.append(f'<clipPath id="{clip}">{frame}</clipPath>')
    for name, value in curves.items():
        if len(value) == 3:
            band = np.concatenate([at(x, value[1]), at(x, value[2])[::-1]])
            shape = f'<polygon points="{_points(band)}" fill="{colour[name]}" opacity="0.15" clip-path="url(#{clip})"/>'
            body.append(shape)
        stroke = f'fill="none" stroke="{colour[name]}" stroke-width="2"'
        body.append(f'<polyline points="{_points(at(x, value[0]))}" {stroke}/>')
        if len(x) <= 12:
            dots = at(x, value[0])[np.isfinite(value[0])]
            body += [f'<circle cx="{u:.1f}" cy="{v:.1f}" r="3" fill="{colour[name]}"/>' for u, v in dots]
    return "\n".join(body)


def _axes(panel: Panel, at, x, x0, x1, low, high) -> list[str]:
    body = []
    for y in _ticks(low, high):
        (u0, v), (u1, _) = at(np.array([x0, x1]), np.array([y, y]))
        body.append(f'<line x1="{u0:.1f}" y1="{v:.1f}" x2="{u1:.1f}" y2="{v:.1f}" stroke="#dcdfe4"/>')
        body.append(_text(u0 - 6, v + 4, f"{y:g}", "end"))
    named = zip(x, panel.ticks, strict=True) if panel.ticks else ((t, f"{t:g}") for t in _ticks(x0, x1))
    for value, name in named:
        u, v = at(np.array(value), np.array(low))
        body.append(_text(u, v + 16, name, "middle"))
    for name, value in panel.vertical.items():
        (u, v0), (_, v1) = at(np.array([value, value]), np.array([low, high]))
        body.append(
            f'<line x1="{u:.1f}" y1="{v0:.1f}" x2="{u:.1f}" y2="{v1:.1f}" stroke="#777" stroke-dasharray="4 3"/>'
        )
        body.append(_text(u + 4, v1 + 11, name, fill="#57606a"))
    u, v = at(np.array((x0 + x1) / 2), np.array(low))
    right, top = at(np.array(x1), np.array(high))
    return [
        *body,
        _text(u, v + 36, panel.x_label, "middle"),
        _text(right, top - 8, panel.y_label, "end", fill="#57606a"),
    ]


def _range(curves: Mapping[str, list[np.ndarray]]) -> tuple[float, float]:
    every = np.concatenate([c.ravel() for value in curves.values() for c in value])
    low, high = float(np.nanmin(every)), float(np.nanmax(every))
    pad = 0.05 * (high - low) or 0.5
    return low - pad, high + pad


def _ticks(low: float, high: float) -> np.ndarray:
    """Returns about five round numbers in a range."""
    raw = (high - low) / 5
    step = 10.0 ** np.floor(np.log10(raw))
    step *= next(m for m in (1, 2, 5, 10) if m * step >= raw)
    return np.round(np.arange(np.ceil(low / step - 1e-9), np.floor(high / step + 1e-9) + 1) * step, 10) + 0.0


def _points(uv: np.ndarray) -> str:
    return " ".join(f"{u:.1f},{v:.1f}" for u, v in uv if np.isfinite(u) and np.isfinite(v))


def _text(x: float, y: float, text: str, anchor: str = "start", weight: str = "400", fill: str = "#1b1f24") -> str:
    place = f'x="{x:.1f}" y="{y:.1f}" text-anchor="{anchor}" font-weight="{weight}" fill="{fill}"'
    return f"<text {place}>{escape(text)}</text>"
