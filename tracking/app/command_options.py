"""The options of each command as one class: every field is an option, with its type, default and help text.

The docstring of a class is the help text of its command. The help lists its own options first, then inherited ones."""

from __future__ import annotations

from dataclasses import MISSING, dataclass, fields
from functools import partial
from pathlib import Path
from typing import Any, Literal, dataclass_transform

from tracking.export import MIN_VISIBILITY
from tracking.keyword_options import option
from tracking.tuning.options import TuneOptions

# fmt: off
ARGUMENT = partial(option, flag="")
SET = partial(option, "Set a value. Can be given several times.", [], flag="--set", metavar="K=V")
OUT = partial(option, "Folder to write to.", metavar="DIR")
TOML = partial(option, metavar="FILE.toml", flag="--out")
FILE = partial(option, flag="--out")
NAMES = partial(ARGUMENT, "Scenarios, *.toml files or suites.", metavar="NAME…")
SOURCE = partial(
    ARGUMENT, "Sequence or dataset: generated, MOT, video, trajectories, KITTI, BIWI, CAVIAR.", metavar="SOURCE")
SIMILARITY = partial(option, "How true and tracked people are compared. Default: by the data.", None)
TRACKS = partial(ARGUMENT, "Output of `track`, or MOT text.", None, metavar="TRACKS")
FPS = partial(option, "Frames per second of a recording, in place of its own. Not for generated sequences.", None)
PERSON_CLASS = partial(
    option, "Classes of people in texts, tables and COCO results. Default: 1, or person, pedestrian.", None,
    metavar="A,B,…", flag="--class")
CAMERA = partial(option, "Calibration: camera.json, Tsai's XML, or OpenCV's or ROS's file.", None, metavar="FILE")
SENSOR = partial(option, "Detector profile, as `fit sensor` writes it.", None, metavar="FILE.toml")
WORKERS = partial(option, "Processes. On a cluster: the least number of tasks at a time.", 1, low=1)
PROCESSES = partial(option, "Processes that share the sequences.", 1, low=1)
CLUSTER = partial(option, "Scheduler of a dask cluster that does the work.", None, metavar="tcp://HOST:PORT")
STEP_TIMEOUT = partial(
    option, "Stop a tracker whose reset or step takes longer. It then runs in a process of its own.", None,
    metavar="SECONDS")
FRESH = partial(option, "Ignore and remove what an earlier command stored here.", False)
STREAMS = partial(
    option, "Pictures to store: left, right, disparity, ids, background; or none.", "left", metavar="A,B,…")
IMAGES = partial(option, "Format of left, right and background pictures. Default: jpg.", None)
GROUPING = partial(
    option, "What derives groups (default: belief), or a file of `tune grouping` or `fit grouping`.", None,
    metavar="rule|belief|FILE.toml")
SEEDS = partial(option, metavar="A:B")
SEEDS_HELP = "Seeds from A to B - 1, or one seed."
LEAST_VISIBLE = partial(option, low=0, high=1, metavar="SHARE")
SMALLER = "people of whom a smaller share is visible are ignored."
MIN_DURATION = partial(
    option, "Leave out groups that exist for a shorter time in all, and events that concern only such groups.", "0s",
    metavar="DURATION")
BOXES = partial(
    option, "A detector's boxes on the pictures: MOT text, table with named columns (frames or times), COCO results.",
    None, metavar="FILE")
MIN_SCORE = partial(option, "Leave out boxes with a lower score, as it stands in their file.", None)
Images = Literal["jpg", "png", "mp4"] | None
Detections = Literal["image", "truth", "file"] | None
DetectionsOrBoth = Literal["image", "truth", "file", "both"] | None
Similarity = Literal["boxes", "ground", "image"] | None


TUNING = {f.name: f for f in fields(TuneOptions)}


