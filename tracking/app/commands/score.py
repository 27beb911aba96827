"""`flockscope score`: compares tracks with the truth; scores of each sequence, and their mean with its interval."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from scenarios.errors import InputError
from sim.io.source import open_source
from sim.types import Array, Ints, Sequence
from tracking.app.command_options import ScoreOptions
from tracking.app.command_result import CommandResult
from tracking.app.commands.score_tables import Means, SequenceScores, detections_words, difference_table, tables
from tracking.app.progress import ProgressMeter
from tracking.app.stored_tracks import find_tracks, match_tracks
from tracking.run import TrackingRun
from tracking.run_info import input_summary
from tracking.scoring import evaluate
from tracking.scoring.block_resampling import resampled_scorer
from tracking.scoring.catalogue import CATALOGUE
from tracking.scoring.evaluation import IncomparableError, Similarity
from tracking.scoring.group_scores import GroupMatch
from tracking.stats import SURE, bootstrap, moving_blocks, paired

INDICATIVE = f"intervals are indicative under {SURE:g} s: the recording lasts {{seconds:.4g}} s"


@dataclass(frozen=True)
class ComparisonMethod:
    """How tracks are compared with the truth. similarity: of people; None: by what both sides have."""

    similarity: Similarity | None = None
    group_match: GroupMatch = "hull"


DEFAULT = ComparisonMethod()


def score(options: ScoreOptions) -> CommandResult:
    """Scores every sequence of the truth with its tracks; with --against also the differences to other tracks.

    Raises InputError if a sequence has no tracks or no labels, if truth and tracks cannot be compared as asked, or if
    --blocks is given for several sequences.
    """
    sequences = open_source(options.truth, fps=options.fps, px_per_m=options.px_per_m, images=False)
    method = ComparisonMethod(options.similarity, options.group_match)
    paths = [options.tracks] if options.against is None else [options.tracks, options.against]
    if options.blocks:
        return _score_in_blocks(sequences, paths, method, options.blocks)
    rows, *others = [_score_all(sequences, path, method) for path in paths]
    result = _result([(part, summary(part)) for part in _by_detections(rows)])
    if not others:
        return result
    differences = _by_key(paired(_values(others[0]), _values(rows)))
    return _with_differences(result, differences, len(rows), _givens(others[0]))


def _score_in_blocks(
    sequences: list[Sequence], paths: list[Path], method: ComparisonMethod, draws: int
) -> CommandResult:
    """Scores of a single recording, with intervals by moving blocks. paths: its tracks, and the other tracks if any."""
    if len(sequences) > 1:
        raise InputError(
            place="--blocks", got=f"{len(sequences)} sequences", expected="a single recording",
            remedy="leave it out: the interval over sequences is shown anyway",
        )  # fmt: skip
    (sequence,) = sequences
    rows, *others = [_score_all(sequences, path, method) for path in paths]
    scorers = [_resampled_scorer(sequence, path, method) for path in paths]
    result = _result([(rows, _block_intervals(sequence, draws, scorers[0], _values(rows)[0]))], _notes(sequence))
    if not others:
        return result
    difference = (_values(rows) - _values(others[0]))[0]
    ends = _block_intervals(sequence, draws, lambda frames: scorers[0](frames) - scorers[1](frames), difference)
    return _with_differences(result, ends, 1, _givens(others[0]))


def _resampled_scorer(sequence: Sequence, tracks: Path, method: ComparisonMethod) -> Callable[[Ints], Array]:
    """A function from frames (drawn with repetition) of the recording to its scores, in the catalogue's order."""
    ((_, stored),) = match_tracks([sequence], find_tracks(tracks))
    assert sequence.truth is not None
    return resampled_scorer(sequence.truth, stored.read(sequence), method.similarity, method.group_match)


def _block_intervals(sequence: Sequence, draws: int, resampled: Callable[[Ints], Array], values: Array) -> Means:
    """Values (K,) by key with intervals by moving blocks; nan ends for core and event scores, which need true time."""
    assert sequence.truth is not None
    with ProgressMeter("draw", draws + 1) as meter:

        def counted(frames: Ints) -> Array:
            meter.step("blocks of frames")
            return resampled(frames)

        _, low, high = moving_blocks(counted, sequence.truth.length, sequence.fps, draws)
    return _by_key((values, low, high))


