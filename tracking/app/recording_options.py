"""The commands on recordings, `fit sensor` and `replay`, with their options; what they do stands in …_command."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from tracking.app.command_result import CommandResult
from tracking.app.shared_options import Detector, Fps, Images, Json, Out, Set, Source, Streams


def fit_sensor(
    sources: Annotated[list[Path], typer.Argument(metavar="SOURCE…", help="Recordings with gt and det; pooled.")],
    out: Annotated[Path, typer.Option("--out", metavar="FILE.toml", help="File to write: a [sensor] table.")],
    fps: Fps = None,
    json: Json = False,
) -> CommandResult:
    """How a detector errs, for synthetic detections that err alike."""
    from tracking.app.commands.fit import sensor

    return sensor(sources, out, fps)


def replay(
    source: Source,
    out: Out,
    camera: Annotated[
        Path | None,
        typer.Option("--camera", metavar="FILE.toml", help="[camera], and [sensor], [light], [picture] if you like."),
    ] = None,
    seeds: Annotated[
        str, typer.Option("--seeds", metavar="A:B", help="Of bodies, looks and sensor; recordings: from 20000 on.")
    ] = "20000",
    start: Annotated[float, typer.Option("--start", min=0.0, metavar="S", help="Where in it to begin.")] = 0.0,
    duration: Annotated[float | None, typer.Option("--duration", metavar="S", help="How much of it; the rest.")] = None,
    settings: Set = [],  # noqa: B006
    sensor: Detector = None,
    streams: Streams = "left",
    images: Images = None,
    fps: Fps = None,
    calibration: Annotated[
        Path | None,
        typer.Option("--calibration", metavar="FILE", help="Of a recording with boxes only: ours or Tsai's."),
    ] = None,
    json: Json = False,
) -> CommandResult:
    """Real trajectories before our cameras: real motion, perfect labels."""
    from tracking.app import option_parsing
    from tracking.app.commands import replay

    part = replay.Part(source, start, duration, fps, calibration)
    texts = [*option_parsing.sensor(sensor), *settings]
    return replay.replay(part, camera, seeds, out, texts, streams, images)