def tuned(name: str, default: Any = ..., flag: str | None = None) -> Any:
    """Returns an option of `tracking.tune` as an option of the command, with its help text. default: ... keeps the
    default of `tracking.tune`. flag: as of `option`; None takes "--name"."""
    f = TUNING[name]
    more = {"metavar": f.metadata["metavar"], "flag": f"--{name}" if flag is None else flag}
    return option(f.metadata["help"], f.default if default is ... else default, **more)


# By the words of a command: its options, and the function that takes them, by its module in `commands/`.
COMMANDS: dict[str, tuple[type, str]] = {}


@dataclass_transform(kw_only_default=True, frozen_default=True)
class Options:
    """The options of a command. Each subclass is made a frozen dataclass; its docstring is the command's help.

    words: the words of the command, such as "fit joint". run: the function that takes the options, as "module:function"
    in `commands/`.
    """

    def __init_subclass__(cls, words: str = "", run: str = "") -> None:
        dataclass(frozen=True, kw_only=True)(cls)
        if words:
            COMMANDS[words] = cls, run or f"{words}:{words}"


class SceneOptions(Options):
    """Options that change simulated scenes, for commands that simulate or that get a sensor."""

    settings: list[str] = SET()
    sensor: Path | None = SENSOR()


class PictureOptions(SceneOptions):
    """Options on what is stored of simulated scenes, for commands that simulate."""

    streams: str = STREAMS()
    images: Images = IMAGES()
    no_background: bool = option("Store no pictures of the empty scene, which left and right otherwise add.", False)


class WorkerOptions(Options):
    """Options on the processes or the cluster that do the work."""

    workers: int = WORKERS()
    cluster: str | None = CLUSTER()


class RecordingOptions(Options):
    """Options that state what a recording does not tell itself: frame rate and image scale."""

    fps: float | None = FPS()
    px_per_m: float | None = option("Pixels per metre of a recording without a camera.", None)


class LabelOptions(RecordingOptions):
    """Options on how labels of people are read from files."""

    person_class: str | None = PERSON_CLASS()


class BoxOptions(LabelOptions):
    """Options on how boxes are read from files."""

    box_scale: str | None = option(
        "Factor of the boxes in MOT texts, except labels, if they are not in pixels of the pictures.", None,
        metavar="X|X,Y")


class DemoOptions(Options, words="demo"):
    """Generate scenes, track them, score the tracks and write a page with the results."""

    quick: bool = option("A quick look: suite quick with one seed, two trackers, one scene with small pictures.", False)
    out: Path = OUT(default=Path("flockscope-demo"))


class ScenariosOptions(Options, words="scenarios"):
    """List scenarios and suites, or explain one with a drawing."""

    name: str | None = ARGUMENT("Scenario, *.toml file or suite to explain.", None, metavar="NAME")
    settings: list[str] = SET()
    out: Path | None = option("Write a drawing of the plan, with the orders.", None, metavar="FILE.svg")


class GenerateOptions(PictureOptions, WorkerOptions, words="generate", run="datasets:generate"):
    """Simulate scenarios and store them as a dataset."""

    names: list[str] = NAMES()
    seeds: str = SEEDS(SEEDS_HELP)
    out: Path = OUT()
    stride: int = option("Store every N-th frame of the camera only.", 1, low=1, metavar="N")
    pack: bool = option("Store shards of up to 100 sequences in place of a folder for each.", False)


