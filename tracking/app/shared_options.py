"""Arguments and options that several commands take, each said once."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

import typer

Json = Annotated[bool, typer.Option("--json", help="Print one JSON object instead of text.")]
Set = Annotated[list[str], typer.Option("--set", metavar="K=V", help="Set a value; may be given often.")]
Out = Annotated[Path, typer.Option("--out", metavar="DIR", help="Folder to write to.")]
Source = Annotated[
    Path, typer.Argument(metavar="SOURCE", help="Sequence or dataset: generated, MOT, video, BIWI, CAVIAR.")
]
Fps = Annotated[float | None, typer.Option("--fps", help="Frames per second, where the recording does not say.")]
Scale = Annotated[float | None, typer.Option("--px-per-m", help="Pixels per metre, where there is no camera.")]
Calibration = Annotated[
    Path | None, typer.Option("--camera", metavar="FILE", help="A recording's calibration: camera.json or Tsai's XML.")
]
Detector = Annotated[
    Path | None, typer.Option("--sensor", metavar="FILE.toml", help="A detector's profile, by `fit sensor`.")
]
Workers = Annotated[int, typer.Option("--workers", min=1, help="Processes; on a cluster, so many at once at least.")]
Cluster = Annotated[
    str | None, typer.Option("--cluster", metavar="tcp://HOST:PORT", help="Scheduler of a dask cluster that works.")
]
Streams = Annotated[
    str, typer.Option("--streams", metavar="A,B,…", help="Pictures: left, right, disparity, ids, background; or none.")
]
Images = Annotated[
    Literal["jpg", "png", "mp4"] | None, typer.Option(help="How pictures are stored; jpg if nothing is said.")
]
Rule = Annotated[
    Path | None, typer.Option("--grouping", metavar="FILE.toml", help="The rule of groups, by `tune grouping`.")
]
Tracked = Annotated[Path | None, typer.Argument(metavar="TRACKS", help="What `track` wrote, or MOT text.")]
