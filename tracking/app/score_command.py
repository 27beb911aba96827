"""`flockscope score`: tracks beside truth, one row for each sequence, and their mean with its interval."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from scenarios.errors import InputError
from sim.io.source import open_source
from sim.types import Array, Sequence
from tracking.app.answer import Answer
from tracking.app.meter import Meter
from tracking.app.paired import pair, results
from tracking.app.score_tables import differences, tables
from tracking.run import Run
from tracking.scoring import evaluate
from tracking.scoring.catalogue import CATALOGUE
from tracking.scoring.evaluation import IncomparableError, Scores, Similarity
from tracking.scoring.groups import GroupMatch
from tracking.stats import bootstrap, paired


@dataclass(frozen=True)
class Row:
    """The scores of one sequence."""

    sequence: str
    scores: Scores


def score(
    truth: Path,
    tracks: Path,
    *,
    against: Path | None,
    similarity: Similarity | None,
    group_match: GroupMatch,
    fps: float | None,
    px_per_m: float | None,
) -> Answer:
    """Scores of every sequence of `truth`, matched with `tracks` by name; and how they differ from other tracks'."""
    sequences = open_source(truth, fps=fps, px_per_m=px_per_m)
    rows = _rows(sequences, tracks, similarity, group_match)
    if against is None:
        return answer(rows)
    return compared(answer(rows), rows, _rows(sequences, against, similarity, group_match))


def _rows(sequences: list[Sequence], tracks: Path, similarity: Similarity | None, group_match: GroupMatch) -> list[Row]:
    found = pair(sequences, results(tracks))
    rows = []
    with Meter("score", len(found)) as meter:
        for sequence, result in found:
            rows.append(score_run(sequence, result.read(sequence), similarity, group_match))
            meter.step(sequence.name)
    return rows


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
    return Answer({"sequences": [_row(row) for row in rows], "mean": means}, tables(rows, means))


def _row(row: Row) -> dict[str, Any]:
    s = row.scores
    chosen = {"similarity": s.similarity, "surface": s.surface, "group_match": s.group_match}
    return {"name": row.sequence, **chosen, **s}


def compared(found: Answer, rows: list[Row], others: list[Row]) -> Answer:
    """The answer of `rows`, and their scores minus those of `others` on the same sequences, in pairs."""
    from rich.console import Group

    ends = _by_key(paired(_values(others), _values(rows)))
    return Answer({**found.data, "difference": ends}, Group(found.text, "", differences(ends, len(rows))))


def summary(rows: list[Row]) -> dict[str, dict[str, float]]:
    """mean, low, high over sequences by key; the ends are nan for a single one."""
    return _by_key(bootstrap(_values(rows)))


def _values(rows: list[Row]) -> Array:
    return np.array([[row.scores[key] for key in CATALOGUE] for row in rows])


def _by_key(ends: tuple[Array, Array, Array]) -> dict[str, dict[str, float]]:
    columns = zip(CATALOGUE, *(end.tolist() for end in ends), strict=True)
    return {key: {"mean": mean, "low": low, "high": high} for key, mean, low, high in columns}