class TrackOptions(SceneOptions, BoxOptions, words="track"):
    """Run a tracker and store its tracks."""

    tracker: str = ARGUMENT("Name of a tracker, or file.py:Class, or module:Class.", metavar="TRACKER")
    source: str = ARGUMENT(
        "Sequence or dataset; or live: a camera's number, an address (rtsp://…), a pipe, or - for boxes as JSON lines.",
        metavar="SOURCE")
    out: Path = OUT()
    params: str | None = option(
        "The tracker's parameters: a file, of a policy, too, or a preset: paper.", None, metavar="FILE.toml|PRESET")
    detections: DetectionsOrBoth = option(
        "Detections that the tracker gets. Default: the first of image, file, truth that can be; with --boxes both, if "
        "tracker and source can, else file.", None)
    boxes: Path | None = BOXES()
    grouping: Path | None = GROUPING()
    seed: int = option("The tracker's seed.", 0, low=0)
    camera: Path | None = CAMERA()
    background: str | None = option(
        "Frames a background model is trained on, or a picture of the empty place.", None,
        metavar="first:N|learn:N|spread:N|PICTURE")
    mask: str | None = option(
        "The region that counts: a picture, black elsewhere, or a polygon in px.", None, metavar="PICTURE|X1,Y1,X2,…")
    step_timeout: float | None = STEP_TIMEOUT()
    min_score: float | None = MIN_SCORE()
    follow: float | None = option(
        "Live: read a video while it grows, until it has not for X seconds.", None, low=0, metavar="X")
    stream: bool = option("Live: print each frame's people, groups, events and counts as a line of JSON.", False)
    when_slow: Literal["drop", "wait"] | None = option(
        "Live: a tracker that is slower than the pictures leaves some out, or lets the source wait. Default: wait for "
        "pipes and files, else drop.", None)
    workers: int = PROCESSES()


class GroupOptions(BoxOptions, words="group"):
    """Find who belongs together, and what happened, for people whose ids are known."""

    source: Path = ARGUMENT("Labelled people, MOT text with ids, or output of `track`.", metavar="SOURCE|TRACKS")
    out: Path = OUT()
    grouping: Path | None = GROUPING()
    probabilities: bool = option("Store the probability that two people belong together.", False)
    min_duration: str = MIN_DURATION()
    camera: Path | None = CAMERA()


class CalibrateOptions(BoxOptions, words="calibrate"):
    """Find the camera of a recording, by points on its ground or by the boxes of its people, and write it."""

    source: Path = ARGUMENT("Labelled people, detections, a video, or output of `track`.", metavar="SOURCE|TRACKS")
    out: Path = FILE("Camera to write, for --camera.", metavar="FILE.json")
    points: Path | None = option(
        "Points on the ground, 4 or more: rows u,v (px in the picture), x,y (m). Default: boxes tell the camera.", None,
        metavar="FILE.csv")
    boxes: Path | None = BOXES()
    min_score: float | None = MIN_SCORE()
    image_size: str | None = option(
        "Size of the pictures, px, if the recording does not state it.", None, metavar="WIDTH,HEIGHT")


class ScoreOptions(BoxOptions, words="score"):
    """Score tracks against the truth."""

    truth: Path = ARGUMENT("Labelled sequence or dataset.", metavar="TRUTH")
    tracks: list[str] = ARGUMENT(
        "Output of `track`, MOT text, or a tracker class (file.py:Class), as LABEL=TRACKS with a name. Several are "
        "ranked.", metavar="TRACKS…")
    similarity: Similarity = SIMILARITY()
    group_match: Literal["hull", "members"] = option("How true and estimated groups are compared.", "hull")
    blocks: int = option("Intervals for a single recording, by N draws of blocks of frames.", 0, low=0, metavar="N")
    by: str | None = option(
        "The score that ranks. Default: objective, or what all runs have of it.", None, metavar="SCORE")
    csv: Path | None = option("Write all scores, with mean, interval and pooled row.", None, metavar="FILE.csv")
    workers: int = PROCESSES()


