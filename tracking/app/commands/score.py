"""`flockscope score`: compares tracks with the truth; scores of each sequence, and their mean with its interval."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from scenarios.errors import InputError
from sim.io.formats.box_columns import BoxScale, parse_box_scale
from sim.io.source import open_source
from sim.types import Array, Sequence
from tracking.app.command_options import ScoreOptions
from tracking.app.command_result import CommandResult
from tracking.app.commands.run_differences import Differences, differences_words, run_differences
from tracking.app.commands.score_ranking import is_class, ranking, sparse_notes, warn_misread
from tracking.app.commands.score_tables import Means, SequenceScores, detections_words, difference_table, tables
from tracking.app.progress import ProgressMeter
from tracking.app.stored_tracks import find_tracks, match_tracks
from tracking.comparison import scorer_of
from tracking.recording_intervals import recording_differences, recording_intervals
from tracking.run import TrackingRun
from tracking.run_info import input_summary
from tracking.scoring.catalogue import ALL, CATALOGUE
from tracking.scoring.frame_weights import weighted_scorers
from tracking.scoring.group_scores import GroupMatch
from tracking.scoring.people_comparison import Similarity
from tracking.stats import SURE, mean_interval, paired

INDICATIVE = f"intervals are indicative under {SURE:g} s: the recording lasts {{seconds:.4g}} s"
MOVED = "all tracks are compared {plane}"
SURFACE_WORDS = {"ground": "on the ground, boxes by their foot points", "image": "in the image, as some lie there"}


@dataclass(frozen=True)
class ComparisonMethod:
    """How tracks are compared with the truth.

    similarity: of people, "boxes" (overlap), "ground" or "image" (distance); None: by the data. group_match: of groups,
    by "hull" (overlap) or "members" (common people).
    """

    similarity: Similarity | None = None
    group_match: GroupMatch = "hull"


DEFAULT = ComparisonMethod()


def score(options: ScoreOptions) -> CommandResult:
    """Scores every sequence of the truth with its tracks; with --against also the differences, these minus the other
    tracks. Several tracks, or a tracker class, are ranked (`score_ranking.ranking`).

    The result's data: "sequences" (scores of each); "means" (of each set of equal detections: "given", "sequences",
    "mean"); "mean" (the only one of them, else None); "notes". With --against also "difference" by key, "against" (the
    others' detections) and "differences" (in what the runs differ).

    Raises InputError if a file is wrong, if a sequence has no tracks or no labels, if truth and tracks cannot be
    compared as asked, if two runs cannot be compared in one plane, or if --blocks is given for several sequences.
    """
    sequences = open_source(
        options.truth, fps=options.fps, px_per_m=options.px_per_m, images=False, person_class=options.person_class
    )
    if len(options.tracks) > 1 or is_class(options.tracks[0]):
        return ranking(options, sequences)
    method = ComparisonMethod(options.similarity, options.group_match)
    paths = [Path(options.tracks[0]), *([] if options.against is None else [options.against])]
    if options.blocks and len(sequences) > 1:
        raise InputError(
            place="--blocks", got=f"{len(sequences)} sequences", expected="a single recording",
            remedy="leave it out: the interval over sequences is shown anyway",
        )  # fmt: skip
    box_scale = None if options.box_scale is None else parse_box_scale(options.box_scale)
    scored = _score_all(sequences, paths, method, box_scale)
    rows, *others = ([each[k].row for each in scored] for k in range(len(paths)))
    notes = [
        *sparse_notes([row.scores for row in rows]),
        *dict.fromkeys(each[0].note for each in scored if each[0].note),
    ]
    if options.blocks:
        means, differences = _block_intervals(sequences[0], scored[0], method, options.blocks)
        result = _result([(rows, means)], [*notes, *_short_notes(sequences[0])])
    else:
        result = _result([(part, summary(part)) for part in _by_detections(rows)], notes)
        differences = None if not others else _paired_differences(rows, others[0])
    if differences is None:
        return result
    found = run_differences([(these.run.info, against.run.info) for these, against in scored])
    return _with_differences(result, differences, found, len(rows), _givens(others[0]))


@dataclass(frozen=True)
class ScoredRun:
    """A run of one sequence with its scores. run: the tracks as they were compared, and the content of run.json.
    note: what was done to compare them with another run, "" if nothing.
    """

    row: SequenceScores
    run: TrackingRun
    note: str = ""


def _score_all(
    sequences: list[Sequence], paths: list[Path], method: ComparisonMethod, box_scale: BoxScale | None
) -> list[list[ScoredRun]]:
    """Returns for each sequence, in order, its run at or below each of the one or two paths, scored.

    box_scale: factors of x and y of the boxes of texts among the tracks. Two runs of a sequence are compared with the
    truth in one plane and by one similarity. Warns about tracks that hardly match any label. Raises InputError if a
    sequence has no tracks or no labels, a file is wrong, or the tracks cannot be compared as asked. Shows progress on
    stderr.
    """
    matched = [match_tracks(sequences, find_tracks(path)) for path in paths]
    if box_scale is not None and all(stored.info for pairs in matched for _, stored in pairs):
        raise InputError(
            place="--box-scale", got="runs of `flockscope track`", expected="a text of another program",
            remedy="give --box-scale to `flockscope track`",
        )  # fmt: skip
    found = []
    with ProgressMeter("score", len(sequences)) as meter:
        for pairs in zip(*matched, strict=True):
            sequence = pairs[0][0]
            runs = [stored.read(sequence, box_scale) for _, stored in pairs]
            warn_misread(sequence, runs)
            found.append(_scored_alike(sequence, runs, method))
            meter.step(sequence.name)
    return found


def _scored_alike(sequence: Sequence, runs: list[TrackingRun], method: ComparisonMethod) -> list[ScoredRun]:
    """Returns the runs of a sequence with their scores, all compared in one plane and by one similarity."""
    rows = score_runs(sequence, runs, method)
    moved = {"ground" if run[0].plane != "image" else "image" for run in runs if len(run)} - {rows[0].scores.surface}
    note = MOVED.format(plane=SURFACE_WORDS[rows[0].scores.surface]) if moved else ""
    return [ScoredRun(row, run, note) for row, run in zip(rows, runs, strict=True)]


def _paired_differences(rows: list[SequenceScores], others: list[SequenceScores]) -> Means:
    """Returns by key the mean difference, rows minus others in pairs, with its interval and "pairs", their number."""
    first, second = _values(others), _values(rows)
    found = _by_key(paired(first, second))
    pairs = np.isfinite(second - first).sum(axis=0).tolist()
    return {key: {**d, "pairs": n} for (key, d), n in zip(found.items(), pairs, strict=True)}


def _block_intervals(
    sequence: Sequence, scored: list[ScoredRun], method: ComparisonMethod, draws: int
) -> tuple[Means, Means | None]:
    """Returns the scores of the first run by key, with 95 % intervals of a single recording, and the differences to the
    second run, if any, first minus second under equal weights.

    draws: number of draws of weights. AssertionError without truth.
    """
    truth = sequence.truth
    assert truth is not None
    scorers = weighted_scorers(truth, [each.run for each in scored], method.similarity, method.group_match)
    found = _by_key(recording_intervals(truth, scorers[0], draws))
    if len(scored) == 1:
        return found, None
    return found, _by_key(recording_differences(truth, scorers[0], scorers[1], draws))


def score_run(sequence: Sequence, run: TrackingRun, method: ComparisonMethod = DEFAULT) -> SequenceScores:
    """Returns the scores of one run, as `score_runs` does."""
    (row,) = score_runs(sequence, [run], method)
    return row


def score_runs(sequence: Sequence, runs: list[TrackingRun], method: ComparisonMethod = DEFAULT) -> list[SequenceScores]:
    """Returns the scores of runs of one sequence, compared alike, with the words of run.json on their detections.

    method: how people and groups are compared. Raises InputError if the sequence has no labels or cannot be compared in
    this way, or the scale in px per m is not above 0 where groups are derived in the image, or an id
    occurs twice in one frame.
    """
    with scorer_of(sequence) as scorer:
        scores = scorer.evaluate_all(runs, similarity=method.similarity, group_match=method.group_match)
    return [
        SequenceScores(sequence.name, found, input_summary(run.info)) for found, run in zip(scores, runs, strict=True)
    ]


def _short_notes(sequence: Sequence) -> list[str]:
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
    return {"name": row.sequence, **chosen, "frames_scored": s.frames, "label_step": s.step, **s}


def _with_differences(
    result: CommandResult, differences: Means, found: Differences, sequences: int, against: list[str]
) -> CommandResult:
    """Returns the result with differences to other tracks added, as a table and as "difference", "differences" and
    "against" of the data.

    differences: of scores by key, with interval. found: in what the runs differ; these lines come first. sequences:
    number of pairs. against: the detections that the other trackers got.
    """
    from rich.console import Group
    from rich.text import Text

    return CommandResult(
        {**result.data, "difference": differences, "differences": found, "against": against},
        Group(
            Text("\n".join(differences_words(found, sequences)) + "\n"), result.text, "",
            difference_table(differences, sequences), f"--against: detections {detections_words(against)}",
        ),
    )  # fmt: skip


def summary(rows: list[SequenceScores]) -> Means:
    """Returns the mean over sequences of each score by key, with its 95 % interval, within the score's range.

    rows: at least one. nan values are left out; the ends are nan for fewer than two numbers, the mean without any.
    """
    mean, low, high = mean_interval(_values(rows))
    least, most = (np.array([getattr(score, end) for score in ALL]) for end in ("low", "high"))
    return _by_key((mean, np.maximum(low, least), np.minimum(high, most)))


def _values(rows: list[SequenceScores]) -> Array:
    """Returns the scores as an array (sequences, K), columns in the catalogue's order, nan where unknown."""
    return np.array([[row.scores[key] for key in CATALOGUE] for row in rows])


def _by_key(ends: tuple[Array, Array, Array]) -> Means:
    """Returns, by key, "mean", "low" and "high" of the arrays (mean, low, high), each (K,) in the catalogue's order.

    Raises ValueError for another length.
    """
    columns = zip(CATALOGUE, *(end.tolist() for end in ends), strict=True)
    return {key: {"mean": mean, "low": low, "high": high} for key, mean, low, high in columns}
