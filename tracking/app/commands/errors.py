"""`flockscope errors`: each error of a run with its frames, people, cause and cost, and a sum by cause."""

from __future__ import annotations

from typing import Any

from sim.io.formats.options import BoxScale
from sim.types import Sequence
from tracking.app.command_options import ErrorsOptions
from tracking.app.command_result import CommandResult
from tracking.app.commands.score_tables import figure, table
from tracking.app.commands.scored_sequence import box_scale_of
from tracking.app.sequence_workers import over_sequences, source_of
from tracking.app.stored_tracks import StoredTracks, find_tracks, match_tracks
from tracking.errors.found import RunErrors, errors_of_run, sums_by_cause
from tracking.errors.repairs import SHOWN
from tracking.scoring.people_comparison import Similarity
from tracking.stats import mean_of_known

Job = tuple[StoredTracks, Similarity | None, BoxScale | None]


def errors(options: ErrorsOptions) -> CommandResult:
    """Lists the errors of the stored tracks on every sequence of the truth, with causes and costs."""
    source = source_of(options, options.truth, without="box_scale")
    sequences = source.open()
    stored = [tracks for _, tracks in match_tracks(sequences, find_tracks(options.tracks))]
    box_scale = box_scale_of(options.box_scale, stored)
    jobs: list[Job] = [(one, options.similarity, box_scale) for one in stored]
    found = list(over_sequences("errors", errors_of, sequences, jobs, source, options.workers))
    every = [
        {
            "name": sequence.name, "scores": one.scores, "left": one.left,
            "errors": [error.facts(sequence.fps) for error in one.errors],
        }
        for sequence, one in zip(sequences, found, strict=True)
    ]  # fmt: skip
    causes = [
        {"kind": row.kind, "cause": row.cause, "errors": row.errors, "seconds": row.seconds, **row.gains}
        for row in sums_by_cause(found)
    ]
    return CommandResult({"sequences": every, "causes": causes}, _tables(found, every, causes, options.limit))


def errors_of(sequence: Sequence, job: Job) -> RunErrors:
    """Returns the errors of one stored run of the sequence; job: the stored tracks, the similarity, the box scale."""
    stored, similarity, box_scale = job
    return errors_of_run(sequence, stored.read(sequence, box_scale), similarity)


def _tables(found: list[RunErrors], sequences: list[dict[str, Any]], causes: list[dict[str, Any]], limit: int) -> str:
    left = {key: mean_of_known(run.left[key] for run in found) for key in SHOWN}
    every = [*causes, {"kind": "position", "cause": "", "errors": "", "seconds": None, **left}]
    lost = [
        [row["kind"], row["cause"], str(row["errors"]), figure(row["seconds"], ".1f", ""),
         *(figure(row[key], "+.3f") for key in SHOWN)]
        for row in every
    ]  # fmt: skip
    now = "  ".join(f"{key} {figure(mean_of_known(run.scores[key] for run in found), '.3f')}" for key in SHOWN)
    errors = [(sequence["name"], error) for sequence in sequences for error in sequence["errors"]]
    dearest = sorted(errors, key=lambda item: -(item[1]["cost"] or 0.0))[:limit]
    listed = [
        [name, f"{e['start']}–{e['end']}", e["kind"], e["who"], e["detail"] or e["cause"], figure(e["cost"], ".4f")]
        for name, e in dearest
    ]
    title = f"the {len(dearest)} dearest of {len(errors)} errors; cost: HOTA, of groups group_F1"
    costs = table(f"where the score is lost; now {now}", ["kind", "cause"], ["errors", "seconds", *SHOWN], lost)
    return costs + "\n" + table(title, ["sequence", "frames", "kind", "who", "cause"], ["cost"], listed)