class StressOptions(SceneOptions, WorkerOptions, words="stress"):
    """Play trackers on scenes that get harder, and find where they break, or the scenes in which one is worst."""

    trackers: list[str] = ARGUMENT(
        "Trackers to compare: names, file.py:Class or module:Class, as LABEL=TRACKER with a name.", metavar="TRACKER…")
    vary: list[str] = option(
        "Axis: a name such as detection, or a key of scenarios with its ends. Twice: a matrix.", [],
        metavar="NAME|KEY=EASY:HARD", flag="--vary")
    suite: list[str] = option("Scenario or suite. Can be given several times.", metavar="NAME", flag="--suite")
    seeds: str = SEEDS("Seeds that may be played, from A to B - 1.", "20000:20020")
    out: Path = OUT()
    search: int | None = option(
        "Search N scenes between the ends of all axes for the worst of the first tracker.", None, low=1, metavar="N")
    by: str = option("The score.", "objective", metavar="SCORE")
    share: float = option(
        "A tracker breaks where its score falls to this share of its easy value.", 0.8, low=0.01, high=0.99)
    start: int = option("Seeds that are played at first.", 4, low=2, metavar="N")
    episodes: int | None = option("Stop after about so many episodes.", None, low=1, metavar="N")
    minutes: float | None = option("Stop after about so many minutes.", None, low=0.0, metavar="M")
    detections: Detections = option("Input of the trackers. Default: file, if they can.", None)
    step_timeout: float | None = STEP_TIMEOUT()
    fresh: bool = FRESH()


class MinimizeOptions(Options, words="minimize"):
    """Find the smallest scene in which a tracker still fails, by taking out whatever can be."""

    source: str = ARGUMENT(
        "Output of `track` on a generated sequence below this folder; or a scenario.", metavar="RUN|SCENARIO")
    condition: str = option(
        "A score with a bound, or a kind of error: HOTA<0.7, IDSW>=3, switch, switch:hidden, crash.", flag="--while",
        metavar="CONDITION")
    out: Path = TOML("Scenario to write; a replay page lies beside it.")
    tracker: str | None = option("Tracker of a scenario.", None, metavar="TRACKER")
    seed: int | None = option("Seed of a scenario. Default: 0.", None, low=0)
    confirm: int = option("Number of other seeds on which most must fail, too.", 5, low=0, metavar="N")
    episodes: int | None = option("Stop after so many episodes.", None, low=1, metavar="N")
    minutes: float | None = option("Stop after about so many minutes.", None, low=0.0, metavar="M")


class ErrorsOptions(BoxOptions, words="errors"):
    """List what went wrong in a run: each error with its frames, people, cause and cost, and a sum by cause."""

    truth: Path = ARGUMENT("Labelled sequence or dataset.", metavar="TRUTH")
    tracks: str = ARGUMENT("Output of `track`, MOT text, or a tracker class (file.py:Class).", metavar="TRACKS")
    limit: int = option("Number of errors to show, the dearest first; --json has all.", 20, low=0, metavar="N")
    similarity: Similarity = SIMILARITY()
    workers: int = PROCESSES()


class CompareOptions(Options, words="compare"):
    """Compare stored scores with those of a baseline. Exit code 1 for a regression, 2 if a score is undecided."""

    baseline: Path = ARGUMENT("Scores of `score --json`, or of --save.", metavar="BASELINE.json")
    now: Path = ARGUMENT("Scores of the same sequences.", metavar="NOW.json")
    by: list[str] = option(
        "Score to compare; can be given several times. Default: objective.", [], metavar="SCORE", flag="--by")
    tolerance: float = option("Difference that does not matter.", 0.01, low=0.0)
    save: Path | None = option("Write the compared scores of NOW, as the next baseline.", None, metavar="FILE.json")


class TuneCommandOptions(WorkerOptions, words="tune"):
    """Search a tracker's parameters on simulated scenes; measure the gain on others."""

    tracker: str = tuned("tracker", flag="")
    suite: list[str] = tuned("suite", [])
    like: Path | None = option(
        "Recording with a detector's boxes, whose labels are not read: tune on scenes like it.", None, metavar="SOURCE")
    trials: int = tuned("trials", MISSING)
    seeds: str | None = tuned("seeds")
    validation: str | None = tuned("validation")
    test: str | None = tuned("test")
    check: str | None = tuned("check", None)
    objective: list[str] = tuned("objective", [])
    detections: Detections = tuned("detections")
    similarity: Similarity = tuned("similarity")
    set: list[str] = SET()
    sensor: Path | None = SENSOR()
    only: str | None = tuned("only", None)
    adaptive: int | None = tuned("adaptive")
    out: Path = tuned("out", MISSING)
    storage: str | None = tuned("storage")
    study: str | None = tuned("study")
    step_timeout: float | None = STEP_TIMEOUT()
    finalists: int = tuned("finalists")
    seed: int = tuned("seed")
    fresh: bool = FRESH()


