"""The options of the commands `fit …`, as in `command_options`."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import typer

from tracking.app.shared_options import Fps


@dataclass(frozen=True, kw_only=True)
class FitSensorOptions:
    """Options of the command `fit sensor`, which measures a detector's errors.

    sources: recordings with true boxes and detections, pooled. out: the TOML file to write. fps: frames per second;
    None: the recordings' own.
    """

    sources: Annotated[list[Path], typer.Argument(metavar="SOURCE…", help="Recordings with gt and det, pooled.")]
    out: Annotated[Path, typer.Option("--out", metavar="FILE.toml", help="File to write: a [sensor] table.")]
    fps: Fps = None


@dataclass(frozen=True, kw_only=True)
class FitRelationalOptions:
    """Options of the command `fit relational`, which learns the motion of people and of pairs from simulated truth.

    names: scenarios, *.toml files or suites. seeds: "A:B" (A to B - 1) or one number. out: the TOML file to write.
    """

    names: Annotated[list[str], typer.Argument(metavar="NAME…", help="Scenarios, *.toml files or suites.")]
    out: Annotated[
        Path, typer.Option("--out", metavar="FILE.toml", help="File to write: parameters of relational, for --params.")
    ]
    seeds: Annotated[str, typer.Option("--seeds", metavar="A:B", help="Seeds from A to B - 1, or one seed.")] = (
        "30000:30004"
    )


@dataclass(frozen=True, kw_only=True)
class FitJointOptions:
    """Options of the command `fit joint`, which learns the event classifier of `joint` from simulated truth.

    names: scenarios, *.toml files or suites. seeds: those fitted to; check: others that the fit is scored with, None:
    none; each "A:B" (A to B - 1) or one number. out: the TOML file to write.
    """

    names: Annotated[list[str], typer.Argument(metavar="NAME…", help="Scenarios, *.toml files or suites.")]
    out: Annotated[
        Path, typer.Option("--out", metavar="FILE.toml", help="File to write: parameters of joint, for --params.")
    ]
    seeds: Annotated[str, typer.Option("--seeds", metavar="A:B", help="Seeds of the scenes to fit to.")] = "30000:30002"
    check: Annotated[str | None, typer.Option("--check", metavar="A:B", help="Other seeds, to score the fit with.")] = (
        None
    )


@dataclass(frozen=True, kw_only=True)
class FitGroupingOptions:
    """Options of the command `fit grouping`, which fits the belief of who belongs together to simulated scenes.

    names: scenarios, *.toml files or suites. seeds: those fitted to; check: others that the fit is scored with, None:
    none; each "A:B" (A to B - 1) or one number. out: the TOML file to write.
    """

    names: Annotated[list[str], typer.Argument(metavar="NAME…", help="Scenarios, *.toml files or suites.")]
    out: Annotated[Path, typer.Option("--out", metavar="FILE.toml", help="File to write, for --grouping.")]
    seeds: Annotated[str, typer.Option("--seeds", metavar="A:B", help="Seeds of the scenes to fit to.")] = "30000:30002"
    check: Annotated[str | None, typer.Option("--check", metavar="A:B", help="Other seeds, to score the fit with.")] = (
        None
    )
