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
    """How tracks are compared with the truth.

    similarity: of people, "boxes" (overlap), "ground" or "image" (distance); None: boxes if both sides have them, else
    the plane of the tracks. group_match: of groups, by "hull" (overlap) or "members" (common people).
    """

    similarity: Similarity | None = None
    group_match: GroupMatch = "hull"


DEFAULT = ComparisonMethod()


def score(options: ScoreOptions) -> CommandResult:
    """Scores every sequence of the truth with its tracks; with --against also the differences, these minus the other
    tracks.

    The result's data: "sequences" (scores of each); "means" (of each set of equal detections: "given", "sequences",
    "mean"); "mean" (the only one of them, else None); "notes". With --against also "difference" by key and "against"
    (the others' detections).

    Raises InputError if a file is wrong, if a sequence has no tracks or no labels, if truth and tracks cannot be
    compared as asked, or if --blocks is given for several sequences.
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
    """Returns the scores of a single recording, with 95 % intervals by moving blocks of frames, drawn `draws` times.

    paths: its tracks, and the other tracks if any; then the differences, first minus second in the same frames, are
    added. Raises InputError for several sequences, missing labels or tracks, or tracks that cannot be compared as
    asked.
    """
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
    """Returns a function from frame indices (N,), from 0 and drawn with repetition, to the recording's scores (K,).

    The K scores are in the catalogue's order, nan where unknown. tracks: path of the stored tracks. Raises InputError
    if there are none or a file is wrong, AssertionError without truth.
    """
    ((_, stored),) = match_tracks([sequence], find_tracks(tracks))
    assert sequence.truth is not None
    return resampled_scorer(sequence.truth, stored.read(sequence), method.similarity, method.group_match)


def _block_intervals(sequence: Sequence, draws: int, resampled: Callable[[Ints], Array], values: Array) -> Means:
    """Returns values (K,) by key, as "mean", with the ends of their 95 % intervals by moving blocks of frames.

    The ends are nan for core and event scores, which need true time. draws: number of samples. resampled: a function
    from frame indices (N,), from 0, to scores (K,). values, scores: in the catalogue's order. Shows progress on stderr.
    AssertionError without truth.
    """
    assert sequence.truth is not None
    with ProgressMeter("draw", draws + 1) as meter:

        def counted(frames: Ints) -> Array:
            meter.step("blocks of frames")
            return resampled(frames)

        _, low, high = moving_blocks(counted, sequence.truth.length, sequence.fps, draws)
    return _by_key((values, low, high))


def _score_all(sequences: list[Sequence], tracks: Path, method: ComparisonMethod) -> list[SequenceScores]:
    """Returns the scores of every sequence, in order, with its stored tracks at or below the path `tracks`.

    Raises InputError if a sequence has no tracks or no labels, a file is wrong, or the two cannot be compared as asked.
    Shows progress on stderr.
    """
    matched = match_tracks(sequences, find_tracks(tracks))
    rows = []
    with ProgressMeter("score", len(matched)) as meter:
        for sequence, stored in matched:
            rows.append(score_run(sequence, stored.read(sequence), method))
            meter.step(sequence.name)
    return rows


def score_run(sequence: Sequence, run: TrackingRun, method: ComparisonMethod = DEFAULT) -> SequenceScores:
    """Returns the scores of one run: a tracker's tracks of one sequence, with the words of run.json on its detections.

    method: how people and groups are compared. Raises InputError if the sequence has no labels or cannot be compared in
    this way, or the scale in px per m is not above 0 where groups are derived in the image. Raises ValueError if an id
    occurs twice in one frame.
    """
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
    """Returns a list with one note if the recording lasts less than 60 s, so that its intervals are only indicative;
    else [].

    AssertionError without truth.
    """
    assert sequence.truth is not None
    seconds = sequence.truth.length / sequence.fps
    return [INDICATIVE.format(seconds=seconds)] if seconds < SURE else []


def _by_detections(rows: list[SequenceScores]) -> list[list[SequenceScores]]:
    """Returns the rows, each the scores of one sequence, in lists of equal detections given to the tracker.

    Lists are in order of first appearance. Scores from different detections share no mean.
    """
    return [[row for row in rows if row.given == given] for given in _givens(rows)]


def _givens(rows: list[SequenceScores]) -> list[str]:
    """Returns the different texts on the detections that trackers got, in order of first appearance; "" if unknown."""
    return list(dict.fromkeys(row.given for row in rows))


def _result(parts: list[tuple[list[SequenceScores], Means]], notes: list[str] | None = None) -> CommandResult:
    """Returns tables and JSON data of all parts, each a pair (rows, means) of the same detections.

    Rows are scores of one sequence each; means are by key. notes: lines below each table; None: none. Data:
    "sequences", "mean" (None if there are several parts), "means" (of each part: "given", "sequences", "mean"),
    "notes".
    """
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
    """Returns the result with differences to other tracks added, as a table and as "difference" and "against" of the
    data.

    differences: by key, with interval. sequences: number of pairs. against: the detections that the other trackers got.
    """
    from rich.console import Group

    return CommandResult(
        {**result.data, "difference": differences, "against": against},
        Group(
            result.text, "", difference_table(differences, sequences),
            f"--against: detections {detections_words(against)}",
        ),
    )  # fmt: skip


def summary(rows: list[SequenceScores]) -> Means:
    """Returns the mean over sequences of each score by key, with its 95 % bootstrap interval.

    rows: at least one. nan values are left out; the ends are nan for fewer than two numbers, the mean without any.
    """
    return _by_key(bootstrap(_values(rows)))


def _values(rows: list[SequenceScores]) -> Array:
    """Returns the scores as an array (sequences, K), columns in the catalogue's order, nan where unknown."""
    return np.array([[row.scores[key] for key in CATALOGUE] for row in rows])


def _by_key(ends: tuple[Array, Array, Array]) -> Means:
    """Returns, by key, "mean", "low" and "high" of the arrays (mean, low, high), each (K,) in the catalogue's order.

    Raises ValueError for another length.
    """
    columns = zip(CATALOGUE, *(end.tolist() for end in ends), strict=True)
    return {key: {"mean": mean, "low": low, "high": high} for key, mean, low, high in columns}
