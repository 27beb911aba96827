"""Whole inputs of every kind, which the readers accept: the files in `texts`, and files that the commands made."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from tests.small_videos import write_video

if TYPE_CHECKING:
    from tracking.tuning.search_plan import SearchPlan

TEXTS = Path(__file__).parent / "texts"
MADE = """schema = 1
duration = 1.0
camera = { fps = 5, image = [64, 48], focal_px = 60.0 }
group = [{ id = "a", size = 2, start = [4, 4], goal = [12, 4], repeat = 1 }]
"""
# Kinds of input that are texts: the names of their folders below TEXTS.
KINDS = sorted(folder.name for folder in TEXTS.iterdir())


def write_specimens(root: Path) -> dict[str, Path]:
    """Writes all whole inputs below the folder `root`; returns the folder of each, by kind.

    Besides the texts these are: pictures, video, dataset (a stored sequence), run (stored tracks), study (of `tune`).
    """
    return write_texts(root) | _pictures(root) | _made(root) | {"study": _study(root / "study")}


def write_texts(root: Path) -> dict[str, Path]:
    """Copies the inputs of TEXTS below the folder `root`; returns the folder of each, by kind."""
    return {kind: Path(shutil.copytree(TEXTS / kind, root / kind)) for kind in KINDS}


def _pictures(root: Path) -> dict[str, Path]:
    import cv2

    pictures, video = root / "pictures", root / "video"
    (pictures / "img1").mkdir(parents=True)
    video.mkdir()
    images = [np.random.default_rng(k).integers(0, 255, (48, 64, 3), np.uint8) for k in range(4)]
    for k, (image, suffix) in enumerate(zip(images, ("png", "jpg", "bmp", "tif"), strict=True), 1):
        cv2.imwrite(str(pictures / "img1" / f"{k:06d}.{suffix}"), image)
    shutil.copy(TEXTS / "mot" / "seqinfo.ini", pictures)
    return {"pictures": pictures, "video": _video(video, images)}


def _video(folder: Path, images: list[np.ndarray]) -> Path:
    for name, codec in (("walk.mp4", "libx264"), ("walk.avi", "mjpeg"), ("walk.mkv", "mpeg4")):
        write_video(folder / name, images, codec=codec, pix_fmt="yuvj420p" if codec == "mjpeg" else "yuv420p")
    return folder


def _made(root: Path) -> dict[str, Path]:
    """Runs `generate` and `track` and returns the folders of the sequence and of its tracks."""
    from tracking.app.cli import run

    scene, data, runs = root / "made.toml", root / "data", root / "runs"
    scene.write_text(MADE, encoding="utf-8")
    more = ["--streams", "left,ids,disparity", "--images", "png"]
    assert run(["generate", str(scene), "--seeds", "40000", "--out", str(data), *more]) == 0
    (sequence,) = [path.parent for path in data.rglob("manifest.json")]
    track = ["track", "group-pda", str(sequence), "--detections", "file", "--out", str(runs)]
    assert run(track) == 0
    (tracks,) = [path.parent for path in runs.rglob("tracks.parquet")]
    return {"dataset": Path(shutil.move(sequence, root / "dataset")), "run": Path(shutil.move(tracks, root / "run"))}


def study_plan() -> SearchPlan:
    """Returns the plan of the search whose study is damaged; its trials are never played."""
    from tracking.tuning.options import TuneOptions
    from tracking.tuning.search_plan import search_plan

    seeds = {"seeds": range(2), "validation": range(10_000, 10_002), "test": range(20_000, 20_002)}
    return search_plan(TuneOptions(tracker="blob", suite="merge", check="split", trials=4, objective="HOTA", **seeds))


def _study(folder: Path) -> Path:
    from tracking.tuning.study import open_study

    folder.mkdir()
    with open_study(study_plan(), folder / "study.journal", "damaged") as study:
        for value in (0.1, 0.2, 0.3):
            asked = study.ask()
            assert asked is not None
            study.tell(asked, [value])
    return folder