class ReplayCommandOptions(PictureOptions, LabelOptions, words="replay", run="datasets:replay"):
    """Render recorded trajectories: real motion, simulated pictures and detections, exact labels."""

    source: Path = SOURCE()
    out: Path = OUT()
    camera: Path | None = option(
        "Tables [camera], [sensor], [light], [picture], [looks]; each may be absent.", None, metavar="FILE.toml")
    seeds: str = SEEDS("Seeds of bodies, looks and sensor. For real recordings from 20000 on.", "20000")
    start: float = option("Second at which to begin.", 0.0, low=0.0, metavar="S")
    duration: float | None = option("Seconds to replay. Default: up to the end.", None, metavar="S")
    calibration: Path | None = option(
        "Calibration of a recording that has boxes only: camera.json or Tsai's XML.", None, metavar="FILE")


class ViewOptions(BoxOptions, words="view"):
    """Write a page that replays a sequence in the browser: truth, tracks, and pictures if it has any.

    For several sequences also a report on the tracks; two trackers on one sequence are shown beside each other."""

    source: Path = SOURCE()
    tracks: list[str] = ARGUMENT(
        "Output of `track`, MOT text, or a tracker class (file.py:Class), as LABEL=TRACKS with a name.", [],
        metavar="TRACKS…")
    out: Path = FILE("Page to write; for several sequences, a folder.", metavar="FILE.html")
    video: Literal["auto", "inside", "beside", "none"] = option(
        "Pictures inside the page, beside it as FILE.view.mp4, or none. auto: beside from 12 MB on.", "auto")
    by: str | None = option(
        "The score that ranks in a report. Default: objective, or what all runs have of it.", None, metavar="SCORE")
    belief: Path | None = option(
        "Belief whose evidence about two people is shown: file of `fit grouping`. Default: the default belief.", None,
        metavar="FILE.toml", flag="--grouping")
    camera: Path | None = CAMERA()
    workers: int = PROCESSES()


class SheetOptions(BoxOptions, words="sheet", run="view:sheet"):
    """Write a contact sheet: several frames of a sequence in one picture, with the truth or, if given, the tracks."""

    source: Path = SOURCE()
    tracks: Path | None = TRACKS()
    out: Path = FILE("Picture to write; for several sequences, a folder.", metavar="FILE.png")
    frames: int = option("Number of frames to show.", 8, low=1, high=64)


class OverlayOptions(BoxOptions, words="overlay", run="view:overlay"):
    """Write a video with boxes, ids, trails, groups and events drawn over the pictures."""

    source: Path = SOURCE()
    tracks: Path | None = TRACKS()
    out: Path = FILE("Video to write; for several sequences, a folder.", metavar="FILE.mp4")
    truth: Literal["over"] | None = option(
        "Draw the truth over the same picture. Without TRACKS it is drawn alone.", None)
    camera: Path | None = CAMERA()


class ValidateOptions(Options, words="validate", run="datasets:validate"):
    """Check that a dataset or stored tracks are complete, unaltered and consistent."""

    folder: Path = ARGUMENT("A generated sequence or dataset, or stored tracks.", metavar="DIR")


class CocoOptions(Options, words="export coco", run="export:export_coco"):
    """Write a COCO file with track and group ids and masks."""

    folder: Path = ARGUMENT("A sequence, or dataset of one split, with labelled boxes.", metavar="DIR")
    out: Path = FILE("File to write.", metavar="FILE.json")
    person_class: str | None = PERSON_CLASS()
    min_visibility: float = LEAST_VISIBLE(SMALLER.capitalize(), MIN_VISIBILITY)
    part_size: int | None = option(
        "Write files of N sequences each: FILE-0000.json, …. Default: one file.", None, low=1, metavar="N")


