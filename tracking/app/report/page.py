"""Pages made of templates. A report is one HTML file that works offline, with charts and replays of worst moments."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

from sim.io.files.atomic import write_file
from sim.io.files.own_files import GENERATOR
from tracking.app.commands.score_tables import number
from tracking.app.replay_page.page import page_html, script_json, theme
from tracking.app.report.charts import cause_parts, curve_data
from tracking.app.report.content import Report
from tracking.scoring.catalogue import CATALOGUE

HERE = Path(__file__).parent
KEYS = ("HOTA", "MOTA", "IDF1", "group_F1", "pairwise_F1", "event_F1")  # scores beside the one that ranks
PARTS = {
    "ranking": "Ranking", "heat": "Scenes", "curves": "Curves", "matrices": "Matrices", "moments": "Worst moments",
    "causes": "Causes", "sequences": "Sequences", "failures": "Failures",
}  # fmt: skip


def write_report(report: Report, path: Path) -> None:
    """Writes the report as one HTML file."""
    write_file(path, report_html(report).encode("utf-8", "replace"))


def report_html(report: Report) -> str:
    """Returns the report as HTML."""
    from markupsafe import Markup

    drawn = [("scenes" if name == "heat" else name, word) for name, word in PARTS.items() if getattr(report, name)]
    known = {key for row in report.ranking for key in KEYS if math.isfinite(row.get(key, math.nan))}
    keys = [key for key in KEYS if key != report.by and key in known]
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
