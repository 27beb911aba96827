"""The options of each command as one frozen dataclass: every field is an option, with its type, default and help text.

`options_from_dataclass` turns a dataclass into a Typer command. Commands with less than four options have none;
those of `tune` follow from `tracking.tuning.options`. The module imports Typer only, so that `--help` stays quick.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Literal

import typer

from tracking.app.shared_options import (
    Background,
    BoxFactor,
    Calibration,
    Cluster,
    Detections,
    Detector,
    Fps,
    Images,
    Out,
    Params,
    People,
    PersonClass,
    Probabilities,
    Processes,
    Rule,
    Scale,
    Set,
    Source,
    StepTimeout,
    Streams,
    Tracker,
    Tracks,
    Workers,
)


@dataclass(frozen=True, kw_only=True)
class ScenariosOptions:
    """Options of the command `scenarios`, which lists scenarios and suites, or explains one.

    name: scenario, *.toml file or suite to explain; None: list all. settings: texts "key=value" for it, [] if absent.
    out: SVG file for a drawing; None: no drawing. schema: list every key of a scenario file instead.
    """

    name: Annotated[str | None, typer.Argument(help="Scenario, *.toml file or suite to explain.")] = None
    settings: Set = field(default_factory=list)
    out: Annotated[
        Path | None, typer.Option("--out", metavar="FILE.svg", help="Write a drawing of plan and script.")
    ] = None
    schema: Annotated[bool, typer.Option("--schema", help="List every key of a scenario file.")] = False


@dataclass(frozen=True, kw_only=True)
class GenerateOptions:
    """Options of the command `generate`, which simulates scenarios and stores them as a dataset.

    names: scenarios, *.toml files or suites. seeds: "A:B" (A to B - 1) or one number. out: folder to write. settings:
    texts "key=value". sensor: file of a detector profile; None: the scenario's own. streams: names of the pictures to
    store, or "none". images: format of pictures; None: jpg. stride: N stores every N-th frame. workers: number of
    processes. cluster: address of a dask scheduler; None: this machine.
    """

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
    """Options of the command `track`, which runs a tracker on a sequence or dataset and stores its tracks.

    tracker: its name, file.py:Class or module:Class. source, out: paths. params: file of the tracker's parameters, or
    name of a preset; None: its defaults. settings: texts "key=value". detections: "image", "truth" or "file"; None: the
    first of image, file, truth that tracker and source allow. sensor: file of a detector profile, None if not given.
    grouping: file of a rule that derives groups, None if not given. seed: of the tracker's and the sensor's random
    numbers. fps: frames per second; None: the recording's own. px_per_m: pixels per metre, camera: calibration file;
    None if not given. background: "first:N" or "spread:N", the frames that a background model is trained on; None if
    not given. step_timeout: seconds that each reset and step of the tracker may take; None: no limit.
    person_class: class of people in MOT texts; None: 1. box_scale: factor of the boxes in MOT texts; None: 1.
    workers: number of processes.
    """

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
    """Options of the command `group`, which finds the groups of people whose ids are known.

    source: path of labelled people, a text with ids, or stored tracks. out: folder to write. grouping: file of the
    parameters that decide who belongs together; None: the defaults. probabilities: store those of all pairs. fps:
    frames per second; None: the recording's own. px_per_m: pixels per metre, camera: calibration; None if not given.
    person_class: class of people in MOT texts; None: 1. box_scale: factor of the boxes in MOT texts; None: 1.
    """

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
    """Options of the command `score`, which compares tracks with the truth.

    truth: path. tracks: paths of runs or texts, or names of tracker classes; several are ranked. similarity: how people
    are compared, "boxes", "ground" or "image"; None: by the data. group_match: how groups are compared, by "hull" or
    "members". blocks: number of draws of blocks of frames for the intervals of a single recording; 0: no such
    intervals. by: the score that ranks several runs; None: objective, or the part of it that all have. all: show each
    sequence of a ranking. csv: file for all scores of a ranking. fps: frames per second; None: the recording's own.
    px_per_m: pixels per metre; None if not given. person_class: class of people in MOT texts; None: 1. box_scale:
    factor of the boxes in MOT texts; None: 1. workers: number of processes.
    """

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
    """Options of the command `replay`, which renders recorded trajectories with a simulated camera and stores a
    dataset.

    source: recording or dataset. out: folder to write. camera: TOML file with [camera], [sensor], [light], [picture];
    None: all defaults. seeds: "A:B" (A to B - 1) or one number. start: second at which to begin. duration: seconds to
    replay; None: to the end. settings: texts "key=value". sensor: file of a detector profile, None if not given.
    streams: names of the pictures to store, with commas, or "none". images: format of pictures; None: jpg. fps: frames
    per second; None: the recording's own. calibration: file of a camera, for a recording that has boxes only; None if
    not given.
    """

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
    """Options of the command `view`, which writes a page that replays sequences.

    source: sequence or dataset. tracks: stored tracks; None: only the truth. out: HTML file, or a folder for several
    sequences. video: pictures "inside" the page, "beside" it as a video file, "none", or "auto" (beside from 12 MB on).
    fps: frames per second; None: the recording's own. px_per_m: pixels per metre, camera: calibration file; None if not
    given.
    """

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
    """Options of the command `sheet`, which draws several frames of a sequence in one picture.

    source: sequence or dataset. out: PNG file, or a folder for several sequences. frames: number of frames to show, 1
    to 64. fps: frames per second; None: the recording's own.
    """

    source: Source
    out: Annotated[
        Path, typer.Option("--out", metavar="FILE.png", help="Picture to write; for several sequences, a folder.")
    ]
    frames: Annotated[int, typer.Option("--frames", min=1, max=64, help="Number of frames to show.")] = 8
    fps: Fps = None


@dataclass(frozen=True, kw_only=True)
class OverlayOptions:
    """Options of the command `overlay`, which writes a video with tracks or truth drawn over the pictures.

    source: sequence or dataset. tracks: stored tracks; None: only the truth. out: MP4 file, or a folder for several
    sequences. truth: drawn "beside" the tracks, "over" the same picture, or "only" it; None: not drawn if there are
    tracks. fps: frames per second; None: the recording's own. px_per_m: pixels per metre, camera: calibration file;
    None if not given.
    """

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
    """Options of the command `export coco`, which writes COCO files.

    folder: a sequence or dataset with labelled boxes. out: JSON file; with several splits, each has its own.
    min_visibility: people less visible are left out, 0 to 1.
    person_class: class of people in MOT texts; None: 1.
    """

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
    """Options of the command `export webdataset`, which writes tar shards.

    folder: a generated sequence or dataset. out: folder to write. shard_size: the largest shard, as "500MB" or "2GB"; a
    larger sequence has its own. samples: a sample is a whole "sequence" or one labelled "frame".
    """

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
