"""`flockscope stress`: trackers on scenes that get harder along an axis; where each breaks, and who overtakes whom."""

from __future__ import annotations

from typing import Any

import numpy as np

from scenarios.errors import counted, printable
from sim.io.files.atomic import write_file
from sim.io.files.tables import Column, json_document, table_bytes
from sim.types import DetectionMode
from tracking.app import option_parsing
from tracking.app.command_options import StressOptions
from tracking.app.command_result import CommandResult
from tracking.app.commands.score_tables import checked_key, empty_table, with_title
from tracking.app.progress import ProgressMeter
from tracking.scoring.catalogue import CATALOGUE
from tracking.stats import mean_interval
from tracking.stress.axes import parse_axis
from tracking.stress.curves import BreakingPoint
from tracking.stress.episodes import Store, contender, job_player
from tracking.stress.sweep import Plan, Sweep

EPISODES, TABLE, RESULT = "episodes.jsonl", "episodes.parquet", "stress.json"
LISTED = 5  # failed episodes that are listed


def stress(options: StressOptions) -> CommandResult:
    """Plays the sweep, stores it, and returns the curves with their breaking points."""
    by = checked_key(options.by, better=("higher",))
    trackers = {name: contender(name, options.step_timeout) for name in dict.fromkeys(options.trackers)}
    detects = all({"boxes", "points"} & {*tracker.needs} for tracker in trackers.values())
    detections: DetectionMode = options.detections or ("file" if detects else "image")
    seeds = tuple(option_parsing.seeds(options.seeds, "--seeds"))
    settings = (*option_parsing.sensor_settings(options.sensor), *option_parsing.scenario_settings(options.settings))
    budget = (options.episodes, options.minutes)
    axis, start = parse_axis(options.vary), min(len(seeds), options.start)
    plan = Plan(tuple(options.suite), axis, seeds, start, by, options.share, detections, settings, *budget)
    with ProgressMeter("stress", options.episodes or 0) as meter, job_player(options.workers, options.cluster) as play:
        sweep = Sweep(plan, trackers, play, Store(options.out / EPISODES), meter.step)
        sweep.run()
    data = _data(sweep)
    write_file(options.out / RESULT, json_document(data))
    write_file(options.out / TABLE, _parquet(sweep))
    return CommandResult(data, _tables(sweep, data, options))


def _data(sweep: Sweep) -> dict[str, Any]:
    plan, breaks = sweep.plan, sweep.breaks()

    def words(point: BreakingPoint) -> dict[str, float | None]:
        easy, span = plan.axis.easy, plan.axis.hard - plan.axis.easy
        ends = {"at": point.at, "low": point.low, "high": point.high}
        return {name: easy + share * span if np.isfinite(share) else None for name, share in ends.items()}

    curves = {}
    for name in sweep.trackers:
        scores = sweep.scores(name)
        mean, low, high = (end.tolist() for end in mean_interval(scores))
        count = np.isfinite(scores).sum(axis=0).tolist()
        curves[name] = {"mean": mean, "low": low, "high": high, "scenes": count, "break": words(breaks[name])}
    return {
        "axis": plan.axis.name, "easy": plan.axis.easy, "hard": plan.axis.hard, "values": sweep.values, "by": plan.by,
        "share": plan.share, "scenarios": list(plan.scenarios), "seeds": sweep.seeds, "episodes": len(sweep.rows()),
        "curves": curves,
        "overtakings": [{"first": a, "second": b, **words(point)} for a, b, point in sweep.overtakings()],
        "failures": [row for row in sweep.rows() if row["failed"]],
    }  # fmt: skip


def _parquet(sweep: Sweep) -> bytes:
    rows = sweep.rows()
    words = ("tracker", "scenario", "left_out", "failed")
    columns = [Column(key, np.array([row[key] for row in rows], object)) for key in words]
    columns += [Column(key, np.array([row[key] for row in rows])) for key in ("seed", "value")]
    columns += [
        Column(score.key, np.array([row["scores"].get(score.key, np.nan) for row in rows], float), score.unit)
        for score in CATALOGUE.values()
    ]
    return table_bytes(columns, {"axis": sweep.plan.axis.name})


def _tables(sweep: Sweep, data: dict[str, Any], options: StressOptions) -> Any:
    from rich.console import Group

    curves, plan = data["curves"], sweep.plan
    table = empty_table()
    table.add_column(plan.axis.name, justify="right")
    for name in curves:
        table.add_column(printable(name), justify="right")
    for k, value in enumerate(sweep.values):
        cells = (f"{c['mean'][k]:.3f} ± {(c['high'][k] - c['low'][k]) / 2:.3f}" for c in curves.values())
        table.add_row(f"{value:g}", *cells)
    lines = [f"{printable(name)} {_break_words(c['break'], plan.share)}" for name, c in curves.items()]
    for o in data["overtakings"]:
        lines.append(f"{printable(o['first'])} falls behind {printable(o['second'])} at {_span(o)}")
    for f in data["failures"][:LISTED]:
        lines.append(printable(f"{f['tracker']} failed on {f['scenario']}, seed {f['seed']}: {f['failed']}"))
    scenes = f"{', '.join(plan.scenarios)}, {counted(sweep.seeds, 'seed')}"
    stored = f"{counted(data['episodes'], 'episode')} stored in {options.out}"
    return Group(with_title(f"{plan.by} over {plan.axis.name} ({scenes})", table), *lines, stored)


def _break_words(point: dict[str, float | None], share: float) -> str:
    level = f"{share:.0%} of its value at the easy end"
    return f"does not fall to {level}" if point["at"] is None else f"falls to {level} at {_span(point)}"


def _span(point: dict[str, float | None]) -> str:
    known = sorted(v for v in (point["low"], point["high"]) if v is not None)
    ends = f"{known[0]:.3g} to {known[1]:.3g}" if len(known) == 2 else "no end known"
    return f"{point['at']:.3g} ({ends})"
