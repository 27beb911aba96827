"""The report on stored runs and tracker classes on the sequences of a source: `view DATASET TRACKS…`."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from collections.abc import Sequence as SequenceOf
from dataclasses import dataclass, replace

from scenarios.errors import counted
from sim.types import Sequence
from tracking.app.replay_page.page import Run
from tracking.app.report.content import Played, Report, heat_map
from tracking.app.report.moments import COSTS, cause_rows, moments, shown_errors
from tracking.app.score_ranking import RankedRuns, rank_words, ranked_runs, verdict
from tracking.app.score_tables import SIMILARITY
from tracking.app.scored_sequence import ScoringJob, read_runs, score_runs
from tracking.comparison import ComparedSequence
from tracking.errors.found import RunErrors


@dataclass(frozen=True)
class JudgedRuns:
    """The scores and errors of all runs on a sequence."""

    job: ScoringJob
    scored: ComparedSequence
    errors: list[RunErrors]  # of each run


def judge(sequence: Sequence, job: ScoringJob) -> JudgedRuns:
    """Returns the scores and errors of all runs of a job on the sequence."""
    runs = read_runs(sequence, job)
    errors = [shown_errors(sequence, run, COSTS, causes=True) for run in runs]
    return JudgedRuns(job, score_runs(sequence, runs, job), errors)


def report_of_runs(
    names: SequenceOf[str],
    sequences: list[Sequence],
    found: SequenceOf[JudgedRuns],
    by: str | None,
    files: Mapping[str, str],
) -> Report:
    """Returns the report on runs; files: by sequence, the address of its page."""
    ranked = ranked_runs(list(names), sequences, [one.scored for one in found], by)
    played = list(_played(ranked))

    def replayed(one: Played, rival: str) -> tuple[Sequence, list[Run]]:
        k = ranked.comparison.sequences.index(one.sequence)
        places = [names.index(name) for name in (one.name, rival) if name]
        job = replace(found[k].job, sources=tuple(found[k].job.sources[r] for r in places))
        tracks = zip(places, read_runs(sequences[k], job), strict=True)
        return sequences[k], [Run(tracked, found[k].errors[r].errors, names[r]) for r, tracked in tracks]

    c = ranked.comparison
    shown = [row["run"] for row in ranked.table if row["first"] is not None]
    heat = [(one.scenario, one.name, one) for name in shown for one in played if one.name == name]
    return Report(
        title=f"{counted(len(names), 'tracker')} on {counted(len(sequences), 'sequence')}",
        about=f"People are compared by {SIMILARITY[c.similarity]}. The oracle has true ids on the same input.",
        by=ranked.key, ranking=[{**row, "rank": rank_words(row)} for row in ranked.table],
        ranking_words=[*verdict(c, ranked.key), *ranked.notes],
        heat=heat_map(f"{ranked.key} by scenario", heat) if len(ranked.scenarios) > 1 else None,
        causes=cause_rows([(name, one.errors[k]) for k, name in enumerate(c.runs) for one in found]),
        causes_about="What the repair of the errors of one kind and cause adds, mean over the sequences.",
        moments=moments(played, replayed),
        sequences=[
            (one.sequence, files[one.sequence], one.score)
            for one in sorted(played, key=lambda one: one.score) if one.sequence in files and not one.why
        ],
    )  # fmt: skip


def _played(ranked: RankedRuns) -> Iterator[Played]:
    c = ranked.comparison
    scenario = {k: name for name, places in ranked.scenarios.items() for k in places}
    for name in c.runs:
        oracles = [c.oracles[given] for given in c.inputs[name] if given in c.oracles] or list(c.oracles.values())
        for k, sequence in enumerate(c.sequences):
            score = float(c.scores[name][k][ranked.key])
            best = next((float(row[ranked.key]) for rows in oracles if (row := rows[k]) is not None), math.nan)
            why = "" if math.isfinite(score) else "not scored"
            yield Played(name, scenario[k], sequence, sequence, score, best, why)
