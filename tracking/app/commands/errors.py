"""`flockscope errors`: each error of a run with its frames, people, cause and cost, and a sum by cause."""

from __future__ import annotations

from typing import Any

from scenarios.errors import printable
from sim.io.formats.options import BoxScale
from sim.types import Sequence
from tracking.app.command_options import ErrorsOptions
from tracking.app.command_result import CommandResult
from tracking.app.commands.score import matched_tracks
from tracking.app.commands.score_tables import new_table, with_title
from tracking.app.sequence_workers import OpenedAs, results_over_sequences
from tracking.app.stored_tracks import StoredTracks
from tracking.errors.found import CauseRow, RunErrors, errors_of_run, sums_by_cause
from tracking.errors.repairs import SHOWN
from tracking.scoring.people_comparison import Similarity
from tracking.stats import mean_of_known

Job = tuple[StoredTracks, Similarity | None, BoxScale | None]


def errors(options: ErrorsOptions) -> CommandResult:
    """Lists the errors of every sequence of the truth."""
    source = OpenedAs(
        options.truth, options.fps, options.px_per_m, images=False, person_class=options.person_class
    )  # fmt: skip
    sequences = source.open()
    stored, box_scale = matched_tracks(sequences, options.tracks, options.box_scale)
    jobs: list[Job] = [(one, options.similarity, box_scale) for one in stored]
    found = results_over_sequences("errors", errors_of, sequences, jobs, source, options.workers)
    names = [sequence.name for sequence in sequences]
    fps = [sequence.fps for sequence in sequences]
    causes = sums_by_cause(found)
    data = {
        "sequences": [
            {
                "name": name,
                "scores": one.scores,
                "left": one.left,
                "errors": [error.facts(rate) for error in one.errors],
            }
            for name, rate, one in zip(names, fps, found, strict=True)
        ],
        "causes": [
            {"kind": row.kind, "cause": row.cause, "errors": row.errors, "seconds": row.seconds, **row.gains}
            for row in causes
        ],
    }  # fmt: skip
    return CommandResult(data, _tables(names, fps, found, causes, options.limit))


def errors_of(sequence: Sequence, job: Job) -> RunErrors:
    """Returns the errors of one stored run."""
    stored, similarity, box_scale = job
    return errors_of_run(sequence, stored.read(sequence, box_scale), similarity)


def _tables(names: list[str], fps: list[float], found: list[RunErrors], causes: list[CauseRow], limit: int) -> Any:
    from rich.console import Group

    lost = new_table(["kind", "cause"], ["errors", "seconds", *SHOWN])
    for row in causes:
        gains = (_number(row.gains[k], "+.3f") for k in SHOWN)
        lost.add_row(row.kind, row.cause, str(row.errors), f"{row.seconds:.1f}", *gains)
    left = {k: mean_of_known(run.left[k] for run in found) for k in SHOWN}
    lost.add_row("position", "", "", "", *(_number(left[k], "+.3f") for k in SHOWN))
    now = "  ".join(f"{k} {_number(mean_of_known(run.scores[k] for run in found), '.3f')}" for k in SHOWN)
    every = [(name, rate, error) for name, rate, run in zip(names, fps, found, strict=True) for error in run.errors]
    dearest = sorted(every, key=lambda item: -(item[2].cost or 0.0))[:limit]
    listed = new_table(["sequence", "frames", "kind", "who", "cause"], ["cost"])
    for name, rate, error in dearest:
        facts = error.facts(rate)
        span = f"{facts['start']}–{facts['end']}"
        listed.add_row(
            printable(name),
            span,
            facts["kind"],
            error.who,
            facts["detail"] or facts["cause"],
            _number(error.cost, ".4f"),
        )
    title = f"the {len(dearest)} dearest of {len(every)} errors; cost: HOTA, of groups group_F1"
    return Group(with_title(f"where the score is lost; now {now}", lost), with_title(title, listed))


def _number(value: float | None, form: str) -> str:
    return "–" if value is None or value != value else format(value, form)
