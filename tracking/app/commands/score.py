"""`flockscope score`: compares tracks with the truth; scores of each sequence, and their mean with its interval."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from scenarios.errors import InputError
from sim.io.formats.options import BoxScale, parse_box_scale, refuse_options
from sim.io.store.seal import tracked_hash
from sim.types import Sequence
from tracking.app.command_options import ScoreOptions
from tracking.app.command_result import CommandResult
from tracking.app.commands.score_ranking import is_class, ranking, short_notes, sparse_notes
from tracking.app.commands.score_tables import Means, SequenceScores, tables
from tracking.app.commands.scored_sequence import ScoredSequence, ScoringJob, score_sequence
from tracking.app.sequence_workers import OpenedAs, results_over_sequences
from tracking.app.stored_tracks import StoredTracks, find_tracks, match_tracks
from tracking.comparison import check_blocks
from tracking.scoring.catalogue import ALL, CATALOGUE
from tracking.stats import mean_interval


def score(options: ScoreOptions) -> CommandResult:
    """Scores every sequence of the truth with its tracks."""
    source = OpenedAs(
        options.truth, options.fps, options.px_per_m, images=False, person_class=options.person_class
    )  # fmt: skip
    sequences = source.open()
    check_blocks(options.blocks, len(sequences))
    if len(options.tracks) > 1 or is_class(options.tracks[0]):
        return ranking(options, source, sequences)
    refuse_options(vars(options), "by csv all", Path(options.tracks[0]), "one run", "only several are ranked")
    scored = _score_all(options, source, sequences)
    rows = [
        SequenceScores(sequence.name, one.scores[0], one.given[0])
        for sequence, one in zip(sequences, scored, strict=True)
    ]
    notes = [*sparse_notes([row.scores for row in rows]), *dict.fromkeys(one.note for one in scored if one.note)]
    hashes = {sequence.name: tracked_hash(sequence) for sequence in sequences}
    if options.blocks:
        notes += short_notes(sequences[0], rows[0].scores)
        return _result([(rows, _block_means(scored[0]))], hashes, notes)
    parts = [[row for row in rows if row.given == given] for given in dict.fromkeys(row.given for row in rows)]
    return _result([(part, summary(part)) for part in parts], hashes, notes)


def _score_all(options: ScoreOptions, source: OpenedAs, sequences: list[Sequence]) -> list[ScoredSequence]:
    found, box_scale = matched_tracks(sequences, Path(options.tracks[0]), options.box_scale)
    how = (options.similarity, options.group_match, options.blocks)
    jobs = [ScoringJob((stored,), *how, box_scale=box_scale) for stored in found]
    return results_over_sequences("score", score_sequence, sequences, jobs, source, options.workers)


def matched_tracks(
    sequences: list[Sequence], tracks: Path, box_scale: str | None
) -> tuple[list[StoredTracks], BoxScale | None]:
    """Returns the stored tracks of each sequence, and the factors of --box-scale, which is for texts only."""
    matched = match_tracks(sequences, find_tracks(tracks))
    scale = None if box_scale is None else parse_box_scale(box_scale)
    if scale is not None and all(stored.info for _, stored in matched):
        raise InputError(
            place="--box-scale", got="runs of `flockscope track`", expected="a text of another program",
            remedy="give --box-scale to `flockscope track`",
        )  # fmt: skip
    return [stored for _, stored in matched], scale


def _block_means(scored: ScoredSequence) -> Means:
    assert scored.compared.blocks is not None
    return {
        key: {"mean": float(r.mean[0]), "low": float(r.low[0]), "high": float(r.high[0])}
        for key, r in scored.compared.blocks.items()
    }


def _result(
    parts: list[tuple[list[SequenceScores], Means]], hashes: Mapping[str, str | None], notes: list[str]
) -> CommandResult:
    from rich.console import Group

    total = sum(len(rows) for rows, _ in parts)
    texts = [tables(rows, means, notes, total) for rows, means in parts]
    data = {
        "sequences": [{**_row_data(row), "truth": hashes[row.sequence]} for rows, _ in parts for row in rows],
        "mean": parts[0][1] if len(parts) == 1 else None,
        "means": [{"given": rows[0].given, "sequences": len(rows), "mean": means} for rows, means in parts],
        "notes": notes,
    }
    return CommandResult(data, Group(*texts))


def _row_data(row: SequenceScores) -> dict[str, Any]:
    s = row.scores
    chosen = {"similarity": s.similarity, "surface": s.surface, "group_match": s.group_match, "given": row.given}
    return {"name": row.sequence, **chosen, "frames_scored": s.frames, "label_step": s.step, **s}


def summary(rows: list[SequenceScores]) -> Means:
    """Returns the mean over sequences of each score by key, with its 95 % interval, within the score's range."""
    mean, low, high = mean_interval(np.array([[row.scores[key] for key in CATALOGUE] for row in rows]))
    least, most = (np.array([getattr(score, end) for score in ALL]) for end in ("low", "high"))
    ends = (end.tolist() for end in (mean, np.maximum(low, least), np.minimum(high, most)))
    return {key: {"mean": m, "low": a, "high": b} for key, m, a, b in zip(CATALOGUE, *ends, strict=True)}
