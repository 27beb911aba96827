"""The charts of a report, as models of Bokeh. Colours of text and lines are set by report.js, by the reader's theme."""

from __future__ import annotations

import math
from collections.abc import Sequence as SequenceOf
from typing import Any

from bokeh.core.types import ID
from bokeh.embed import json_item
from bokeh.models import ColumnDataSource, HoverTool
from bokeh.models.annotations import Legend, Whisker
from bokeh.plotting import figure
from bokeh.resources import Resources

from tracking.app.report.content import CauseBar, Curves, Json, RankedRow, Report

# Their contrast to both backgrounds is 3 : 1 or more.
COLOURS = ("#2f81d8", "#d9730d", "#1a9e6c", "#c2478f", "#8a63d2", "#a08000", "#d6453d", "#3d8ea3", "#6b7a2f", "#8b6f5c")
GREY = "#808890"
DASHES = ("solid", "dashed", "dotdash", "dotted")
TOOLS = "pan,wheel_zoom,box_zoom,reset,save"


def scripts() -> str:
    """Returns Bokeh's script, which the page carries."""
    return Resources(mode="inline", components=["bokeh"]).js_raw[0]


def charts(report: Report) -> Json:
    """Returns the charts of a report by the id of the element that they fill."""
    found: dict[str, Any] = {}
    if report.ranking:
        found["chart-ranking"] = _ranking(report.ranking, report.by)
    for k, curves in enumerate(report.curves):
        found[f"chart-curves-{k}"] = _curves(curves, report.by)
    if report.causes:
        found["chart-causes"] = _causes(report.causes)
    return {name: json_item(model, ID(name)) for name, model in found.items()}


def _figure(height: int, **given: Any) -> Any:
    made = figure(height=height, sizing_mode="stretch_width", tools=TOOLS, toolbar_location="above", **given)
    made.background_fill_color = made.border_fill_color = made.outline_line_color = None
    made.toolbar.logo, made.toolbar.autohide, made.toolbar.active_drag = None, True, None
    made.min_border_right = 16
    return made


def colour(k: int) -> str:
    """Returns the colour of the k-th tracker."""
    return COLOURS[k % len(COLOURS)]


def _ranking(rows: SequenceOf[RankedRow], by: str) -> Any:
    names = [row.name for row in rows]
    ends = _range([value for row in rows for value in (row.low, row.mean, row.high)])
    plot = _figure(70 + 30 * len(rows), y_range=names[::-1], x_range=ends, x_axis_label=by)
    trackers = [row for row in rows if row.rank]
    fills = {row.name: colour(k) for k, row in enumerate(sorted(trackers, key=lambda row: row.name))}
    data = {
        "name": names,
        "mean": [row.mean for row in rows],
        "low": [_or(row.low, row.mean) for row in rows],
        "high": [_or(row.high, row.mean) for row in rows],
        "fill": [fills.get(name, GREY) for name in names],
        "rank": [row.rank or "oracle" for row in rows],
    }
    source = ColumnDataSource(data)
    plot.add_layout(Whisker(base="name", lower="low", upper="high", dimension="width", source=source))
    dots = plot.scatter("mean", "name", size=11, color="fill", source=source)
    tips = [("", "@name"), ("rank", "@rank"), (by, "@mean{0.000} (@low{0.000} to @high{0.000})")]
    plot.add_tools(HoverTool(renderers=[dots], tooltips=tips))
    return plot


def _range(values: SequenceOf[float]) -> tuple[float, float]:
    known = [value for value in values if math.isfinite(value)]
    room = 0.06 * (max(known) - min(known)) or 0.01
    return min(known) - room, max(known) + room


def _or(value: float, other: float) -> float:
    return value if math.isfinite(value) else other


def _curves(curves: Curves, by: str) -> Any:
    backwards = curves.values[0] > curves.values[-1]
    ends = (curves.values[0], curves.values[-1])
    plot = _figure(380, x_axis_label=f"{curves.axis}: {curves.about}" if curves.about else curves.axis, y_axis_label=by)
    plot.x_range.start, plot.x_range.end = ends
    plot.x_range.flipped = backwards
    items = []
    for k, one in enumerate(curves.curves):
        data = {"x": curves.values, "mean": one.mean, "low": one.low, "high": one.high}
        source, look = ColumnDataSource(data), {"color": colour(k)}
        band = plot.varea("x", "low", "high", source=source, fill_alpha=0.14, **look)
        line = plot.line("x", "mean", source=source, line_width=2.4, line_dash=DASHES[k % len(DASHES)], **look)
        dots = plot.scatter("x", "mean", source=source, size=6, **look)
        parts = [line, dots, band]
        if (at := one.breaks["at"]) is not None:
            height = _height(curves.values, one.mean, at)
            parts.append(plot.scatter([at], [height], size=15, marker="x", line_width=3, **look))
        tips = [("", one.name), (curves.axis, "@x"), (by, "@mean{0.000}")]
        plot.add_tools(HoverTool(renderers=[dots], tooltips=tips))
        items.append((one.name, parts))
    legend = Legend(items=items, click_policy="hide", orientation="horizontal", ncols=2)
    plot.add_layout(legend, "below")
    return plot


def _height(values: SequenceOf[float], mean: SequenceOf[float], at: float) -> float:
    import numpy as np

    order = np.argsort(values)
    return float(np.interp(at, np.array(values)[order], np.array(mean, float)[order]))


def cause_parts(bars: SequenceOf[CauseBar]) -> list[tuple[str, str, list[CauseBar]]]:
    """Returns words, colour and bars of the kinds and causes that cost most, and of all others together."""
    kinds = sorted({(bar.kind, bar.cause) for bar in bars}, key=lambda one: -_sum(bars, one))
    most = len(COLOURS) - 1
    parts = [(f"{kind}: {cause}", colour(k), [(kind, cause)]) for k, (kind, cause) in enumerate(kinds[:most])]
    if kinds[most:]:
        parts.append(("other", GREY, kinds[most:]))
    return [(what, fill, [bar for bar in bars if (bar.kind, bar.cause) in wanted]) for what, fill, wanted in parts]


def _causes(bars: SequenceOf[CauseBar]) -> Any:
    names = list(dict.fromkeys(bar.name for bar in bars))
    plot = _figure(80 + 34 * len(names), y_range=names[::-1], x_axis_label="what the repair adds to HOTA + group_F1")
    left = dict.fromkeys(names, 0.0)
    for what, fill, own in cause_parts(bars):
        gains = dict.fromkeys(names, 0.0)
        for bar in own:
            gains[bar.name] += max(sum(bar.gains.values()), 0.0)
        right = {name: left[name] + gains[name] for name in names}
        data = {"name": names, "left": [*left.values()], "right": [*right.values()], "gain": [*gains.values()]}
        source = ColumnDataSource(data)
        made = plot.hbar("name", left="left", right="right", height=0.7, source=source, color=fill, line_color=None)
        plot.add_tools(HoverTool(renderers=[made], tooltips=[("", "@name"), (what, "@gain{0.000}")]))
        left = right
    plot.x_range.start = 0
    return plot


def _sum(bars: SequenceOf[CauseBar], kind: tuple[str, str]) -> float:
    return sum(sum(bar.gains.values()) for bar in bars if (bar.kind, bar.cause) == kind)
