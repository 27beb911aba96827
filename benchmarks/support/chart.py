"""Line charts with bands as SVG, for the figures of the docs: `lines([Panel(...), …], path)`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import matplotlib
import numpy as np
from matplotlib.figure import Figure

COLOURS = ("#0072b2", "#d55e00", "#009e73", "#aa3377", "#8a6d00", "#5c5c5c")
MARKERS = "os^Dv*"
STYLE = {"svg.hashsalt": "flockscope", "svg.fonttype": "none", "axes.grid": True, "grid.color": "#dcdfe4"}


def colour(k: int) -> str:
    """Returns the colour of the k-th curve."""
    return COLOURS[k % len(COLOURS)]


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
    looks = {name: {"color": colour(k), "marker": MARKERS[k % len(MARKERS)]} for k, name in enumerate(names)}
    rows = -(-len(panels) // columns)
    path.parent.mkdir(parents=True, exist_ok=True)
    with matplotlib.rc_context(STYLE):
        # At most as wide as a page of the docs, which would make the text smaller.
        figure = Figure(figsize=(min(4.8 * columns, 9.6), 3.1 * rows + 0.5), layout="constrained")
        for axes, panel in zip(figure.subplots(rows, columns, squeeze=False).flat, panels, strict=False):
            _draw(axes, panel, looks)
        handles = [matplotlib.lines.Line2D([], [], markersize=4, **looks[name]) for name in names]
        figure.legend(
            handles,
            [name.replace("`", "") for name in names],
            loc="outside lower left",
            ncols=2 * columns,
            frameon=False,
        )
        figure.savefig(path, metadata={"Date": None})
    return path


def _draw(axes: matplotlib.axes.Axes, panel: Panel, looks: Mapping[str, dict[str, str]]) -> None:
    for name, curve in panel.curves.items():
        values, *band = curve if isinstance(curve, tuple) else (curve,)
        axes.plot(panel.x, np.asarray(values, float), markersize=4, **looks[name])
        if band:
            axes.fill_between(panel.x, *band, color=looks[name]["color"], alpha=0.15, linewidth=0)
    for name, value in panel.vertical.items():
        axes.axvline(value, color="#777", linestyle="--", linewidth=1)
        axes.annotate(name, (value, 1), xycoords=("data", "axes fraction"), xytext=(4, -10), textcoords="offset points")
    if panel.ticks:
        axes.set_xticks(panel.x, panel.ticks)
    axes.set(title=panel.title, xlabel=panel.x_label, ylabel=panel.y_label, ylim=panel.y_range)
