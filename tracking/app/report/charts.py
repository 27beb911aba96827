"""The charts of a report, as models of Bokeh. Colours of text and lines are set by report.js, by the reader's theme."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from collections.abc import Sequence as SequenceOf
from typing import Any

import numpy as np
from bokeh.core.types import ID
from bokeh.embed import json_item
from bokeh.models import ColumnDataSource, HoverTool
from bokeh.models.annotations import Legend
from bokeh.plotting import figure
from bokeh.resources import Resources

from tracking.app.report.content import Curves, Json, Report
from tracking.errors.found import CauseRow

# Their contrast to both backgrounds is 3 : 1 or more.
COLOURS = ("#2f81d8", "#d9730d", "#1a9e6c", "#c2478f", "#8a63d2", "#a08000", "#d6453d", "#3d8ea3", "#6b7a2f", "#8b6f5c")
GREY = "#808890"
LONGEST = 26  # characters of a name in a chart
DASHES = ("solid", "dashed", "dotdash", "dotted")
GAINS = ("HOTA", "group_F1")
MARGIN = 0.02  # share of the range that stays free beside the first and the last mark
TOOLS = "pan,wheel_zoom,box_zoom,reset,save"


def scripts() -> str:
    """Returns Bokeh's script, which the page carries."""
    return Resources(mode="inline", components=["bokeh"]).js_raw[0]


def charts(report: Report) -> Json:
    """Returns the charts of a report as JSON for Bokeh, by the id of the HTML element that each fills."""
    found: dict[str, Any] = {}
    if report.curves:
        if report.curves.shares:
            by = f"share of the oracle's {report.by}"
            found["chart-shares"] = _curves(report.curves, report.curves.shares, by)
        found["chart-curves"] = _curves(report.curves, report.curves.curves, report.by)
    if report.causes:
        found["chart-causes"] = _causes(report.causes)
    return {name: json_item(model, ID(name)) for name, model in found.items()}


def _figure(height: int, **given: Any) -> Any:
    made = figure(height=height, sizing_mode="stretch_width", tools=TOOLS, toolbar_location="above", **given)
    made.background_fill_color = made.border_fill_color = made.outline_line_color = None
    made.toolbar.logo, made.toolbar.autohide, made.toolbar.active_drag = None, True, None
    made.min_border_right = 16
    return made


def short_names(names: Iterable[str]) -> dict[str, str]:
    """Returns the ends of names, which fit into a chart on a phone; of equal ends the whole names."""
    ends = {name: name if len(name) <= LONGEST else f"…{name[1 - LONGEST :]}" for name in names}
    found = list(ends.values())
    return {name: end if found.count(end) == 1 else name for name, end in ends.items()}


def colour(k: int) -> str:
    """Returns the colour of the k-th tracker."""
    return COLOURS[k % len(COLOURS)]


def _curves(curves: Curves, shown: Mapping[str, Json], by: str) -> Any:
    plot = _figure(380, x_axis_label=f"{curves.axis}: {curves.about}" if curves.about else curves.axis, y_axis_label=by)
    first, last = curves.values[0], curves.values[-1]
    room = MARGIN * (last - first)
    plot.x_range.start, plot.x_range.end, plot.x_range.flipped = first - room, last + room, first > last
    items, order, short = [], np.argsort(curves.values), short_names(shown)
    for k, (name, one) in enumerate(shown.items()):
        data = {key: np.array(one[key], float) for key in ("mean", "low", "high")}
        source, look = ColumnDataSource({"x": curves.values, **data}), {"color": colour(k)}
        band = plot.varea("x", "low", "high", source=source, fill_alpha=0.14, **look)
        line = plot.line("x", "mean", source=source, line_width=2.4, line_dash=DASHES[k % len(DASHES)], **look)
        dots = plot.scatter("x", "mean", source=source, size=6, **look)
        parts = [line, dots, band]
        if one["break"] is not None and (at := one["break"]["at"]) is not None:
            height = np.interp(at, np.array(curves.values)[order], data["mean"][order])
            parts.append(plot.scatter([at], [height], size=15, marker="x", line_width=3, **look))
        plot.add_tools(HoverTool(renderers=[dots], tooltips=[("", name), (curves.axis, "@x"), (by, "@mean{0.000}")]))
        items.append((short[name], parts))
    plot.add_layout(
        Legend(items=items, click_policy="hide", orientation="horizontal", ncols=2, location="top_left"), "below"
    )
    return plot


def cause_parts(causes: SequenceOf[tuple[str, CauseRow]]) -> dict[str, tuple[str, dict[str, float]]]:
    """Returns by "kind: cause" a colour and the cost of these errors by tracker: the kinds and causes that cost most
    first, at last "other" with the sum of the rest. causes: pairs of a tracker and a row."""
    gains: dict[str, dict[str, float]] = {}
    for name, row in causes:
        of_kind = gains.setdefault(f"{row.kind}: {row.cause}", {})
        of_kind[name] = max(float(np.nansum([row.gains[key] for key in GAINS])), 0.0)
    kinds = sorted(gains, key=lambda kind: -sum(gains[kind].values()))
    most = len(COLOURS) - 1
    parts = {kind: (colour(k), gains[kind]) for k, kind in enumerate(kinds[:most])}
    if kinds[most:]:
        parts["other"] = GREY, {name: sum(gains[kind].get(name, 0.0) for kind in kinds[most:]) for name, _ in causes}
    return parts


def _causes(causes: SequenceOf[tuple[str, CauseRow]]) -> Any:
    names, parts = list(dict.fromkeys(name for name, _ in causes)), cause_parts(causes)
    shown = list(short_names(names).values())
    plot = _figure(80 + 34 * len(names), y_range=shown[::-1], x_axis_label="what the repair adds to HOTA + group_F1")
    data = {kind: [gains.get(name, 0.0) for name in names] for kind, (_, gains) in parts.items()}
    fills, source = [fill for fill, _ in parts.values()], ColumnDataSource({"name": shown, **data})
    bars = plot.hbar_stack([*parts], y="name", height=0.7, source=source, color=fills, line_color=None)
    plot.add_tools(HoverTool(renderers=bars, tooltips=[("", "@name"), ("$name", "@$name{0.000}")]))
    plot.x_range.start = 0
    return plot
