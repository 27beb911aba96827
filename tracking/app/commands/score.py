"""`flockscope score`: tracks beside truth, one row for each sequence, and their mean with its interval."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from scenarios.errors import InputError
from sim.io.source import open_source
from sim.types import Array, Ints, Sequence
from tracking.app.command_result import CommandResult
from tracking.app.commands.score_tables import Means, differences, said, tables
from tracking.app.progress import ProgressMeter
from tracking.app.stored_tracks import pair, results
from tracking.run import TrackingRun
from tracking.run_info import input_summary
from tracking.scoring import evaluate
from tracking.scoring.block_resampling import scorer
from tracking.scoring.catalogue import CATALOGUE
from tracking.scoring.evaluation import IncomparableError, Scores, Similarity
from tracking.scoring.groups import GroupMatch
from tracking.stats import SURE, bootstrap, moving_blocks, paired

INDICATIVE = f"intervals are indicative under {SURE:g} s: the recording lasts {{seconds:.4g}} s"


@dataclass(frozen=True)
class Row:
    """The scores of one sequence. given: what the tracker saw, in words, "" where nothing says it."""

    sequence: str
    scores: Scores
    given: str = ""


def score(
    truth: Path,
    tracks: Path,
    *,
    against: Path | None,
    blocks: int,
    similarity: Similarity | None,
    group_match: GroupMatch,
    fps: float | None,
    px_per_m: float | None,
) -> CommandResult:
    """Scores of every sequence of `truth`, matched with `tracks` by name; and how they differ from other tracks'.

    blocks: draws for the interval of a single recording, 0 for none.
    """
    sequences = open_source(truth, fps=fps, px_per_m=px_per_m, images=False)
    if blocks and len(sequences) > 1:
        raise InputError(
            place="--blocks", got=f"{len(sequences)} sequences", expected="a single recording",
            remedy="leave it out: the interval over sequences is shown anyway",
        )  # fmt: skip
    paths = [tracks] if against is None else [tracks, against]
    rows, *others = [_rows(sequences, path, similarity, group_match) for path in paths]
    draws = [_draw(sequences, path, similarity, group_match) for path in paths] if blocks else []
    found = (
        answer([(rows, _recording(sequences[0], blocks, draws[0], _values(rows)[0]))], notes(sequences[0]))
        if blocks
        else answer([(part, summary(part)) for part in alike(rows)])
    )
    if not others:
        return found
    if not blocks:
        return compared(found, _by_key(paired(_values(others[0]), _values(rows))), len(rows), _givens(others[0]))
    difference = (_values(rows) - _values(others[0]))[0]
    ends = _recording(sequences[0], blocks, lambda at: draws[0](at) - draws[1](at), difference)
    return compared(found, ends, 1, _givens(others[0]))


def _draw(
    sequences: list[Sequence], tracks: Path, similarity: Similarity | None, group_match: GroupMatch
) -> Callable[[Ints], Array]:
    """Scores of a single recording made of some of its frames."""
    ((sequence, result),) = pair(sequences, results(tracks))
    assert sequence.truth is not None
    return scorer(sequence.truth, result.read(sequence), similarity, group_match)


def _recording(sequence: Sequence, draws: int, draw: Callable[[Ints], Array], values: Array) -> Means:
    """One recording's values by key, with intervals by moving blocks for those that do not need time as it was."""
    assert sequence.truth is not None
    with ProgressMeter("draw", draws + 1) as meter:

        def drawn(places: Ints) -> Array:
            meter.step("blocks of frames")
            return draw(places)

        _, low, high = moving_blocks(drawn, sequence.truth.length, sequence.fps, draws)
    return _by_key((values, low, high))


def _rows(sequences: list[Sequence], tracks: Path, similarity: Similarity | None, group_match: GroupMatch) -> list[Row]:
    found = pair(sequences, results(tracks))
    rows = []
    with ProgressMeter("score", len(found)) as meter:
        for sequence, result in found:
            rows.append(score_run(sequence, result.read(sequence), similarity, group_match))
            meter.step(sequence.name)
    return rows


def score_run(
    sequence: Sequence, run: TrackingRun, similarity: Similarity | None = None, group_match: GroupMatch = "hull"
) -> Row:
    """The scores of one run; InputError where the sequence is not labelled or cannot be compared so."""
    if sequence.truth is None:
        raise InputError(
            file=sequence.source.get("path", sequence.name), got="no labels", expected="a sequence with truth",
            remedy="give one with gt/",
        )  # fmt: skip
    try:
        found = evaluate(sequence.truth, run, similarity=similarity, group_match=group_match)
    except IncomparableError as error:
        raise InputError(
            file=sequence.name, place="--similarity", got=str(error), expected="what both sides have",
            remedy="choose another --similarity",
        ) from None  # fmt: skip
    return Row(sequence.name, found, input_summary(run.info))


def notes(sequence: Sequence) -> list[str]:
    """What to know of the intervals of a single recording."""
    assert sequence.truth is not None
    seconds = sequence.truth.length / sequence.fps
    return [INDICATIVE.format(seconds=seconds)] if seconds < SURE else []


def alike(rows: list[Row]) -> list[list[Row]]:
    """The rows by what their tracker saw: figures from pixels, from boxes, from look-ahead share no mean."""
    return [[row for row in rows if row.given == given] for given in _givens(rows)]


def _givens(rows: list[Row]) -> list[str]:
    return list(dict.fromkeys(row.given for row in rows))


def answer(parts: list[tuple[list[Row], Means]], notes: list[str] | None = None) -> CommandResult:
    """Rows that belong together, their means, and notes on them, for people and for --json."""
    from rich.console import Group

    notes = notes or []
    total = sum(len(rows) for rows, _ in parts)
    texts = [tables(rows, means, notes, total) for rows, means in parts]
    data = {
        "sequences": [_row(row) for rows, _ in parts for row in rows],
        "mean": parts[0][1] if len(parts) == 1 else None,
        "means": [{"given": rows[0].given, "sequences": len(rows), "mean": means} for rows, means in parts],
        "notes": notes,
    }
    return CommandResult(data, Group(*texts))


def _row(row: Row) -> dict[str, Any]:
    s = row.scores
    chosen = {"similarity": s.similarity, "surface": s.surface, "group_match": s.group_match, "given": row.given}
    return {"name": row.sequence, **chosen, **s}


def compared(found: CommandResult, ends: Means, sequences: int, against: list[str]) -> CommandResult:
    """The answer, and by how much it differs from other tracks on the same sequences, in pairs.

    against: what the other tracks' trackers saw.
    """
    from rich.console import Group

    return CommandResult(
        {**found.data, "difference": ends, "against": against},
        Group(found.text, "", differences(ends, sequences), f"--against: detections {said(against)}"),
    )


def summary(rows: list[Row]) -> Means:
    """mean, low, high over sequences by key; the ends are nan for a single one."""
    return _by_key(bootstrap(_values(rows)))


def _values(rows: list[Row]) -> Array:
    return np.array([[row.scores[key] for key in CATALOGUE] for row in rows])


def _by_key(ends: tuple[Array, Array, Array]) -> Means:
    columns = zip(CATALOGUE, *(end.tolist() for end in ends), strict=True)
    return {key: {"mean": mean, "low": low, "high": high} for key, mean, low, high in columns}
