"""`flockscope stress`: trackers on scenes that get harder; where each breaks, and worst scenes."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from scenarios.errors import InputError, counted, printable
from sim.io.files.atomic import lock_folder, write_file
from sim.io.files.own_files import refuse_foreign_file
from sim.io.files.tables import json_document, plain, table_bytes
from sim.types import Array, DetectionMode
from tracking.app import option_parsing
from tracking.app.command_options import StressOptions
from tracking.app.command_result import CommandResult
from tracking.app.commands.score_tables import checked_key, figure, table
from tracking.app.progress import ProgressMeter
from tracking.scoring.catalogue import CATALOGUE
from tracking.stats import mean_interval
from tracking.stress.axes import BreakingPoint, parse_axes
from tracking.stress.scene_player import ORACLE, Store, contender, scene_player
from tracking.stress.sweep import Plan, Sweep, generate_command
from tracking.stress.worst_scenes import SearchedScene, search, worst

EPISODES, TABLE, RESULT = "episodes.jsonl", "episodes.parquet", "stress.json"
REPORT = "report.html"
MOST_AXES = 2  # without a search


def stress(options: StressOptions) -> CommandResult:
    """Plays a sweep, or with --search a search for the worst scenes, stores the episodes, and returns the findings."""
    from tracking.app.report.of_sweep import report_of_sweep
    from tracking.app.report.page import check_packages, write_report

    check_packages()
    trackers = {name: contender(name, options.step_timeout) for name in dict.fromkeys(options.trackers)}
    detects = all({"boxes", "points"} & {*tracker.needs} for tracker in trackers.values())
    plan = _plan(options, options.detections or ("file" if detects else "image"))
    refuse_foreign_file(options.out / REPORT)
    with (
        lock_folder(options.out),
        ProgressMeter("stress", options.search or options.episodes) as meter,
        scene_player(options.workers, options.cluster) as play,
    ):
        sweep, found = (
            Sweep(plan, trackers, play, Store(options.out / EPISODES, options.fresh), meter.step),
            None,
        )
        if options.search is None:
            sweep.run()
        else:
            found = search(sweep, options.search)
        data = _data(sweep, found)
        write_file(options.out / RESULT, json_document(data))
        write_file(options.out / TABLE, _parquet(sweep))
        write_report(report_of_sweep(sweep, data, [*_break_lines(sweep, data)]), options.out / REPORT)
    return CommandResult({**data, "taken_over": sweep.taken_over}, _text(sweep, data, options.out))


def _plan(options: StressOptions, detections: DetectionMode) -> Plan:
    by, axes = checked_key(options.by, better=("higher",)), parse_axes(options.vary)
    seeds = tuple(option_parsing.seeds(options.seeds, "--seeds"))
    settings = (*option_parsing.sensor_settings(options.sensor), *option_parsing.scenario_settings(options.settings))
    if options.search is None and len(axes) > MOST_AXES:
        got, remedy = f"{len(axes)} axes", "leave some out, or search their scenes with --search N"
        raise InputError(place="--vary", got=got, expected=f"at most {MOST_AXES}", remedy=remedy)
    if options.search is not None and options.episodes is not None:
        got, remedy = "it beside --search", "leave it out: --search N plays N scenes"
        raise InputError(place="--episodes", got=got, expected="one of the two", remedy=remedy)
    return Plan(
        tuple(options.suite), axes, seeds, min(len(seeds), options.start), by, options.share, detections, settings,
        options.episodes, options.minutes,
    )  # fmt: skip


def _data(sweep: Sweep, found: list[SearchedScene] | None) -> dict[str, Any]:
    """Returns all that stress.json has. found: the scenes of a search."""
    plan, rows, names = sweep.plan, sweep.rows(), [*sweep.trackers, ORACLE]
    data: dict[str, Any] = {
        "axes": [{"name": axis.name, "easy": axis.easy, "hard": axis.hard} for axis in plan.axes],
        "values": sweep.values, "by": plan.by, "share": plan.share, "scenarios": list(plan.scenarios),
        "seeds": sweep.seeds, "episodes": sum(row["tracker"] != ORACLE for row in rows),
        "curves": {}, "by_scenario": None, "matrix": None, "found": None,
        "failures": [row for row in rows if row["failed"]],
        "left_out": [row for row in rows if row["left_out"] and row["tracker"] == ORACLE],
    }  # fmt: skip
    if found is not None:
        seeds = len({scene.source.seed for scene in sweep.scenes.values()})
        return {**data, "seeds": seeds, "found": [_failure(failure, k) for k, failure in enumerate(worst(found), 1)]}
    data["curves"] = {name: {**_means(sweep.scores(name)), "break": None} for name in names}
    if not plan.axes:
        data["by_scenario"] = {name: _by_scenario(sweep, name) for name in names}
    elif len(plan.axes) == 1:
        for name, point in sweep.breaks().items():
            data["curves"][name]["break"] = _on_axis(plan, point)
    else:
        first, second = ([*dict.fromkeys(values[k] for values in sweep.values)] for k in range(MOST_AXES))
        means = {name: np.reshape(curve["mean"], (len(first), -1)).tolist() for name, curve in data["curves"].items()}
        data["matrix"] = {"values": [first, second], "mean": means}
    return data


def _means(scores: Array) -> dict[str, list[float | None]]:
    """Returns mean, ends of its 95 % interval, and number of scenes, for each column of scores (P, V)."""
    mean, low, high = map(plain, mean_interval(scores))
    return {"mean": mean, "low": low, "high": high, "scenes": np.isfinite(scores).sum(axis=0).tolist()}


def _by_scenario(sweep: Sweep, name: str) -> dict[str, dict[str, float | None]]:
    scores: dict[str, list[float]] = {}
    for scene in sweep.scenes.values():
        scores.setdefault(scene.source.name, []).append(sweep.score(name, scene))
    return {scenario: _first(_means(np.array([found]).T)) for scenario, found in scores.items()}


def _first(means: dict[str, Any], k: int = 0) -> dict[str, float | None]:
    return {key: means[key][k] for key in ("mean", "low", "high", "scenes")}


def _on_axis(plan: Plan, point: BreakingPoint) -> dict[str, float | None]:
    (axis,) = plan.axes
    ends = {"at": point.at, "low": point.low, "high": point.high}
    found: dict[str, float | None] = plain({k: axis.easy + x * (axis.hard - axis.easy) for k, x in ends.items()})
    return found


def _failure(failure: SearchedScene, place: int) -> dict[str, Any]:
    source = failure.scene.source
    command = generate_command(failure.scenario, source.seed, failure.settings, f"worst-{place}")
    return {
        "scenario": source.name, "seed": source.seed, "values": failure.scene.values,
        "settings": list(failure.settings), "score": failure.score, "oracle": failure.oracle,
        "shortfall": failure.shortfall, "number": failure.number, "command": command,
    }  # fmt: skip


def _parquet(sweep: Sweep) -> bytes:
    rows = sweep.rows()
    words = ("tracker", "scenario", "left_out", "failed", "traceback")
    columns = {key: np.array([row[key] for row in rows], object) for key in words}
    columns["seed"] = np.array([row["seed"] for row in rows])
    columns |= {axis.name: np.array([row["values"][axis.name] for row in rows]) for axis in sweep.plan.axes}
    columns |= {key: np.array([row["scores"].get(key, np.nan) for row in rows], float) for key in CATALOGUE}
    units = {key: score.unit for key, score in CATALOGUE.items()}
    return table_bytes(columns, {"axes": [axis.name for axis in sweep.plan.axes]}, units)


def _text(sweep: Sweep, data: dict[str, Any], out: Path) -> str:
    parts = _found(sweep, data) if data["found"] is not None else _curves(sweep, data)
    taken, episodes = sweep.taken_over, counted(data["episodes"], "episode")
    stored = f", stored {taken['stored']}" if taken["episodes"] else ""
    end = f"{episodes} stored in {out}, {taken['episodes']} of them taken over{stored}; report: {out / REPORT}"
    return "\n".join([*parts, *_notes(data), end])


def _curves(sweep: Sweep, data: dict[str, Any]) -> Iterator[str]:
    plan, curves, axes = sweep.plan, data["curves"], [axis.name for axis in sweep.plan.axes]
    over = f" over {' and '.join(axes)}" if axes else ""
    title = f"{plan.by}{over} ({', '.join(plan.scenarios)}, {counted(sweep.seeds, 'seed')})"
    if data["matrix"] is not None:
        first, second = data["matrix"]["values"]
        columns = [f"{axes[1]} {second[0]:g}", *(f"{value:g}" for value in second[1:])]
        for name, means in data["matrix"]["mean"].items():
            rows = [[f"{value:g}", *map(figure, row)] for value, row in zip(first, means, strict=True)]
            yield table(f"{name}: {title}", (), [axes[0], *columns], rows)
        return
    rows = []
    for scenario in {} if axes else data["by_scenario"][ORACLE]:
        rows.append([scenario, *(_interval(of[scenario]) for of in data["by_scenario"].values())])
    for k, values in enumerate(sweep.values):
        name = f"{values[0]:g}" if axes else "all"
        rows.append([name, *(_interval(_first(curve, k)) for curve in curves.values())])
    yield table(title, (), [axes[0] if axes else "", *curves], rows)
    yield from _break_lines(sweep, data)


def _break_lines(sweep: Sweep, data: dict[str, Any]) -> Iterator[str]:
    """Yields words on the breaking points of a sweep along one axis."""
    if len(sweep.plan.axes) != 1 or data["found"] is not None:
        return
    for name in sweep.trackers:
        yield f"{printable(name)} {_break_words(data['curves'][name]['break'], sweep.plan.share)}"


def _found(sweep: Sweep, data: dict[str, Any]) -> Iterator[str]:
    plan, tracker = sweep.plan, next(iter(sweep.trackers))
    columns = ["scenario", "seed", *(axis.name for axis in plan.axes), tracker, ORACLE, "shortfall"]
    rows = [
        [f["scenario"], str(f["seed"]), *(f"{value:g}" for value in f["values"]),
         *(figure(f[key]) for key in ("score", "oracle", "shortfall"))]
        for f in data["found"]
    ]  # fmt: skip
    scenes = f"{', '.join(plan.scenarios)}, {counted(len(sweep.scenes), 'scene')}"
    yield table(f"where {tracker} is worst, next to the oracle: {plan.by} ({scenes})", (), columns, rows)
    if not rows:
        yield f"{printable(tracker)} is nowhere worse than the oracle"
    for f in data["found"]:
        yield printable(f["command"].replace(" --set ", " \\\n    --set "), keep="\n")


def _notes(data: dict[str, Any]) -> Iterator[str]:
    for name in dict.fromkeys(f["tracker"] for f in data["failures"]):
        failed = [f for f in data["failures"] if f["tracker"] == name]
        yield _note(f"{name} failed in {counted(len(failed), 'episode')}", failed[0], "failed")
    if left_out := data["left_out"]:
        yield _note(f"{counted(len(left_out), 'scene')} left out", left_out[0], "left_out")


def _note(words: str, first: Mapping[str, Any], key: str) -> str:
    return printable(f"{words}, the first {first['scenario']}, seed {first['seed']}: {first[key]}")


def _interval(row: Mapping[str, float | None]) -> str:
    low, high = row["low"], row["high"]
    return figure(row["mean"]) + ("" if low is None or high is None else f" ± {(high - low) / 2:.3f}")


def _break_words(point: Mapping[str, float | None], share: float) -> str:
    level = f"{share:.0%} of its value at the easy end"
    if point["at"] is None:
        return f"does not fall to {level}"
    known = sorted(v for v in (point["low"], point["high"]) if v is not None)
    ends = f"{known[0]:.3g} to {known[1]:.3g}" if len(known) == 2 else "its interval is not known: play more episodes"
    return f"falls to {level} at {point['at']:.3g} ({ends})"
