"""A report with all parts, for tests of its page."""

from __future__ import annotations

import json
import math
from dataclasses import replace

from tracking.app.report import content
from tracking.errors.found import CauseRow


def candidate(name: str, scenario: str, score: float) -> content.Played:
    return content.Played(name, scenario, f"{scenario}-s{score}", f"{scenario}-s{score}", score, 0.9)


def full(name: str) -> content.Report:
    """A report with all parts, in which trackers, scenes and errors have this name."""
    curve = {"mean": [0.9, None, 0.3], "low": [0.8, None, 0.2], "high": [1, None, 0.4], "break": {"at": 0.6}}
    oracle = {"run": "oracle", "rank": "", "mean": 0.9, "low": math.nan, "high": math.nan}
    rows = [oracle, {"run": name, "rank": "1", "mean": 0.8, "low": 0.7, "high": 0.9, "MOTA": 0.5}]
    runs = [candidate(name, name, score) for score in (0.4, 0.6, math.nan)]
    runs[2] = replace(runs[2], why=f"no scene, {name}")
    maps = [content.heat_map(name, zip([name] * 3, [name, name, "b"], runs, strict=True)) for _ in range(2)]
    return content.Report(
        name, name, "HOTA", rows, [name], maps[0],
        content.Curves(name, name, [1, 0.8, 0.4], {name: curve}, {name: curve}, [name]), maps[1:], [name],
        [(name, CauseRow(name, name, 2, 1.5, {"HOTA": 0.1, "group_F1": 0.2}))], name,
        [content.Moment(runs[0], 1.0, name, name, json.dumps({"name": "x"}))],
        [dict.fromkeys(("tracker", "scenario", "seed", "failed", "settings", "traceback"), name)],
        [(name, "page.html", 0.5)],
    )  # fmt: skip
