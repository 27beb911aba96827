"""The command `flockscope`: declares every command. The work of each is in the module of `commands/` that it calls."""

from __future__ import annotations

import io
import os
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import typer

from tracking.app.command_options import (
    CocoOptions,
    FitGroupingOptions,
    FitJointOptions,
    FitRelationalOptions,
    FitSensorOptions,
    GenerateOptions,
    GroupOptions,
    Json,
    Out,
    OverlayOptions,
    ReplayCommandOptions,
    ScenariosOptions,
    ScoreOptions,
    SheetOptions,
    TrackOptions,
    ViewOptions,
    WebdatasetOptions,
)
from tracking.app.command_result import INTERRUPTED, CommandResult
from tracking.app.commands.tune import tune
from tracking.app.options_from_dataclass import options_from
from tracking.app.strict_command import StrictTyper

app = StrictTyper(
    add_completion=False,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 110},
    help="Group tracking under test: simulate labelled crowds, track people and groups, score.",
)
export = StrictTyper(rich_markup_mode=None, help="Convert a dataset to another format.")
app.add_typer(export, name="export")
fit = StrictTyper(rich_markup_mode=None, help="Fit a model to recordings.")
app.add_typer(fit, name="fit")


def _version(wanted: bool) -> None:
    if wanted:
        from importlib.metadata import PackageNotFoundError, version

        try:
            print(version("flockscope"))
        except PackageNotFoundError:
            print("unknown: not installed")
        raise typer.Exit


@app.callback()
def _start(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Show the version and exit.")
    ] = False,
) -> None:
    """Takes the options of the command itself."""


@app.command()
def demo(
    quick: Annotated[
        bool, typer.Option("--quick", help="Only the short scenes of the suite quick, with one seed.")
    ] = False,
    out: Out = Path("flockscope-demo"),
    json: Json = False,
) -> CommandResult:
    """Generate scenes, track them, score the tracks and write a page with the results."""
    from tracking.app.commands.demo import demo

    return demo(out, quick=quick)


@app.command()
@options_from(ScenariosOptions)
def scenarios(options: ScenariosOptions) -> CommandResult:
    """List scenarios and suites, or explain one with a drawing."""
    from tracking.app.commands.scenarios import scenarios

    return scenarios(options)


@app.command()
@options_from(GenerateOptions)
def generate(options: GenerateOptions) -> CommandResult:
    """Simulate scenarios and store them as a dataset."""
    from tracking.app.commands.datasets import generate

    return generate(options)


@app.command()
@options_from(TrackOptions)
def track(options: TrackOptions) -> CommandResult:
    """Run a tracker and store its tracks."""
    from tracking.app.commands.track import track

    return track(options)


@app.command()
@options_from(GroupOptions)
def group(options: GroupOptions) -> CommandResult:
    """Find who belongs together, and what happened, for people whose ids are known."""
    from tracking.app.commands.group import group

    return group(options)


@app.command()
@options_from(ScoreOptions)
def score(options: ScoreOptions) -> CommandResult:
    """Score tracks against the truth."""
    from tracking.app.commands.score import score

    return score(options)


app.command()(tune)


@app.command()
@options_from(ReplayCommandOptions)
def replay(options: ReplayCommandOptions) -> CommandResult:
    """Render recorded trajectories: real motion, simulated pictures and detections, exact labels."""
    from tracking.app.commands.datasets import replay

    return replay(options)


@fit.command("sensor")
@options_from(FitSensorOptions)
def fit_sensor(options: FitSensorOptions) -> CommandResult:
    """Measure the errors of a detector, so that simulated detections have the same errors."""
    from tracking.app.commands.fit import fit_sensor

    return fit_sensor(options)


@fit.command("grouping")
@options_from(FitGroupingOptions)
def fit_grouping(options: FitGroupingOptions) -> CommandResult:
    """Fit the belief of who belongs together to simulated scenes."""
    from tracking.app.commands.fit import fit_grouping

    return fit_grouping(options)


