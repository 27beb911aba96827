"""The options of each command as one frozen dataclass: every field is an option, with its type, default and help text.

`options_from_dataclass` turns a dataclass into a Typer command. Commands with less than four options have none;
those of `tune` follow from `tracking.tuning.options`. The module imports Typer only, so that `--help` stays quick.
"""

from __future__ import annotations

from dataclasses import dataclass, field
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


@dataclass(frozen=True, kw_only=True)
class ScenariosOptions:
    """Options of `scenarios`."""

    name: Annotated[str | None, typer.Argument(help="Scenario, *.toml file or suite to explain.")] = None
    settings: Set = field(default_factory=list)
    out: Annotated[
        Path | None, typer.Option("--out", metavar="FILE.svg", help="Write a drawing of plan and script.")
    ] = None
    schema: Annotated[bool, typer.Option("--schema", help="List every key of a scenario file.")] = False


@dataclass(frozen=True, kw_only=True)
class GenerateOptions:
    """Options of `generate`."""

    names: Annotated[list[str], typer.Argument(metavar="NAME…", help="Scenarios, *.toml files or suites.")]
    seeds: Annotated[str, typer.Option("--seeds", metavar="A:B", help="Seeds from A to B - 1, or one seed.")]
    out: Out
    settings: Set = field(default_factory=list)
    sensor: Detector = None
    streams: Streams = "left"
    images: Images = None
    stride: Annotated[
        int, typer.Option("--stride", min=1, metavar="N", help="Store every N-th frame of the camera only.")
    ] = 1
    workers: Workers = 1
    cluster: Cluster = None


@dataclass(frozen=True, kw_only=True)
class TrackOptions:
    """Options of `track`."""

    tracker: Tracker
    source: Source
    out: Out
    params: Params = None
    settings: Set = field(default_factory=list)
    detections: Detections = None
    sensor: Detector = None
    grouping: Rule = None
    seed: Annotated[int, typer.Option("--seed", min=0, help="The tracker's seed.")] = 0
    fps: Fps = None
    px_per_m: Scale = None
    camera: Calibration = None
    background: Background = None
    step_timeout: StepTimeout = None
    person_class: PersonClass = None
    box_scale: BoxFactor = None
    workers: Processes = 1


@dataclass(frozen=True, kw_only=True)
class GroupOptions:
    """Options of `group`."""

    source: People
    out: Out
    grouping: Rule = None
    probabilities: Probabilities = False
    fps: Fps = None
    px_per_m: Scale = None
    camera: Calibration = None
    person_class: PersonClass = None
    box_scale: BoxFactor = None


@dataclass(frozen=True, kw_only=True)
class ScoreOptions:
    """Options of `score`."""

    truth: Annotated[Path, typer.Argument(metavar="TRUTH", help="Labelled sequence or dataset.")]
    tracks: Annotated[
        list[str],
        typer.Argument(
            metavar="TRACKS…",
            help="Output of `track`, MOT text, or a tracker class (file.py:Class); several are ranked.",
        ),
    ]
    similarity: Annotated[
        Literal["boxes", "ground", "image"] | None,
        typer.Option(help="How true and tracked people are compared. Default: by the data."),
    ] = None
    group_match: Annotated[
        Literal["hull", "members"], typer.Option("--group-match", help="How true and estimated groups are compared.")
    ] = "hull"
    blocks: Annotated[
        int,
        typer.Option(
            "--blocks", min=0, metavar="N", help="Intervals for a single recording, by N draws of blocks of frames."
        ),
    ] = 0
    by: Annotated[
        str | None,
        typer.Option(
            "--by", metavar="SCORE", help="The score that ranks. Default: objective, or what all runs have of it."
        ),
    ] = None
    all: Annotated[bool, typer.Option("--all", help="Show each sequence of a ranking, too.")] = False
    csv: Annotated[
        Path | None, typer.Option("--csv", metavar="FILE", help="Write all scores of a ranking into this file.")
    ] = None
    fps: Fps = None
    px_per_m: Scale = None
    person_class: PersonClass = None
    box_scale: BoxFactor = None
    workers: Processes = 1


