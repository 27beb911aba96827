"""The command `tune` with its options; what it does stands in tune_command."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

import typer

from tracking.app.command_result import CommandResult
from tracking.app.shared_options import Cluster, Detector, Json, Set, Workers


def tune(
    tracker: Annotated[str, typer.Argument(metavar="TRACKER", help="Its name, file.py:Class or module:Class.")],
    suite: Annotated[
        list[str], typer.Option("--suite", metavar="NAME", help="Suite, scenario or *.toml file; may be given often.")
    ],
    out: Annotated[Path, typer.Option("--out", metavar="FILE.toml", help="Parameters to write; the rest beside it.")],
    trials: Annotated[int, typer.Option("--trials", metavar="N", help="How many to finish, the defaults included.")],
    seeds: Annotated[str | None, typer.Option("--seeds", metavar="A:B", help="Training seeds, of 0:10000.")] = None,
    validation: Annotated[
        str | None, typer.Option("--validation", metavar="A:B", help="Seeds that choose, of 10000:20000.")
    ] = None,
    test: Annotated[str | None, typer.Option("--test", metavar="A:B", help="Seeds that judge, of 20000:30000.")] = None,
    check: Annotated[
        str | None, typer.Option("--check", metavar="SUITE", help="A suite not used, to judge on too; or none.")
    ] = None,
    objective: Annotated[
        list[str], typer.Option("--objective", metavar="KEY", help="A score, or frames/s; several: a Pareto front.")
    ] = [],  # noqa: B006
    detections: Annotated[Literal["image", "truth", "file"] | None, typer.Option(help="What it is given.")] = None,
    settings: Set = [],  # noqa: B006
    sensor: Detector = None,
    only: Annotated[str | None, typer.Option("--only", metavar="A,B,…", help="Parameters to search.")] = None,
    storage: Annotated[
        str | None, typer.Option("--storage", metavar="FILE|URL", help="Optuna's storage; a journal beside --out.")
    ] = None,
    study: Annotated[str | None, typer.Option("--study", metavar="NAME", help="Its name there; that of --out.")] = None,
    workers: Workers = 1,
    cluster: Cluster = None,
    prune: Annotated[float, typer.Option("--prune", metavar="P", help="Give up below this p; 0: never.")] = 0.1,
    finalists: Annotated[int, typer.Option("--finalists", metavar="N", help="How many are validated.")] = 5,
    seed: Annotated[int, typer.Option("--seed", help="The search's seed.")] = 0,
    json: Json = False,
) -> CommandResult:
    """Search a tracker's parameters on simulated scenes; judge them on others."""
    from tracking.app.commands import tune

    wishes = tune.Wishes(
        tracker, suite, trials, out, seeds, validation, test, check, objective, detections, settings, only, sensor,
    )  # fmt: skip
    return tune.tune(
        wishes, storage=storage, study=study, workers=workers, cluster=cluster, prune=prune, finalists=finalists,
        seed=seed,
    )  # fmt: skip
