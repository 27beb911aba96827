"""The options of the commands `fit …`, as those in `command_options`."""

from __future__ import annotations

from pathlib import Path

from tracking.app.command_options import (
    ARGUMENT,
    BOXES,
    CAMERA,
    FPS,
    MIN_SCORE,
    NAMES,
    SEEDS,
    SEEDS_HELP,
    SOURCE,
    TOML,
    BoxOptions,
    Options,
)  # fmt: skip
from tracking.keyword_options import option

ABOUT = "Fit a model to recordings or simulated scenes."

# fmt: off


class FitSensorOptions(Options, words="fit sensor", run="fit:fit_sensor"):
    """Measure the errors of a detector, so that simulated detections have the same errors."""

    sources: list[Path] = ARGUMENT("Recordings with gt and det, pooled.", metavar="SOURCE…")
    out: Path = TOML("File to write: a [sensor] table.")
    fps: float | None = FPS()


class FitSceneOptions(BoxOptions, words="fit scene", run="fit:fit_scene"):
    """Write a scenario in which people walk as in a recording, seen by a camera and a detector like its own."""

    source: Path = SOURCE()
    out: Path = TOML("File to write: a scenario.")
    labels: bool = option("Take people and the detector's errors from labels. Default: from detections alone.", False)
    boxes: Path | None = BOXES()
    min_score: float | None = MIN_SCORE()


class FitJointOptions(Options, words="fit joint", run="fit:fit_joint"):
    """Learn the merges and splits of the tracker joint from simulated truth."""

    names: list[str] = NAMES()
    out: Path = TOML("File to write: parameters of joint, for --params.")
    seeds: str = SEEDS("Seeds of the scenes to fit to.", "30000:30002")


class FitGroupingOptions(FitJointOptions, BoxOptions, words="fit grouping", run="fit:fit_grouping"):
    """Fit the belief of who belongs together to simulated scenes, or adapt it to a place by answers about pairs."""

    names: list[str] = ARGUMENT(
        "Scenarios, *.toml files or suites; with --labels, the recordings or tracks of the answers.",
        metavar="NAME…|SOURCE…")
    out: Path = TOML("File to write, for --grouping.")
    labels: list[Path] = option(
        "Answers that a page of `view` saved. The default belief is adapted to them. Can be given several times.", [],
        metavar="FILE.json", flag="--labels")
    events: list[str] = option(
        "Fit the log-odds of events to this scenario or suite. Can be given several times. Default: the NAMEs.", [],
        metavar="NAME", flag="--events")
    camera: Path | None = CAMERA()


class FitRelationalOptions(Options, words="fit relational", run="fit:fit_relational"):
    """Learn the speed table of the tracker relational from simulated truth."""

    names: list[str] = NAMES()
    out: Path = TOML("File to write: parameters of relational, for --params.")
    seeds: str = SEEDS(SEEDS_HELP, "30000:30004")
# fmt: on
