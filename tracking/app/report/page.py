"""Writes a report: one HTML file that works offline, with charts and the replays of the worst moments inside."""

from __future__ import annotations

import math
import re
from pathlib import Path

from scenarios.errors import extra_needed
from sim.store.atomic import write_file
from sim.store.own_files import GENERATOR
from tracking.app.replay_page.page import page_html, script_json, theme
from tracking.app.report.content import Report
from tracking.app.score_tables import number
from tracking.scoring.catalogue import CATALOGUE

HERE = Path(__file__).parent
KEYS = ("HOTA", "MOTA", "IDF1", "group_F1", "pairwise_F1", "event_F1")  # scores beside the one that ranks
PARTS = {
    "ranking": "Ranking", "heat": "Scenes", "curves": "Curves", "matrices": "Matrices", "causes": "Causes",
    "moments": "Worst moments", "sequences": "Sequences", "failures": "Failures",
}  # fmt: skip


def check_packages() -> None:
    """Raises InputError if a package that reports need is not installed."""
    with extra_needed("report", "report.html"):
        import bokeh  # noqa: F401
        import jinja2  # noqa: F401


def write_report(report: Report, path: Path) -> None:
    """Writes the report as one HTML file; needs the packages of `check_packages`."""
    write_file(path, report_html(report).encode("utf-8", "replace"))


def report_html(report: Report) -> str:
    """Returns the report as HTML."""
    from jinja2 import Environment, FileSystemLoader, StrictUndefined
    from markupsafe import Markup

    from tracking.app.report.charts import cause_parts, charts, scripts

    drawn = [("scenes" if name == "heat" else name, word) for name, word in PARTS.items() if getattr(report, name)]
    known = {key for row in report.ranking for key in KEYS if math.isfinite(row.get(key, math.nan))}
    keys = [key for key in KEYS if key != report.by and key in known]
    replay = page_html("Replay", "@@DATA@@").replace("</script", "<\\/script")
    pages = Environment(loader=FileSystemLoader(HERE), autoescape=True, undefined=StrictUndefined)
    pages.globals["nan"] = math.nan
    pages.filters |= {"score": lambda value: number("HOTA", value), "breaking": _breaking}
    found = pages.get_template("report.html").render(
        report=report, parts=drawn, generator=GENERATOR, ranking_keys=keys,
        meanings={key: score.meaning for key, score in CATALOGUE.items()},
        style=Markup(theme() + (HERE / "report.css").read_text(encoding="utf-8")),
        script=Markup((HERE / "report.js").read_text(encoding="utf-8")),
        bokeh=Markup(scripts()), cause_parts=cause_parts(report.causes),
        charts=Markup(script_json(charts(report))),
        replay_page=Markup(replay),
    )  # fmt: skip
    return str(found)


def _breaking(text: str) -> str:
    """Returns text as HTML that breaks after the separators of paths and names, not inside words."""
    from markupsafe import Markup, escape

    return Markup(re.sub(r"(&[#\w]+;|[/._:=-])(?=\S)", r"\1<wbr>", str(escape(text))))