@fit.command("joint")
@options_from(FitJointOptions)
def fit_joint(options: FitJointOptions) -> CommandResult:
    """Learn the merges and splits of the tracker joint from simulated truth."""
    from tracking.app.commands.fit import fit_joint

    return fit_joint(options)


@fit.command("relational")
@options_from(FitRelationalOptions)
def fit_relational(options: FitRelationalOptions) -> CommandResult:
    """Learn the speed table and the relations of the tracker relational from simulated truth."""
    from tracking.app.commands.fit import fit_relational

    return fit_relational(options)


@app.command()
@options_from(ViewOptions)
def view(options: ViewOptions) -> CommandResult:
    """Write a page that replays a sequence in the browser: truth, tracks, and pictures if it has any."""
    from tracking.app.commands.view import view

    return view(options)


@app.command()
@options_from(SheetOptions)
def sheet(options: SheetOptions) -> CommandResult:
    """Write a contact sheet: several frames of a sequence in one picture, with the truth."""
    from tracking.app.commands.view import sheet

    return sheet(options)


@app.command()
@options_from(OverlayOptions)
def overlay(options: OverlayOptions) -> CommandResult:
    """Write a video with boxes, ids, trails, groups and events drawn over the pictures."""
    from tracking.app.commands.view import overlay

    return overlay(options)


@app.command()
def validate(
    folder: Annotated[Path, typer.Argument(metavar="DIR", help="A generated sequence or dataset, or stored tracks.")],
    json: Json = False,
) -> CommandResult:
    """Check that a dataset or stored tracks are complete, unaltered and consistent."""
    from tracking.app.commands.datasets import validate

    return validate(folder)


@export.command()
@options_from(CocoOptions)
def coco(options: CocoOptions) -> CommandResult:
    """Write COCO files, one per split, with track and group ids and masks."""
    from tracking.app.commands.datasets import export_coco

    return export_coco(options)


@export.command()
def kitti(
    folder: Annotated[Path, typer.Argument(metavar="DIR", help="A generated sequence or dataset with stereo pairs.")],
    out: Out,
    json: Json = False,
) -> CommandResult:
    """Write stereo pairs, disparities and calibrations as in KITTI."""
    from tracking.app.commands.datasets import export_kitti

    return export_kitti(folder, out)


@export.command()
@options_from(WebdatasetOptions)
def webdataset(options: WebdatasetOptions) -> CommandResult:
    """Write tar shards for streaming, in the format of the library webdataset."""
    from tracking.app.commands.datasets import export_webdataset

    return export_webdataset(options)


def run(arguments: Sequence[str]) -> int:
    """Runs one command line, prints its result on stdout or its error on stderr, and returns the exit code."""
    from tracking.app.command_runner import run_command

    return run_command(app, list(arguments) or ["--help"])


def main() -> None:
    """Runs the command line of this process (sys.argv) and never returns."""
    _open_streams()
    code = run(sys.argv[1:])
    if code == INTERRUPTED:
        sys.stdout.flush()
        os._exit(code)  # sys.exit would end by SIGINT, not with 130, where Ctrl-C came inside an exec of a library
    sys.exit(code)


def _open_streams() -> None:
    # A file that is opened later would take the number of a closed stream, and get what is printed.
    for number, mode in enumerate((os.O_RDONLY, os.O_RDONLY, os.O_WRONLY)):
        try:
            os.fstat(number)
        except OSError:
            os.open(os.devnull, mode)  # takes the lowest free number, which is this one
    if sys.stdout is None:
        sys.stdout = open(1, "w", encoding="utf-8", closefd=False)  # noqa: SIM115
    if sys.stderr is None:
        sys.stderr = open(2, "w", encoding="utf-8", closefd=False)  # noqa: SIM115
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")


if __name__ == "__main__":
    main()
