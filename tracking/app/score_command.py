"""`flockscope score`: tracks beside truth, one row for each sequence, and their mean with its interval."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from scenarios.errors import InputError
from sim.io.source import open_source
from sim.types import Sequence
from tracking.app.answer import Answer
from tracking.app.meter import Meter
from tracking.app.paired import pair, results
from tracking.app.score_tables import tables
from tracking.run import Run
from tracking.scoring import evaluate
from tracking.scoring.evaluation import IncomparableError, Scores, Similarity
from tracking.scoring.groups import GroupMatch
from tracking.stats import bootstrap


@dataclass(frozen=True)
class Row:
    """The scores of one sequence."""

    sequence: str
    scores: Scores


def score(
    truth: Path,
    tracks: Path,
    *,
    similarity: Similarity | None,
    group_match: GroupMatch,
    fps: float | None,
    px_per_m: float | None,
) -> Answer:
    """Scores of every sequence of `truth`, matched with `tracks` by name."""
    sequences = open_source(truth, fps=fps, px_per_m=px_per_m)
    paired = pair(sequences, results(tracks))
    rows = []
    with Meter("score", len(paired)) as meter:
        for sequence, result in paired:
            rows.append(score_run(sequence, result.read(sequence), similarity, group_match))
            meter.step(sequence.name)
    return answer(rows)


def score_run(
    sequence: Sequence, run: Run, similarity: Similarity | None = None, group_match: GroupMatch = "hull"
) -> Row:
    """The scores of one run; InputError where the sequence is not labelled or cannot be compared so."""
    if sequence.truth is None:
        raise InputError(
            file=sequence.source.get("path", sequence.name), got="no labels", expected="a sequence with truth",
            remedy="give one with gt/",
        )  # fmt: skip
    try:
        return Row(sequence.name, evaluate(sequence.truth, run, similarity=similarity, group_match=group_match))
    except IncomparableError as error:
        raise InputError(
            file=sequence.name, place="--similarity", got=str(error), expected="what both sides have",
            remedy="choose another --similarity",
        ) from None  # fmt: skip


def answer(rows: list[Row]) -> Answer:
    """Rows and their mean, for people and for --json."""
    means = summary(rows)
    data = {
        "sequences": [{"name": row.sequence, "similarity": row.scores.similarity, **row.scores} for row in rows],
        "mean": means,
    }
    return Answer(data, tables(rows, means))


def summary(rows: list[Row]) -> dict[str, dict[str, float]]:
    """mean, low, high over sequences by key; the ends are nan for a single one."""
    names = list(rows[0].scores)
    values = np.array([[row.scores.get(name, np.nan) for name in names] for row in rows], float)
    ends: Any = zip(names, *bootstrap(values), strict=True)
    return {name: {"mean": float(m), "low": float(low), "high": float(high)} for name, m, low, high in ends}
