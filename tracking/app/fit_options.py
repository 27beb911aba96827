"""The options of the commands `fit …`, as in `command_options`."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

import typer

from tracking.app.shared_options import Fps


@dataclass(frozen=True, kw_only=True)
class FitSensorOptions:
    """Options of `fit sensor`."""

    sources: Annotated[list[Path], typer.Argument(metavar="SOURCE…", help="Recordings with gt and det, pooled.")]
    out: Annotated[Path, typer.Option("--out", metavar="FILE.toml", help="File to write: a [sensor] table.")]
    fps: Fps = None


@dataclass(frozen=True, kw_only=True)
class FitRelationalOptions:
    """Options of `fit relational`."""

    names: Annotated[list[str], typer.Argument(metavar="NAME…", help="Scenarios, *.toml files or suites.")]
    out: Annotated[
        Path, typer.Option("--out", metavar="FILE.toml", help="File to write: parameters of relational, for --params.")
    ]
    seeds: Annotated[str, typer.Option("--seeds", metavar="A:B", help="Seeds from A to B - 1, or one seed.")] = (
        "30000:30004"
    )


@dataclass(frozen=True, kw_only=True)
class FitJointOptions:
    """Options of `fit joint`."""

    names: Annotated[list[str], typer.Argument(metavar="NAME…", help="Scenarios, *.toml files or suites.")]
    out: Annotated[
        Path, typer.Option("--out", metavar="FILE.toml", help="File to write: parameters of joint, for --params.")
    ]
    learn: Annotated[
        Literal["events", "components"],
        typer.Option(help="events: the classifier of merges and splits; components: the Dirichlet process mixture."),
    ] = "events"
    seeds: Annotated[str, typer.Option("--seeds", metavar="A:B", help="Seeds of the scenes to fit to.")] = "30000:30002"
    check: Annotated[str | None, typer.Option("--check", metavar="A:B", help="Other seeds, to score the fit with.")] = (
        None
    )


@dataclass(frozen=True, kw_only=True)
class FitGroupingOptions:
    """Options of `fit grouping`."""

    names: Annotated[list[str], typer.Argument(metavar="NAME…", help="Scenarios, *.toml files or suites.")]
    out: Annotated[Path, typer.Option("--out", metavar="FILE.toml", help="File to write, for --grouping.")]
    seeds: Annotated[str, typer.Option("--seeds", metavar="A:B", help="Seeds of the scenes to fit to.")] = "30000:30002"
    check: Annotated[str | None, typer.Option("--check", metavar="A:B", help="Other seeds, to score the fit with.")] = (
        None
    )