class YoloOptions(Options, words="export yolo", run="export:export_yolo"):
    """Write pictures and labels as YOLO reads them."""

    folder: Path = ARGUMENT("A sequence or dataset with pictures and labelled boxes.", metavar="DIR")
    out: Path = OUT()
    person_class: str | None = PERSON_CLASS()
    min_visibility: float = LEAST_VISIBLE(SMALLER.capitalize(), MIN_VISIBILITY)


class KittiOptions(Options, words="export kitti", run="export:export_kitti"):
    """Write pictures or stereo pairs, disparities, calibrations and labels as in KITTI."""

    folder: Path = ARGUMENT("A generated sequence or dataset with pictures.", metavar="DIR")
    out: Path = OUT()
    min_visibility: float = LEAST_VISIBLE(SMALLER.capitalize(), MIN_VISIBILITY)


class MotsOptions(Options, words="export mots", run="export:export_mots"):
    """Write pictures and masks as in MOTS."""

    folder: Path = ARGUMENT("A generated sequence or dataset with the streams left and ids.", metavar="DIR")
    out: Path = OUT()
    min_visibility: float = LEAST_VISIBLE(SMALLER.capitalize(), MIN_VISIBILITY)


class WebdatasetOptions(Options, words="export webdataset", run="export:export_webdataset"):
    """Write tar shards for streaming, in the format of the library webdataset."""

    folder: Path = ARGUMENT("A generated sequence or dataset.", metavar="DIR")
    out: Path = OUT()
    shard_size: str = option("Largest shard, as 500MB or 2GB; a larger sample has its own.", "1GB", metavar="SIZE")
    sample: Literal["sequence", "frame"] = option(
        "What a sample is: all files of a sequence, or the picture and the labels of a frame.", "sequence")
    seed: int | None = option("Seed of the order of frames. Default: 0.", None, low=0)
    min_visibility: float | None = LEAST_VISIBLE(f"Of frames: {SMALLER} Default: {MIN_VISIBILITY:g}.", None)


class TrajnetOptions(LabelOptions, words="export trajnet", run="export:export_trajnet"):
    """Write the positions of people, of tracks or of labels, as TrajNet++ (*.ndjson)."""

    source: Path = ARGUMENT("Output of `track` or `group`, or labelled people.", metavar="RUN|SOURCE")
    out: Path = OUT()


class PedpyOptions(TrajnetOptions, words="export pedpy", run="export:export_pedpy"):
    """Write the positions of people, of tracks or of labels, as a text of PedPy and JuPedSim."""


class CsvOptions(TrajnetOptions, words="export csv", run="export:export_csv"):
    """Write tables of people, groups, members, events, crossings and counts as CSV, of tracks or of labels."""

    line: list[str] = option("Count who crosses a line. Can be given several times.", [], metavar="NAME=X1,Y1,X2,Y2")
    zone: list[str] = option(
        "Count who enters, leaves and is in a polygon. Can be given several times.", [],
        metavar="NAME=X1,Y1,X2,Y2,X3,Y3,…")
    margin: float | None = option(
        "Count people at a line or zone once they are farther than this on the other side. Default: 0.25 m, and at "
        "least 2.5 standard deviations of the tracked position.", None, metavar="M")
    every: str = option("Length of an interval of counts, such as 10s or 1m.", "1m", metavar="DURATION")
    start: str = option("Time at which counts begin.", "0s", metavar="TIME")
    end: str | None = option("Time at which counts end. Default: where the recording ends.", None, metavar="TIME")
    min_duration: str = MIN_DURATION()


class ParquetOptions(CsvOptions, words="export parquet", run="export:export_parquet"):
    """Write tables of people, groups, members, events, crossings and counts as Parquet, of tracks or of labels."""
# fmt: on
