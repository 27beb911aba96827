"""The report on a sweep: `stress`."""

from __future__ import annotations

import math
from collections.abc import Iterator
from collections.abc import Sequence as SequenceOf

import numpy as np

from scenarios.errors import counted
from scenarios.loading.resolve import rows
from sim.types import Array, Sequence
from tracking.app.commands.score_ranking import rank_words
from tracking.app.replay_page.page import Run
from tracking.app.report.content import Curve, Curves, Failure, HeatCell, HeatMap, Json, RankedRow, Report
from tracking.app.report.moments import COSTS, Candidate, cause_bars, moments, shown_errors
from tracking.environment.episodes import streams_for
from tracking.errors.found import RunErrors
from tracking.ranking import rank
from tracking.running.run import track
from tracking.scoring.catalogue import CATALOGUE
from tracking.stats import mean_interval, mean_of_finite
from tracking.stress.episodes import ORACLE
from tracking.stress.sweep import Scene, Sweep, generate_command
from tracking.tuning.parallel_episodes import opened_sources

CAUSES = "What the repair of the errors of one kind and cause adds, mean over the sequences of the worst moments."


def report_of_sweep(sweep: Sweep, data: Json, words: SequenceOf[str]) -> Report:
    """Returns the report on a sweep.

    data: as stress.json has it; words: on breaking points.
    """
    plan, searched = sweep.plan, data["found"] is not None
    scenes = [*sweep.scenes.values()]
    easy = scenes if searched or not plan.axes else [s for s in scenes if s.values == sweep.values[0]]
    candidates = dict(_candidates(sweep, scenes))
    errors: list[tuple[str, RunErrors]] = []
    shown = moments([*candidates], lambda one: _replay(sweep, one, candidates[one], errors))
    return Report(
        title=f"Stress of {', '.join(sweep.trackers)}", about=_about(sweep, data), by=plan.by,
        ranking=[] if searched else list(_ranking(sweep, easy)), ranking_words=_ranking_words(sweep, easy),
        heat=_scenarios(sweep, easy), curves=_curves(sweep, data, words), matrices=list(_matrices(sweep, data)),
        causes=cause_bars(errors), causes_about=CAUSES,
        moments=shown,
        failures=[Failure(row["tracker"], _scene(row), row["failed"], row["traceback"]) for row in data["failures"]],
    )  # fmt: skip


def _about(sweep: Sweep, data: Json) -> str:
    plan = sweep.plan
    axes = f" along {' and '.join(axis.name for axis in plan.axes)}" if plan.axes else ""
    seeds = counted(len({scene.source.seed for scene in sweep.scenes.values()}), "seed")
    return f"{counted(data['episodes'], 'episode')} of {', '.join(plan.scenarios)}{axes}, {seeds}"


def _scene(row: Json) -> str:
    return " ".join([f"{row['scenario']}, seed {row['seed']}", *row["settings"]])


def _values(sweep: Sweep, name: str, scenes: SequenceOf[Scene], key: str | None = None) -> Array:
    if key is None:
        return np.array([sweep.score(name, scene) for scene in scenes])
    rows = (sweep.row(name, scene) for scene in scenes)
    return np.array([math.nan if row is None else row["scores"].get(key, math.nan) for row in rows])


def _ranking(sweep: Sweep, scenes: SequenceOf[Scene]) -> Iterator[RankedRow]:
    mean, low, high = (float(end[0]) for end in mean_interval(_values(sweep, ORACLE, scenes)[:, None]))
    yield RankedRow(ORACLE, "", mean, low, high, _means(sweep, ORACLE, scenes))
    names = [*sweep.trackers]
    found = rank(np.array([_values(sweep, name, scenes) for name in names]))
    for place, k in enumerate(found.order.tolist()):
        row = {"first": int(found.first[place]), "last": int(found.last[place])}
        mean, low, high = (float(end[place]) for end in (found.mean, found.low, found.high))
        yield RankedRow(names[k], rank_words(row), mean, low, high, _means(sweep, names[k], scenes))


def _means(sweep: Sweep, name: str, scenes: SequenceOf[Scene]) -> dict[str, float]:
    return {key: mean_of_finite(_values(sweep, name, scenes, key)) for key in CATALOGUE}


def _ranking_words(sweep: Sweep, scenes: SequenceOf[Scene]) -> list[str]:
    where = "at the easy end of the axes" if sweep.plan.axes else "as they are"
    return [f"{counted(len(scenes), 'scene')}, {where}. Trackers with a common rank: no sure difference."]


