"""`flockscope stress`: trackers on scenes that get harder; where each breaks, and worst scenes."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from scenarios.errors import InputError, counted, printable
from sim.store.atomic import lock_folder, write_file
from sim.store.own_files import refuse_foreign_file
from sim.store.tables import json_document, plain, table_bytes
from sim.types import Array, DetectionMode
from tracking.app import option_parsing
from tracking.app.command_options import StressOptions
from tracking.app.command_result import CommandResult
from tracking.app.progress import ProgressMeter
from tracking.app.score_tables import checked_key, figure, table
from tracking.scoring.catalogue import CATALOGUE
from tracking.stats import FEWEST, few, mean_interval
from tracking.stress.axes import Axis, parse_axes
from tracking.stress.breaking_points import BreakingPoint, shares
from tracking.stress.scene_player import Store, contender, scene_player
from tracking.stress.sweep import Plan, Sweep, generate_command, key_of
from tracking.stress.worst_scenes import SearchedScene, search, worst

EPISODES, TABLE, RESULT = "episodes.jsonl", "episodes.parquet", "stress.json"
REPORT = "report.html"
MOST_AXES = 2  # without a search
SIDES = {1: "above", -1: "below", 0: "unknown"}  # of the limit of a frontier
MARKS = {"above": "+", "below": "-", "unknown": "?"}
SIDE_WORDS = {"above": "surely above the limit", "below": "surely below it", "unknown": "not known"}


def stress(options: StressOptions) -> CommandResult:
    """Plays a sweep, or with --search a search for the worst scenes, stores the episodes, and returns the findings."""
    from tracking.app.report.of_sweep import report_of_sweep
    from tracking.app.report.page import check_packages, write_report

    check_packages()
    named = option_parsing.labelled(options.trackers)
    trackers = {name: contender(text, options.step_timeout) for name, text in named.items()}
    detects = all({"boxes", "points"} & {*tracker.needs} for tracker in trackers.values())
    plan = _plan(options, options.detections or ("file" if detects else "image"))
    refuse_foreign_file(options.out / REPORT)
    with (
        lock_folder(options.out),
        ProgressMeter("stress", options.search or options.episodes) as meter,
        scene_player(options.workers, options.cluster) as play,
    ):
        sweep = Sweep(plan, trackers, play, Store(options.out / EPISODES, options.fresh), meter.step)
        found = None
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
    chosen = option_parsing.scenario_settings(options.settings)
    _refuse_varied(chosen, axes)
    settings = (*option_parsing.sensor_settings(options.sensor), *chosen)
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


def _refuse_varied(settings: Iterable[str], axes: Iterable[Axis]) -> None:
    names = {setting.key: axis.name for axis in axes for setting in axis.settings(axis.easy)}
    for key in names.keys() & set(map(key_of, settings)):
        got, remedy = "what --vary varies", f"leave it out, and give the ends: --vary {names[key]}=EASY:HARD"
        raise InputError(place=f"--set {key}", got=got, expected="other keys", remedy=remedy)


def _data(sweep: Sweep, found: list[SearchedScene] | None) -> dict[str, Any]:
    """Returns all that stress.json has. found: the scenes of a search."""
    plan, rows, names = sweep.plan, sweep.rows(), [*sweep.trackers, *sweep.oracle_names]
    data: dict[str, Any] = {
        "axes": [{"name": axis.name, "easy": axis.easy, "hard": axis.hard} for axis in plan.axes],
        "values": sweep.values, "by": plan.by, "share": plan.share, "scenarios": list(plan.scenarios),
        "seeds": sweep.seeds, "episodes": sum(row["tracker"] in sweep.trackers for row in rows),
        "rounds": sweep.rounds, "budget_ended": sweep.stopped, "oracles": sweep.oracles,
        "curves": {}, "by_scenario": None, "matrix": None, "found": None,
        "failures": [row for row in rows if row["failed"]],
        "left_out": [row for row in rows if row["left_out"] and row["tracker"] == sweep.oracle_names[0]],
    }  # fmt: skip
    if found is not None:
        seeds = len({scene.source.seed for scene in sweep.scenes.values()})
        return {**data, "seeds": seeds, "found": [_failure(failure, k) for k, failure in enumerate(worst(found), 1)]}
    data["curves"] = {name: {**_ends(sweep.scores(name), plan.by), "break": None} for name in names}
    for name, best in sweep.oracles.items():
        of_share = zip(("mean", "low", "high"), map(plain, shares(sweep.scores(name), sweep.scores(best))), strict=True)
        data["curves"][name] |= {"oracle": best, "share": {**dict(of_share), "break": None}}
    if not plan.axes:
        data["by_scenario"] = {name: _by_scenario(sweep, name) for name in names}
    elif len(plan.axes) == 1:
        for name, point in sweep.breaks().items():
            data["curves"][name]["break"] = _break(sweep, point)
        for name, point in sweep.share_breaks().items():
            data["curves"][name]["share"]["break"] = _break(sweep, point)
    else:
        data["matrix"] = _matrix(sweep, data["curves"])
    return data


def _ends(scores: Array, by: str) -> dict[str, list[float | None]]:
    """Returns mean, ends of its 95 % interval, and number of scenes, for each column of scores (P, V)."""
    mean, low, high = (plain(CATALOGUE[by].within(end)) for end in mean_interval(scores))
    return {"mean": mean, "low": low, "high": high, "scenes": np.isfinite(scores).sum(axis=0).tolist()}


def _matrix(sweep: Sweep, curves: Mapping[str, Any]) -> dict[str, Any]:
    first, second = ([*dict.fromkeys(values[k] for values in sweep.values)] for k in range(MOST_AXES))
    frontiers, shape = {}, (len(first), len(second))
    for name in sweep.trackers:
        found = sweep.frontier(name)
        sides = [[SIDES[side] for side in row] for row in found.sides.tolist()]
        points = [_on_axis(sweep.plan.axes[1], point) for point in found.points]
        frontiers[name] = {"sides": sides, "mean_above": found.above.tolist(), "points": points}
    return {
        "values": [first, second],
        "mean": {name: np.reshape(curve["mean"], shape).tolist() for name, curve in curves.items()},
        "share": {name: np.reshape(curves[name]["share"]["mean"], shape).tolist() for name in sweep.trackers},
        "frontier": frontiers,
    }  # fmt: skip


def _by_scenario(sweep: Sweep, name: str) -> dict[str, dict[str, float | None]]:
    scores: dict[str, list[float]] = {}
    for scene in sweep.scenes.values():
        scores.setdefault(scene.source.name, []).append(sweep.score(name, scene))
    ends = {scenario: _ends(np.array([found]).T, sweep.plan.by) for scenario, found in scores.items()}
    return {scenario: {key: only for key, (only,) in found.items()} for scenario, found in ends.items()}


def _on_axis(axis: Axis, point: BreakingPoint) -> dict[str, Any]:
    ends = {"at": point.at, "low": point.low, "high": point.high}
    found: dict[str, Any] = plain({k: axis.easy + x * (axis.hard - axis.easy) for k, x in ends.items()})
    return found


def _break(sweep: Sweep, point: BreakingPoint) -> dict[str, Any]:
    return {**_on_axis(sweep.plan.axes[0], point), "cell": sweep.cell(point)}


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
    best = np.array([row["oracle"] for row in rows], float)
    own = np.array([0.0 if row["failed"] else row["scores"].get(sweep.plan.by, np.nan) for row in rows], float)
    columns |= {"oracle": best, "share": own / np.where(best > 0, best, np.nan)}
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
        yield from _matrices(sweep, data["matrix"], title)
        yield from _shortage_lines(sweep, data)
        return
    names = [f"{values[0]:g}" if axes else "all" for values in sweep.values]
    if axes:
        of_shares = {name: curves[name]["share"] for name in sweep.trackers}
        rows = [[name, *(_interval(curve, k) for curve in of_shares.values())] for k, name in enumerate(names)]
        yield table(f"share of the oracle, {title}", (), [axes[0], *of_shares], rows)
    found = data["by_scenario"] or {}
    rows = [[key, *(_interval(of[key]) for of in found.values())] for key in found.get(sweep.oracle_names[0], ())]
    rows += [[name, *(_interval(curve, k) for curve in curves.values())] for k, name in enumerate(names)]
    yield table(title, (), [axes[0] if axes else "", *curves], rows)
    yield from _break_lines(sweep, data)


def _matrices(sweep: Sweep, matrix: dict[str, Any], title: str) -> Iterator[str]:
    (first, second), (a, b) = matrix["values"], (axis.name for axis in sweep.plan.axes)
    columns = [f"{b} {second[0]:g}", *(f"{value:g}" for value in second[1:])]
    for name, found in matrix["frontier"].items():
        rows, means = list[list[str]](), matrix["share"][name]
        for value, shown, sides, point in zip(first, means, found["sides"], found["points"], strict=True):
            cells = [f"{figure(share)} {MARKS[side]}" for share, side in zip(shown, sides, strict=True)]
            rows.append([f"{value:g}", *cells, _ends_words(point)])
        yield table(f"{name}: share of the oracle, {title}", (), [a, *columns], rows, [f"limit at {b}"])
    yield from _frontier_lines(sweep, matrix)
    for name, means in matrix["mean"].items():
        rows = [[f"{value:g}", *map(figure, row)] for value, row in zip(first, means, strict=True)]
        yield table(f"{name}: {title}", (), [a, *columns], rows)


def _frontier_lines(sweep: Sweep, matrix: dict[str, Any]) -> Iterator[str]:
    level = f"{sweep.plan.share:.0%} of the share at the easy end"
    yield f"limit: {level}; + surely above it, - surely below it, ? not known"
    for name, found in matrix["frontier"].items():
        sides = [side for row in found["sides"] for side in row]
        words = ", ".join(f"{sides.count(side)} {word}" for side, word in SIDE_WORDS.items())
        yield printable(f"{name}: of {counted(len(sides), 'value')} {words}")
    yield ""


def _break_lines(sweep: Sweep, data: dict[str, Any]) -> Iterator[str]:
    """Yields words on the breaking points of a sweep along one axis, and on the frontiers of one over two."""
    if data["found"] is not None:
        return
    if data["matrix"] is not None:
        yield from filter(None, _frontier_lines(sweep, data["matrix"]))
    elif sweep.plan.axes:
        curves, limit = data["curves"], sweep.plan.share
        shown = {f"{name}: share of the oracle": curves[name]["share"] for name in sweep.trackers}
        shown |= {f"{name}: {sweep.plan.by}": curve for name, curve in curves.items()}
        for words, curve in shown.items():
            yield printable(f"{words} {_break_words(curve, limit, [value for (value,) in sweep.values])}")
    yield from _shortage_lines(sweep, data)


def _shortage_lines(sweep: Sweep, data: dict[str, Any]) -> Iterator[str]:
    """Yields words on what is not known for lack of episodes, seeds or scenes."""
    curves, matrix = data["curves"], data["matrix"]
    points = [curve["break"] for one in curves.values() for curve in (one, one.get("share", one)) if curve["break"]]
    unknown = matrix is not None and any("unknown" in row for f in matrix["frontier"].values() for row in f["sides"])
    if unknown or any(p["cell"] or (p["at"] is not None and None in p.values()) for p in points):
        when = "in the first round" if sweep.rounds == 1 else f"after {sweep.rounds} rounds"
        if sweep.stopped:
            yield f"the budget ended {when}: wide intervals need more --episodes or --minutes"
        elif sweep.seeds == len(sweep.plan.seeds):
            yield "all seeds are played: wide intervals need more --seeds"
    scenes = min((count for curve in curves.values() for count in curve["scenes"]), default=0)
    if few(scenes):
        yield f"fewer than {FEWEST} scenes: intervals are indicative"


def _found(sweep: Sweep, data: dict[str, Any]) -> Iterator[str]:
    plan, tracker = sweep.plan, next(iter(sweep.trackers))
    columns = ["scenario", "seed", *(axis.name for axis in plan.axes), tracker, sweep.oracles[tracker], "shortfall"]
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


def _interval(curve: Mapping[str, Any], k: int | None = None) -> str:
    mean, low, high = (curve[key] if k is None else curve[key][k] for key in ("mean", "low", "high"))
    # An end at the limit of the score is nearer.
    return figure(mean) + ("" if low is None or high is None else f" ± {max(high - mean, mean - low):.3f}")


def _break_words(curve: Mapping[str, Any], limit: float, values: list[float]) -> str:
    point, level = curve["break"], f"{limit:.0%} of its value at the easy end"
    known = [value for value, mean in zip(values, curve["mean"], strict=True) if mean is not None]
    if not curve["mean"][0]:
        return "is 0 or unknown at the easy end: no breaking point"
    if point["at"] is None:
        last = f" up to {known[-1]:g}, the last known" if known[-1] != values[-1] else ""
        return f"does not fall to {level}{last}"
    cell = ", two neighbouring values" if point["cell"] else ""
    return f"falls to {level} at {_ends_words(point, cell)}"


def _ends_words(point: Mapping[str, Any], more: str = "") -> str:
    """Returns a breaking point in words, "–" if there is none."""
    if point["at"] is None:
        return "–"
    known = sorted(v for v in (point["low"], point["high"]) if v is not None)
    ends = f"{known[0]:.3g} to {known[1]:.3g}{more}" if len(known) == 2 else "its interval is not known"
    return f"{point['at']:.3g} ({ends})"
