"""Options and arguments, most of them of several commands: name, value's form and help text of each, for Typer."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

import typer

Json = Annotated[bool, typer.Option("--json", help="Print one JSON object instead of text.")]
Set = Annotated[list[str], typer.Option("--set", metavar="K=V", help="Set a value. Can be given several times.")]
Out = Annotated[Path, typer.Option("--out", metavar="DIR", help="Folder to write to.")]
Source = Annotated[
    Path, typer.Argument(metavar="SOURCE", help="Sequence or dataset: generated, MOT, video, BIWI, CAVIAR.")
]
People = Annotated[
    Path, typer.Argument(metavar="SOURCE|TRACKS", help="Labelled people, MOT text with ids, or output of `track`.")
]
Tracker = Annotated[
    str, typer.Argument(metavar="TRACKER", help="Name of a tracker, or file.py:Class, or module:Class.")
]
Tracks = Annotated[Path | None, typer.Argument(metavar="TRACKS", help="Output of `track`, or MOT text.")]
Detections = Annotated[
    Literal["image", "truth", "file"] | None,
    typer.Option(
        help="Detections that the tracker gets. Default: the first of image, file, truth that it and the source allow."
    ),
]
Fps = Annotated[
    float | None,
    typer.Option("--fps", help="Frames per second of a recording, in place of its own. Not for generated sequences."),
]
Scale = Annotated[float | None, typer.Option("--px-per-m", help="Pixels per metre of a recording without a camera.")]
PersonClass = Annotated[
    int | None,
    typer.Option("--class", min=0, metavar="N", help="Class of people (column 8) in MOT texts. Default: 1."),
]
BoxFactor = Annotated[
    str | None,
    typer.Option(
        "--box-scale",
        metavar="X|X,Y",
        help="Factor of the boxes in MOT texts, except labels, if they are not in pixels of the pictures.",
    ),
]
Calibration = Annotated[
    Path | None,
    typer.Option("--camera", metavar="FILE", help="Calibration: camera.json, Tsai's XML, or OpenCV's YAML of a pair."),
]
Detector = Annotated[
    Path | None, typer.Option("--sensor", metavar="FILE.toml", help="Detector profile, as `fit sensor` writes it.")
]
Workers = Annotated[
    int, typer.Option("--workers", min=1, help="Processes. On a cluster: the least number of tasks at a time.")
]
Processes = Annotated[int, typer.Option("--workers", min=1, help="Processes that share the sequences.")]
Cluster = Annotated[
    str | None,
    typer.Option("--cluster", metavar="tcp://HOST:PORT", help="Scheduler of a dask cluster that does the work."),
]
StepTimeout = Annotated[
    float | None,
    typer.Option(
        "--step-timeout",
        metavar="SECONDS",
        help="Stop a tracker whose reset or step takes longer. It then runs in a process of its own.",
    ),
]
Streams = Annotated[
    str,
    typer.Option(
        "--streams", metavar="A,B,…", help="Pictures to store: left, right, disparity, ids, background; or none."
    ),
]
Images = Annotated[
    Literal["jpg", "png", "mp4"] | None,
    typer.Option(help="Format of left, right and background pictures. Default: jpg."),
]
Rule = Annotated[
    Path | None,
    typer.Option(
        "--grouping",
        metavar="rule|belief|FILE.toml",
        help="What derives groups (default: belief), or a file of `tune grouping` or `fit grouping`.",
    ),
]
Probabilities = Annotated[
    bool, typer.Option("--probabilities", help="Store the probability that two people belong together.")
]
Params = Annotated[
    str | None,
    typer.Option("--params", metavar="FILE.toml|PRESET", help="The tracker's parameters: a file, or paper."),
]
Background = Annotated[
    str | None,
    typer.Option("--background", metavar="first:N|spread:N", help="Frames a background model is trained on."),
]