def _cell(sweep: Sweep, name: str, scenes: SequenceOf[Scene]) -> HeatCell:
    score, best = (mean_of_finite(_values(sweep, each, scenes)) for each in (name, ORACLE))
    rows = [row for scene in scenes if (row := sweep.row(name, scene)) is not None]
    why = "not played" if not rows else "left out" if all(row["left_out"] for row in rows) else "not scored"
    return HeatCell(score, best, "" if math.isfinite(score) else why)


def _scenarios(sweep: Sweep, scenes: SequenceOf[Scene]) -> HeatMap:
    own: dict[str, list[Scene]] = {}
    for scene in scenes:
        own.setdefault(scene.source.name, []).append(scene)
    names = [*sweep.trackers]
    rows = {scenario: [_cell(sweep, name, found) for name in names] for scenario, found in own.items()}
    return HeatMap(f"{sweep.plan.by} by scenario", tuple(names), rows)


def _curves(sweep: Sweep, data: Json, words: SequenceOf[str]) -> list[Curves]:
    if len(sweep.plan.axes) != 1 or not data["curves"]:
        return []
    (axis,) = sweep.plan.axes
    unknown = {"at": None, "low": None, "high": None}
    curves = []
    for name, one in data["curves"].items():
        mean, low, high = (_numbers(one[part]) for part in ("mean", "low", "high"))
        curves.append(Curve(name, mean, low, high, one["break"] or unknown))
    return [Curves(axis.name, axis.about, [value for (value,) in sweep.values], curves, words)]


def _numbers(values: SequenceOf[float | None]) -> list[float]:
    return [math.nan if value is None else value for value in values]


def _matrices(sweep: Sweep, data: Json) -> Iterator[HeatMap]:
    if data["matrix"] is None:
        return
    first, second = data["matrix"]["values"]
    of = {(a, b): [s for s in sweep.scenes.values() if s.values == (a, b)] for a in first for b in second}
    rows, columns = (axis.name for axis in sweep.plan.axes)
    for name in sweep.trackers:
        cells = {f"{rows} {a:g}": [_cell(sweep, name, of[a, b]) for b in second] for a in first}
        yield HeatMap(name, tuple(f"{columns} {b:g}" for b in second), cells)


def _candidates(sweep: Sweep, scenes: SequenceOf[Scene]) -> Iterator[tuple[Candidate, Scene]]:
    entries = {entry.name: entry for name in sweep.plan.scenarios for entry in rows(name)}
    for scene in scenes:
        scores = {name: sweep.score(name, scene) for name in sweep.trackers}
        played = {name: sweep.row(name, scene) for name in sweep.trackers}
        known = [name for name, row in played.items() if row and not row["failed"] and math.isfinite(scores[name])]
        entry = entries.get(scene.source.name)  # None of a copy, which no command generates alone
        settings = () if entry is None else (*entry.settings, *sweep.plan.settings_at(scene.values))
        command = "" if entry is None else generate_command(entry.scenario, scene.source.seed, settings, "worst")
        for name in known:
            words = _scene(played[name] or {})
            rival = max((other for other in known if other != name), key=scores.__getitem__, default="")
            best = sweep.score(ORACLE, scene)
            yield Candidate(name, scene.source.name, words, scores[name], best, rival, command), scene


def _replay(
    sweep: Sweep, one: Candidate, scene: Scene, found: list[tuple[str, RunErrors]]
) -> tuple[Sequence, Run, Run | None]:
    """Returns the tracks of a candidate and its rival; the errors of the candidate are added to `found`."""
    mode, names = sweep.plan.detections, [name for name in (one.name, one.rival) if name]
    trackers = [sweep.trackers[name].tracker for name in names]
    streams = dict.fromkeys(stream for tracker in trackers for stream in streams_for(tracker, mode))
    sequence = opened_sources().open(scene.source, tuple(streams)).sequence  # it may be open still
    runs = [track(tracker, sequence, detections=mode, seed=scene.source.seed) for tracker in trackers]
    found.append((one.name, shown_errors(sequence, runs[0], COSTS, causes=True)))
    rivals = [Run(run, shown_errors(sequence, run).errors, one.rival) for run in runs[1:]]
    return sequence, Run(runs[0], found[-1][1].errors, one.name), rivals[0] if rivals else None
