"""The command `flockscope`: every command with its options; what they do stands in the modules named after them."""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Literal

import typer

from scenarios.errors import InputError
from tracking.app.command_result import INTERRUPTED, CommandResult
from tracking.app.recording_options import fit_sensor, replay
from tracking.app.shared_options import (
    Calibration,
    Cluster,
    Detector,
    Fps,
    Images,
    Json,
    Out,
    Rule,
    Scale,
    Set,
    Source,
    Streams,
    Tracked,
    Workers,
)
from tracking.app.tune_options import tune

app = typer.Typer(
    add_completion=False,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 110},
    help="Group tracking under test: simulate labelled crowds, track people and groups, score.",
)
export = typer.Typer(rich_markup_mode=None, help="Turn a dataset into another form.")
app.add_typer(export, name="export")
fit = typer.Typer(rich_markup_mode=None, help="Learn a table from recordings.")
app.add_typer(fit, name="fit")


def _version(asked: bool) -> None:
    if asked:
        from importlib.metadata import PackageNotFoundError, version

        try:
            print(version("flockscope"))
        except PackageNotFoundError:
            print("unknown: not installed")
        raise typer.Exit


@app.callback()
def _start(
    version: Annotated[bool, typer.Option("--version", callback=_version, is_eager=True, help="Say which.")] = False,
) -> None:
    """Options of the command itself."""


@app.command()
def demo(
    quick: Annotated[bool, typer.Option("--quick", help="One short scene only.")] = False,
    out: Out = Path("flockscope-demo"),
    json: Json = False,
) -> CommandResult:
    """From scenes to a page with scores, start to finish."""
    from tracking.app.commands.demo import demo

    return demo(out, quick=quick)


@app.command()
def scenarios(
    name: Annotated[str | None, typer.Argument(help="Scenario, *.toml file or suite to explain.")] = None,
    settings: Set = [],  # noqa: B006 (typer copies it)
    out: Annotated[Path | None, typer.Option("--out", metavar="FILE.svg", help="Draw the plan and script.")] = None,
    schema: Annotated[bool, typer.Option("--schema", help="List every key of a scenario file.")] = False,
    json: Json = False,
) -> CommandResult:
    """List them, or explain one with a drawing."""
    from tracking.app.commands import scenario_keys, scenarios

    if name is not None and not schema:
        return scenarios.explain(name, settings, out)
    unused = {"NAME": name, "--out": out, "--set": settings}
    for option, value in unused.items():
        if value:
            got, remedy = f"{option} with nothing to explain", "name a scenario, without --schema"
            raise InputError(place=option, got=got, expected="NAME", remedy=remedy)
    return scenario_keys.keys() if schema else scenarios.catalogue()


@app.command()
def generate(
    names: Annotated[list[str], typer.Argument(metavar="NAME…", help="Scenarios, *.toml files or suites.")],
    seeds: Annotated[str, typer.Option("--seeds", metavar="A:B", help="Seeds from A to B - 1, or one.")],
    out: Out,
    settings: Set = [],  # noqa: B006
    sensor: Detector = None,
    streams: Streams = "left",
    images: Images = None,
    workers: Workers = 1,
    cluster: Cluster = None,
    json: Json = False,
) -> CommandResult:
    """Simulate scenarios and store them as a dataset."""
    from tracking.app import option_parsing
    from tracking.app.commands.datasets import generate

    texts = [*option_parsing.sensor(sensor), *settings]
    return generate(names, seeds, out, texts, streams, images, workers=workers, cluster=cluster)


@app.command()
def track(
    tracker: Annotated[str, typer.Argument(metavar="TRACKER", help="Its name, file.py:Class or module:Class.")],
    source: Source,
    out: Out,
    params: Annotated[Path | None, typer.Option("--params", metavar="FILE.toml", help="Its parameters.")] = None,
    settings: Set = [],  # noqa: B006
    detections: Annotated[Literal["image", "truth", "file"] | None, typer.Option(help="What it is given.")] = None,
    sensor: Detector = None,
    grouping: Rule = None,
    seed: Annotated[int, typer.Option("--seed", min=0, help="The tracker's seed.")] = 0,
    fps: Fps = None,
    px_per_m: Scale = None,
    camera: Calibration = None,
    background: Annotated[
        str | None,
        typer.Option("--background", metavar="first:N|spread:N", help="Frames a video's background is learned from."),
    ] = None,
    json: Json = False,
) -> CommandResult:
    """Run a tracker and store what it says."""
    from tracking.app.commands import track

    job = track.job(tracker, params, settings, detections, seed, sensor, grouping)
    return track.track(job, source, out, fps=fps, px_per_m=px_per_m, camera=camera, background=background)


