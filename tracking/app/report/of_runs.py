"""The report on stored runs and tracker classes on the sequences of a source: `view DATASET TRACKS…`."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from collections.abc import Sequence as SequenceOf
from dataclasses import dataclass, replace

import numpy as np

from scenarios.errors import counted
from sim.types import Sequence
from tracking.app.commands.score_ranking import RankedRuns, rank_words, ranked_runs, verdict
from tracking.app.commands.score_tables import SIMILARITY
from tracking.app.commands.scored_sequence import ScoredSequence, ScoringJob, read_runs, score_runs, stored_runs
from tracking.app.replay_page.page import Run
from tracking.app.report.content import HeatCell, HeatMap, RankedRow, Report
from tracking.app.report.moments import COSTS, Candidate, cause_bars, moments, shown_errors
from tracking.app.sequence_workers import OpenedAs, over_sequences
from tracking.errors.found import RunErrors


@dataclass(frozen=True)
class JudgedRuns:
    """The scores and errors of all runs on a sequence."""

    job: ScoringJob
    scored: ScoredSequence
    errors: list[RunErrors]  # of each run


def judged_runs(
    names: Mapping[str, str], sequences: list[Sequence], source: OpenedAs, workers: int
) -> list[JudgedRuns]:
    """Returns scores and errors of runs, by name the text of the command line: stored tracks or a tracker class."""
    runs = stored_runs(names.values(), sequences)
    jobs = [ScoringJob(sources, oracles=True) for sources in zip(*runs, strict=True)]
    return list(over_sequences("report", _judge, sequences, jobs, source, workers))


def report_of_runs(
    names: SequenceOf[str],
    sequences: list[Sequence],
    found: SequenceOf[JudgedRuns],
    by: str | None,
    files: Mapping[str, str],
) -> Report:
    """Returns the report on runs; files: by sequence, the address of its page."""
    ranked = ranked_runs(list(names), sequences, [one.scored for one in found], by)
    candidates = list(_candidates(ranked))

    def replayed(one: Candidate) -> tuple[Sequence, Run, Run | None]:
        k = ranked.comparison.sequences.index(one.sequence)
        places = [names.index(name) for name in (one.name, one.rival) if name]
        tracks = read_runs(sequences[k], replace(found[k].job, sources=tuple(found[k].job.sources[r] for r in places)))
        run, *rival = (
            Run(tracked, found[k].errors[r].errors, names[r]) for r, tracked in zip(places, tracks, strict=True)
        )
        return sequences[k], run, rival[0] if rival else None

    c = ranked.comparison
    return Report(
        title=f"{counted(len(names), 'tracker')} on {counted(len(sequences), 'sequence')}",
        about=f"People are compared by {SIMILARITY[c.similarity]}. The oracle has true ids on the same input.",
        by=ranked.key, ranking=_ranking(ranked), ranking_words=[*verdict(c, ranked.key), *ranked.notes],
        heat=_heat(ranked) if len(ranked.scenarios) > 1 else None,
        causes=cause_bars([(name, one.errors[k]) for k, name in enumerate(c.runs) for one in found]),
        causes_about="What the repair of the errors of one kind and cause adds, mean over the sequences.",
        moments=moments(candidates, replayed),
        sequences=[
            (one.sequence, files[one.sequence], one.score)
            for one in sorted(candidates, key=lambda one: one.score) if one.sequence in files
        ],
    )  # fmt: skip


def _judge(sequence: Sequence, job: ScoringJob) -> JudgedRuns:
    runs = read_runs(sequence, job)
    errors = [shown_errors(sequence, run, COSTS, causes=True) for run in runs]
    return JudgedRuns(job, score_runs(sequence, runs, job), errors)


def _ranking(ranked: RankedRuns) -> list[RankedRow]:
    return [
        RankedRow(row["run"], rank_words(row), row["mean"], row["low"], row["high"], _scores(row))
        for row in ranked.table
    ]


def _scores(row: Mapping[str, object]) -> dict[str, float]:
    return {key: value for key, value in row.items() if isinstance(value, float)}


def _best(ranked: RankedRuns, name: str, k: int) -> float:
    """Returns the score of the oracle of a run's input on sequence k, nan without one."""
    c = ranked.comparison
    rows = [c.oracles[given] for given in c.inputs[name] if given in c.oracles] or list(c.oracles.values())
    known = [row[k] for row in rows]
    return next((float(one[ranked.key]) for one in known if one is not None), math.nan)


def _heat(ranked: RankedRuns) -> HeatMap:
    c, names = ranked.comparison, [row["run"] for row in ranked.table if row["first"] is not None]
    rows = {}
    for scenario, places in ranked.scenarios.items():
        cells = []
        for name in names:
            scores = np.array([c.scores[name][k][ranked.key] for k in places], float)
            best = np.array([_best(ranked, name, k) for k in places])
            score = float(scores.mean())
            cells.append(HeatCell(score, float(best.mean()), "" if math.isfinite(score) else "not scored"))
        rows[scenario] = cells
    return HeatMap(f"{ranked.key} by scenario", tuple(names), rows)


def _candidates(ranked: RankedRuns) -> Iterator[Candidate]:
    c = ranked.comparison
    scenario = {k: name for name, places in ranked.scenarios.items() for k in places}
    for name in c.runs:
        for k, sequence in enumerate(c.sequences):
            score = c.scores[name][k][ranked.key]
            others = {r: c.scores[r][k][ranked.key] for r in c.runs if r != name}
            known = {r: value for r, value in others.items() if math.isfinite(value)}
            rival = max(known, key=known.__getitem__, default="")
            if math.isfinite(score):
                yield Candidate(name, scenario[k], sequence, float(score), _best(ranked, name, k), rival)
