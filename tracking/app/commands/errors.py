"""`flockscope errors`: each error of a run with its frames, people, cause and cost, and a sum by cause."""

from __future__ import annotations

from typing import Any

from sim.types import Sequence
from tracking.app.command_options import ErrorsOptions
from tracking.app.command_result import CommandResult
from tracking.app.score_tables import figure, table
from tracking.app.scored_sequence import ScoringJob, read_runs, scoring_jobs
from tracking.app.sequence_workers import over_sequences, source_of
from tracking.errors.found import RunErrors, errors_of_run, sums_by_cause
from tracking.errors.repairs import SHOWN
from tracking.stats import mean_of_known


def errors(options: ErrorsOptions) -> CommandResult:
    """Lists the errors of a run on every sequence of the truth, with causes and costs."""
    source = source_of(options, options.truth, without="box_scale")
    sequences = source.open()
    jobs = scoring_jobs([options.tracks], sequences, options.box_scale, similarity=options.similarity)
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


def errors_of(sequence: Sequence, job: ScoringJob) -> RunErrors:
    """Returns the errors of the only run of a job on the sequence."""
    (run,) = read_runs(sequence, job)
    return errors_of_run(sequence, run, job.similarity)


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