def _score_all(sequences: list[Sequence], tracks: Path, method: ComparisonMethod) -> list[SequenceScores]:
    """The scores of every sequence with its tracks at or below the path `tracks`."""
    matched = match_tracks(sequences, find_tracks(tracks))
    rows = []
    with ProgressMeter("score", len(matched)) as meter:
        for sequence, stored in matched:
            rows.append(score_run(sequence, stored.read(sequence), method))
            meter.step(sequence.name)
    return rows


def score_run(sequence: Sequence, run: TrackingRun, method: ComparisonMethod = DEFAULT) -> SequenceScores:
    """The scores of one run. Raises InputError if the sequence has no labels or cannot be compared in this way."""
    if sequence.truth is None:
        raise InputError(
            file=sequence.source.get("path", sequence.name), got="no labels", expected="a sequence with truth",
            remedy="give one with gt/",
        )  # fmt: skip
    try:
        scores = evaluate(sequence.truth, run, similarity=method.similarity, group_match=method.group_match)
    except IncomparableError as error:
        raise InputError(
            file=sequence.name, place="--similarity", got=str(error), expected="what both sides have",
            remedy="choose another --similarity",
        ) from None  # fmt: skip
    return SequenceScores(sequence.name, scores, input_summary(run.info))


def _notes(sequence: Sequence) -> list[str]:
    """A note if the recording is too short for its intervals to be more than an indication."""
    assert sequence.truth is not None
    seconds = sequence.truth.length / sequence.fps
    return [INDICATIVE.format(seconds=seconds)] if seconds < SURE else []


def _by_detections(rows: list[SequenceScores]) -> list[list[SequenceScores]]:
    """The rows grouped by the detections that the tracker got; scores from different detections share no mean."""
    return [[row for row in rows if row.given == given] for given in _givens(rows)]


def _givens(rows: list[SequenceScores]) -> list[str]:
    """The different detections that trackers got, in order of first appearance."""
    return list(dict.fromkeys(row.given for row in rows))


def _result(parts: list[tuple[list[SequenceScores], Means]], notes: list[str] | None = None) -> CommandResult:
    """Tables and JSON data of all parts; each part holds rows from the same detections, and their means."""
    from rich.console import Group

    notes = notes or []
    total = sum(len(rows) for rows, _ in parts)
    texts = [tables(rows, means, notes, total) for rows, means in parts]
    data = {
        "sequences": [_row_data(row) for rows, _ in parts for row in rows],
        "mean": parts[0][1] if len(parts) == 1 else None,
        "means": [{"given": rows[0].given, "sequences": len(rows), "mean": means} for rows, means in parts],
        "notes": notes,
    }
    return CommandResult(data, Group(*texts))


def _row_data(row: SequenceScores) -> dict[str, Any]:
    s = row.scores
    chosen = {"similarity": s.similarity, "surface": s.surface, "group_match": s.group_match, "given": row.given}
    return {"name": row.sequence, **chosen, **s}


def _with_differences(result: CommandResult, differences: Means, sequences: int, against: list[str]) -> CommandResult:
    """The result with differences to other tracks added. against: the detections that the other trackers got."""
    from rich.console import Group

    return CommandResult(
        {**result.data, "difference": differences, "against": against},
        Group(
            result.text, "", difference_table(differences, sequences),
            f"--against: detections {detections_words(against)}",
        ),
    )  # fmt: skip


def summary(rows: list[SequenceScores]) -> Means:
    """Mean over sequences of each score, with its 95 % bootstrap interval; nan ends for a single sequence."""
    return _by_key(bootstrap(_values(rows)))


def _values(rows: list[SequenceScores]) -> Array:
    """(sequences, K) scores in the catalogue's order."""
    return np.array([[row.scores[key] for key in CATALOGUE] for row in rows])


def _by_key(ends: tuple[Array, Array, Array]) -> Means:
    """Means of (mean, low, high), each (K,) in the catalogue's order."""
    columns = zip(CATALOGUE, *(end.tolist() for end in ends), strict=True)
    return {key: {"mean": mean, "low": low, "high": high} for key, mean, low, high in columns}
