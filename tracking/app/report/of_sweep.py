"""The report on a sweep: `stress`."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from collections.abc import Sequence as SequenceOf
from dataclasses import replace
from operator import itemgetter

import numpy as np

from scenarios.errors import counted
from scenarios.loading.resolve import SuiteEntry, rows
from sim.types import Array, Sequence
from tracking.app.replay_page.page import Run
from tracking.app.report.content import Curves, HeatCell, HeatMap, Json, Played, Report, heat_map
from tracking.app.report.moments import COSTS, cause_rows, moments, shown_errors
from tracking.app.score_ranking import rank_words
from tracking.episodes.episode import streams_for
from tracking.episodes.parallel_episodes import opened_sources
from tracking.errors.found import RunErrors
from tracking.ranking import rank
from tracking.running.run import track
from tracking.scoring.catalogue import CATALOGUE
from tracking.stats import mean_interval, mean_of_finite
from tracking.stress.sweep import Scene, Sweep, generate_command

CAUSES = "What the repair of the errors of one kind and cause adds, mean over the sequences of the worst moments."


def report_of_sweep(sweep: Sweep, data: Json, words: SequenceOf[str]) -> Report:
    """Returns the report on a sweep. data: the content of stress.json; words: sentences on the breaking points."""
    plan, searched = sweep.plan, data["found"] is not None
    scenes = [*sweep.scenes.values()]
    where = "at the easy end of the axes" if plan.axes else "as they are"
    easy = scenes if searched or not plan.axes else [s for s in scenes if s.values == sweep.values[0]]
    entries = {entry.name: entry for name in plan.scenarios for entry in rows(name)}
    played = {one: scene for scene in scenes for one in _played(sweep, scene, entries)}
    chosen = {id(scene) for scene in easy}
    easiest = [(p.scenario, p.name, p) for p, s in played.items() if id(s) in chosen]
    errors: list[tuple[str, RunErrors]] = []
    shown = moments([*played], lambda one, rival: _replay(sweep, (one.name, rival), played[one], errors))
    return Report(
        title=f"Stress of {', '.join(sweep.trackers)}", about=_about(sweep, data), by=plan.by,
        ranking=[] if searched else list(_ranking(sweep, easy)),
        ranking_words=[f"{counted(len(easy), 'scene')}, {where}. Trackers with a common rank: no sure difference."],
        heat=heat_map(f"{plan.by} by scenario", easiest),
        curves=_curves(sweep, data, words),
        matrix_words=words if data["matrix"] else [],
        matrices=list(_matrices(sweep, played, data["matrix"])) if data["matrix"] else [],
        causes=cause_rows(errors), causes_about=CAUSES, moments=shown, failures=data["failures"],
    )  # fmt: skip


def _about(sweep: Sweep, data: Json) -> str:
    plan = sweep.plan
    axes = f" along {' and '.join(axis.name for axis in plan.axes)}" if plan.axes else ""
    seeds = counted(len({scene.source.seed for scene in sweep.scenes.values()}), "seed")
    return f"{counted(data['episodes'], 'episode')} of {', '.join(plan.scenarios)}{axes}, {seeds}"


def _values(sweep: Sweep, name: str, scenes: SequenceOf[Scene], key: str) -> Array:
    rows = (sweep.row(name, scene) for scene in scenes)
    return np.array([math.nan if row is None else row["scores"].get(key, math.nan) for row in rows])


def _ranking(sweep: Sweep, scenes: SequenceOf[Scene]) -> Iterator[Json]:
    names, oracles = [*sweep.trackers], [*sweep.oracle_names]
    of_all = {name: np.array([sweep.score(name, scene) for scene in scenes]) for name in (*oracles, *names)}
    found = rank(np.array([of_all[name] for name in names]))
    ranks = [{"first": a, "last": b} for a, b in zip(found.first.tolist(), found.last.tolist(), strict=True)]
    words = [*("" for _ in oracles), *map(rank_words, ranks)]
    best = np.array([of_all[name] for name in oracles]).T
    ends = zip(mean_interval(best), (found.mean, found.low, found.high), strict=True)
    mean, low, high = (CATALOGUE[sweep.plan.by].within(np.concatenate(pair)).tolist() for pair in ends)
    for k, name in enumerate([*oracles, *(names[k] for k in found.order.tolist())]):
        means = {key: mean_of_finite(_values(sweep, name, scenes, key)) for key in CATALOGUE}
        yield {"run": name, "rank": words[k], "mean": mean[k], "low": low[k], "high": high[k], **means}


def _curves(sweep: Sweep, data: Json, words: SequenceOf[str]) -> Curves | None:
    if len(sweep.plan.axes) != 1 or not data["curves"]:
        return None
    (axis,) = sweep.plan.axes
    shares = {name: data["curves"][name]["share"] for name in sweep.trackers}
    return Curves(axis.name, axis.about, [value for (value,) in sweep.values], data["curves"], shares, words)


def _matrices(sweep: Sweep, played: Mapping[Played, Scene], matrix: Json) -> Iterator[HeatMap]:
    rows, columns = (axis.name for axis in sweep.plan.axes)
    order = {values: k for k, values in enumerate(sweep.values)}
    every = sorted(((order[scene.values], scene.values, one) for one, scene in played.items()), key=itemgetter(0))
    for name in sweep.trackers:
        heat = heat_map(name, ((f"{rows} {a:g}", f"{columns} {b:g}", p) for _, (a, b), p in every if p.name == name))
        yield replace(heat, rows=dict(zip(heat.rows, _with_frontier(heat, matrix["frontier"][name]), strict=True)))


def _with_frontier(heat: HeatMap, frontier: Json) -> Iterator[list[HeatCell]]:
    above: list[list[bool]] = frontier["mean_above"]
    for i, (cells, sides) in enumerate(zip(heat.rows.values(), frontier["sides"], strict=True)):
        edges = [
            ("left " if k and above[i][k] != above[i][k - 1] else "")
            + ("top" if i and above[i][k] != above[i - 1][k] else "")
            for k in range(len(cells))
        ]
        yield [replace(cell, side=s, edges=e) for cell, s, e in zip(cells, sides, edges, strict=True)]


def _played(sweep: Sweep, scene: Scene, entries: Mapping[str, SuiteEntry]) -> Iterator[Played]:
    settings, command = [*map(str, sweep.plan.settings_at(scene.values))], ""
    name_and_seed = f"{scene.source.name}, seed {scene.source.seed}"
    words = " ".join([name_and_seed, *settings])
    if (entry := entries.get(scene.source.name)) is not None:  # a copy is generated by no command alone
        command = generate_command(entry.scenario, scene.source.seed, (*entry.settings, *settings), "worst")
    for name in sweep.trackers:
        row, score = sweep.row(name, scene), sweep.score(name, scene)
        why = "" if math.isfinite(score) else "not scored"
        if row is None or row["failed"] or row["left_out"]:
            why = "not played" if row is None else "failed" if row["failed"] else "left out"
        yield Played(
            name, scene.source.name, name_and_seed, words, score, sweep.score(sweep.oracles[name], scene), why, command
        )


def _replay(
    sweep: Sweep, names: tuple[str, str], scene: Scene, found: list[tuple[str, RunErrors]]
) -> tuple[Sequence, list[Run]]:
    """Returns the tracks of a tracker and its rival; the errors of the first are added to `found`."""
    mode, trackers = sweep.plan.detections, [sweep.trackers[name].tracker for name in names if name]
    streams = dict.fromkeys(stream for tracker in trackers for stream in streams_for(tracker, mode))
    sequence = opened_sources().open(scene.source, tuple(streams)).sequence  # it may be open still
    runs = [track(tracker, sequence, detections=mode, seed=scene.source.seed) for tracker in trackers]
    errors = [shown_errors(sequence, runs[0], COSTS, causes=True), *(shown_errors(sequence, run) for run in runs[1:])]
    found.append((names[0], errors[0]))
    return sequence, [Run(run, own.errors, name) for run, own, name in zip(runs, errors, names, strict=False)]