@dataclass(frozen=True, kw_only=True)
class ReplayCommandOptions:
    """Options of `replay`."""

    source: Source
    out: Out
    camera: Annotated[
        Path | None,
        typer.Option(
            "--camera", metavar="FILE.toml", help="Tables [camera], [sensor], [light], [picture]; each may be absent."
        ),
    ] = None
    seeds: Annotated[
        str,
        typer.Option(
            "--seeds", metavar="A:B", help="Seeds of bodies, looks and sensor. For real recordings from 20000 on."
        ),
    ] = "20000"
    start: Annotated[float, typer.Option("--start", min=0.0, metavar="S", help="Second at which to begin.")] = 0.0
    duration: Annotated[
        float | None, typer.Option("--duration", metavar="S", help="Seconds to replay. Default: up to the end.")
    ] = None
    settings: Set = field(default_factory=list)
    sensor: Detector = None
    streams: Streams = "left"
    images: Images = None
    fps: Fps = None
    calibration: Annotated[
        Path | None,
        typer.Option(
            "--calibration",
            metavar="FILE",
            help="Calibration of a recording that has boxes only: camera.json or Tsai's XML.",
        ),
    ] = None


@dataclass(frozen=True, kw_only=True)
class ViewOptions:
    """Options of `view`."""

    source: Source
    tracks: Tracks = None
    out: Annotated[
        Path, typer.Option("--out", metavar="FILE.html", help="Page to write; for several sequences, a folder.")
    ]
    video: Annotated[
        Literal["auto", "inside", "beside", "none"],
        typer.Option(help="Pictures inside the page, beside it as FILE.view.mp4, or none. auto: beside from 12 MB on."),
    ] = "auto"
    fps: Fps = None
    px_per_m: Scale = None
    camera: Calibration = None


@dataclass(frozen=True, kw_only=True)
class SheetOptions:
    """Options of `sheet`."""

    source: Source
    out: Annotated[
        Path, typer.Option("--out", metavar="FILE.png", help="Picture to write; for several sequences, a folder.")
    ]
    frames: Annotated[int, typer.Option("--frames", min=1, max=64, help="Number of frames to show.")] = 8
    fps: Fps = None


@dataclass(frozen=True, kw_only=True)
class OverlayOptions:
    """Options of `overlay`."""

    source: Source
    tracks: Tracks = None
    out: Annotated[
        Path, typer.Option("--out", metavar="FILE.mp4", help="Video to write; for several sequences, a folder.")
    ]
    truth: Annotated[
        Literal["beside", "over", "only"] | None,
        typer.Option(
            help="Draw the truth: beside the tracks, over the same picture, or only it. Without TRACKS always only it."
        ),
    ] = None
    fps: Fps = None
    px_per_m: Scale = None
    camera: Calibration = None


@dataclass(frozen=True, kw_only=True)
class CocoOptions:
    """Options of `export coco`."""

    folder: Annotated[Path, typer.Argument(metavar="DIR", help="A sequence or dataset with labelled boxes.")]
    out: Annotated[
        Path,
        typer.Option(
            "--out", metavar="FILE.json", help="File to write; for several splits FILE-train.json, FILE-val.json, …"
        ),
    ]
    min_visibility: Annotated[
        float,
        typer.Option("--min-visibility", min=0.0, max=1.0, metavar="V", help="Leave out people who are less visible."),
    ] = 0.0
    person_class: PersonClass = None


@dataclass(frozen=True, kw_only=True)
class WebdatasetOptions:
    """Options of `export webdataset`."""

    folder: Annotated[Path, typer.Argument(metavar="DIR", help="A generated sequence or dataset.")]
    out: Out
    shard_size: Annotated[
        str,
        typer.Option(
            "--shard-size", metavar="SIZE", help="Largest shard, as 500MB or 2GB; a larger sequence has its own."
        ),
    ] = "1GB"
    samples: Annotated[
        Literal["sequence", "frame"], typer.Option(help="A sample: a sequence with all its files, or a labelled frame.")
    ] = "sequence"


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
