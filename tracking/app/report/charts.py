"""The charts of a report: the colours and numbers that report.html and report.js draw."""

from __future__ import annotations

from collections.abc import Sequence as SequenceOf

import numpy as np

from sim.io.files.tables import plain
from tracking.app.report.content import Curves, Json
from tracking.errors.found import CauseRow
from tracking.scoring.catalogue import CATALOGUE

# Their contrast to both backgrounds is 3 : 1 or more.
COLOURS = ("#2f81d8", "#d9730d", "#1a9e6c", "#c2478f", "#8a63d2", "#a08000", "#d6453d", "#3d8ea3", "#6b7a2f", "#8b6f5c")
GREY = "#808890"
GAINS = ("HOTA", "group_F1")


def colour(k: int) -> str:
    """Returns the colour of the k-th tracker."""
    return COLOURS[k % len(COLOURS)]


def curve_data(curves: Curves, by: str) -> Json:
    """Returns the curves for report.js: the axis, its values, and for each tracker mean, low and high of the score `by`
    within its range, None where unknown, and "at", the breaking point."""
    shown = []
    for k, (name, one) in enumerate(curves.curves.items()):
        ends = {key: CATALOGUE[by].within(np.array(one[key], float)) for key in ("mean", "low", "high")}
        shown.append({"name": name, "colour": colour(k), "at": (one["break"] or {}).get("at"), **ends})
    axis = f"{curves.axis}: {curves.about}" if curves.about else curves.axis
    found: Json = plain({"axis": axis, "by": by, "values": [*curves.values], "curves": shown})
    return found


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