@app.command()
def score(
    truth: Annotated[Path, typer.Argument(metavar="TRUTH", help="Labelled sequence or dataset.")],
    tracks: Annotated[Path, typer.Argument(metavar="TRACKS", help="What `track` wrote, or MOT text.")],
    similarity: Annotated[
        Literal["boxes", "ground", "image"] | None, typer.Option(help="What is compared; chosen where absent.")
    ] = None,
    group_match: Annotated[
        Literal["hull", "members"], typer.Option("--group-match", help="By what true and estimated groups are matched.")
    ] = "hull",
    against: Annotated[
        Path | None, typer.Option("--against", metavar="TRACKS", help="Other tracks: say how the scores differ.")
    ] = None,
    blocks: Annotated[
        int, typer.Option("--blocks", min=0, metavar="N", help="One recording: an interval by N draws of blocks.")
    ] = 0,
    fps: Fps = None,
    px_per_m: Scale = None,
    json: Json = False,
) -> CommandResult:
    """Score tracks against truth."""
    from tracking.app.commands.score import score

    return score(
        truth,
        tracks,
        against=against,
        blocks=blocks,
        similarity=similarity,
        group_match=group_match,
        fps=fps,
        px_per_m=px_per_m,
    )


app.command()(tune)
app.command()(replay)
fit.command("sensor")(fit_sensor)


@app.command()
def view(
    source: Source,
    tracks: Tracked = None,
    *,
    out: Annotated[Path, typer.Option("--out", metavar="FILE.html", help="Page to write; a folder for many.")],
    video: Annotated[
        Literal["auto", "inside", "beside", "none"],
        typer.Option(help="Pictures inside the page, as FILE.view.mp4 beside it (auto: from 12 MB on), or none."),
    ] = "auto",
    fps: Fps = None,
    px_per_m: Scale = None,
    camera: Calibration = None,
    json: Json = False,
) -> CommandResult:
    """A replay in the browser, tracks beside truth, over the pictures where there are any."""
    from tracking.app.commands.view import Recording, view

    return view(Recording(source, fps, px_per_m, camera), tracks, out, video)


@app.command()
def sheet(
    source: Source,
    out: Annotated[Path, typer.Option("--out", metavar="FILE.png", help="Picture to write; a folder for many.")],
    frames: Annotated[int, typer.Option("--frames", min=1, max=64, help="Panels.")] = 8,
    fps: Fps = None,
    json: Json = False,
) -> CommandResult:
    """A contact sheet of a sequence: its pictures, its truth."""
    from tracking.app.commands.view import Recording, sheet

    return sheet(Recording(source, fps), out, frames)


@app.command()
def overlay(
    source: Source,
    tracks: Tracked = None,
    *,
    out: Annotated[Path, typer.Option("--out", metavar="FILE.mp4", help="Video to write; a folder for many.")],
    truth: Annotated[
        Literal["beside", "over", "only"] | None,
        typer.Option(help="The truth beside the tracks, over the same picture, or alone; alone without TRACKS."),
    ] = None,
    fps: Fps = None,
    px_per_m: Scale = None,
    camera: Calibration = None,
    json: Json = False,
) -> CommandResult:
    """A video with boxes, ids, trails, groups and events drawn over the pictures."""
    from tracking.app.commands.view import Recording, overlay

    return overlay(Recording(source, fps, px_per_m, camera), tracks, out, truth)


@app.command()
def validate(
    folder: Annotated[Path, typer.Argument(metavar="DIR", help="A generated sequence or dataset.")], json: Json = False
) -> CommandResult:
    """Check that a dataset is whole, unaltered and consistent."""
    from tracking.app.commands.datasets import validate

    return validate(folder)


@export.command()
def coco(
    folder: Annotated[Path, typer.Argument(metavar="DIR", help="A sequence or dataset with labelled boxes.")],
    out: Annotated[Path, typer.Option("--out", metavar="FILE.json", help="File to write.")],
    json: Json = False,
) -> CommandResult:
    """One COCO file with track and group ids."""
    from tracking.app.commands.datasets import export_coco

    return export_coco(folder, out)


@export.command()
def webdataset(
    folder: Annotated[Path, typer.Argument(metavar="DIR", help="A generated sequence or dataset.")],
    out: Out,
    shard_size: Annotated[
        str, typer.Option("--shard-size", metavar="SIZE", help="What a shard may hold: 500MB, 2GB.")
    ] = "1GB",
    samples: Annotated[
        Literal["sequence", "frame"], typer.Option(help="A sample: a sequence with all its files, or a labelled frame.")
    ] = "sequence",
    json: Json = False,
) -> CommandResult:
    """Tar shards to stream from, as the library webdataset reads them."""
    from tracking.app.commands.datasets import export_webdataset

    return export_webdataset(folder, out, shard_size, samples)


def run(arguments: Sequence[str]) -> int:
    """Run the command; everything it says is printed; its exit code."""
    from tracking.app.command_runner import carry_out

    return carry_out(app, list(arguments) or ["--help"])


def main() -> None:
    """The entry point."""
    code = run(sys.argv[1:])
    if code == INTERRUPTED:
        sys.stdout.flush()
        os._exit(code)  # sys.exit would end by SIGINT, not with 130, where Ctrl-C came inside an exec of a library
    sys.exit(code)


if __name__ == "__main__":
    main()
