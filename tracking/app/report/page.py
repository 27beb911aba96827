"""Pages made of templates. A report is one HTML file that works offline, with charts and replays of worst moments."""

from __future__ import annotations

import math
from collections.abc import Sequence as SequenceOf
from pathlib import Path
from typing import Any

import numpy as np

from sim.io.files.atomic import write_file
from sim.io.files.own_files import GENERATOR
from sim.io.files.tables import plain
from tracking.app.commands.score_ranking import shown_columns
from tracking.app.commands.score_tables import number
from tracking.app.replay_page.page import page_html, script_json, theme
from tracking.app.report.content import Curves, Json, Report
from tracking.errors.found import CauseRow
from tracking.scoring.catalogue import CATALOGUE

HERE = Path(__file__).parent
PARTS = {
    "ranking": "Ranking", "heat": "Scenes", "curves": "Curves", "matrices": "Matrices", "moments": "Worst moments",
    "causes": "Causes", "sequences": "Sequences", "failures": "Failures",
}  # fmt: skip
# Their contrast to both backgrounds is 3 : 1 or more.
COLOURS = ("#2f81d8", "#d9730d", "#1a9e6c", "#c2478f", "#8a63d2", "#a08000", "#d6453d", "#3d8ea3", "#6b7a2f", "#8b6f5c")
GREY = "#808890"
GAINS = ("HOTA", "group_F1")


def write_report(report: Report, path: Path) -> None:
    """Writes the report as one HTML file."""
    write_file(path, report_html(report).encode("utf-8", "replace"))


def report_html(report: Report) -> str:
    """Returns the report as HTML."""
    from markupsafe import Markup

    drawn = [("scenes" if name == "heat" else name, word) for name, word in PARTS.items() if getattr(report, name)]
    keys = shown_columns([*report.ranking], report.by)
    replay = page_html("Replay", "@@DATA@@").replace("</script", "<\\/script")
    return from_template(
        "report.html", report=report, parts=drawn, ranking_keys=keys,
        style=Markup((HERE / "report.css").read_text(encoding="utf-8")),
        script=Markup((HERE / "report.js").read_text(encoding="utf-8")), cause_parts=cause_parts(report.causes),
        curves=None if report.curves is None else Markup(script_json(curve_data(report.curves, report.by))),
        replay_page=Markup(replay),
    )  # fmt: skip


def from_template(template: str, **content: Any) -> str:
    """Returns a page as HTML. template: name of a file beside this module; content: its variables, of which all texts
    but those of `Markup` are escaped."""
    from jinja2 import Environment, FileSystemLoader, StrictUndefined
    from markupsafe import Markup

    made = Environment(loader=FileSystemLoader(HERE), autoescape=True, undefined=StrictUndefined)
    made.globals |= {"nan": math.nan, "generator": GENERATOR, "theme": Markup(theme())}
    made.globals["meanings"] = {key: score.meaning for key, score in CATALOGUE.items()}
    made.filters["score"] = lambda value: number("HOTA", value)
    made.filters["sum_of"] = lambda parts, name: sum(gains.get(name, 0.0) for _, gains in parts)
    return str(made.get_template(template).render(content))


def curve_data(curves: Curves, by: str) -> Json:
    """Returns the curves for report.js: the axis, its values, and for each tracker mean, low and high of the score `by`
    within its range, None where unknown, and "at", the breaking point."""
    shown = []
    for k, (name, one) in enumerate(curves.curves.items()):
        ends = {key: CATALOGUE[by].within(np.array(one[key], float)) for key in ("mean", "low", "high")}
        shown.append({"name": name, "colour": COLOURS[k % len(COLOURS)], "at": (one["break"] or {}).get("at"), **ends})
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
    parts = {kind: (COLOURS[k], gains[kind]) for k, kind in enumerate(kinds[:most])}
    if kinds[most:]:
        parts["other"] = GREY, {name: sum(gains[kind].get(name, 0.0) for kind in kinds[most:]) for name, _ in causes}
    return parts
