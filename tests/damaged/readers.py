"""Reads a damaged input the way the commands do: opens it, then reads frames, truth, background, groups and events."""

from __future__ import annotations

from collections.abc import Callable
from itertools import islice
from pathlib import Path

import numpy as np

from scenarios import load, sensor_settings
from scenarios.loading.checks import most_people
from scenarios.loading.resolve import dump, load_observation, resolve
from sim.scene.camera import ground_jacobian, px_per_m_at_centre, to_ground
from sim.sequence import simulate
from sim.store.camera_files import read_scene
from sim.store.group_files import read_events, read_groups_csv, read_near, read_script
from sim.store.truth_files import read_detections, read_truth
from tests.damaged.specimens import study_plan
from tracking.app.stored_tracks import find_tracks
from tracking.papers.blob.config import BlobConfig
from tracking.recordings.calibration import read_calibration
from tracking.recordings.source import open_source
from tracking.recordings.track_texts import read_tracks
from tracking.tuning.study import open_study

# Frames of a recording that are read.
SHOWN = 20
# Most frames times people of a scenario that is simulated.
SIMULATED = 500


def _scenario(folder: Path) -> None:
    dump(load(folder / "scene.toml"))


def _simulated(folder: Path) -> None:
    scenario = load(folder / "scene.toml")
    if most_people(scenario) * scenario.duration * scenario.camera.fps > SIMULATED:
        return
    sequence = simulate(scenario, 40_000)
    list(islice(sequence.without_pictures(), SHOWN))
    _ = sequence.truth
    if sequence.image_size is not None and max(sequence.image_size) <= 256:
        list(islice(sequence.frames(), 2))


def _setting(folder: Path) -> str:
    """Returns a text as the command line gives it: bytes that are not UTF-8 become surrogates."""
    return (folder / "setting.txt").read_bytes().replace(b"\0", b"").decode("utf-8", "surrogateescape")


def _camera(name: str) -> Callable[[Path], None]:
    def read(folder: Path) -> None:
        camera = read_calibration(folder / name)
        foot = np.array([[camera.centre_px[0], camera.image[1]]])
        to_ground(camera, foot)
        ground_jacobian(camera, foot)
        px_per_m_at_centre(camera)

    return read


def _source(name: str = "", boxes: str | None = None) -> Callable[[Path], None]:
    def read(folder: Path) -> None:
        for sequence in open_source(folder / name, boxes=None if boxes is None else folder / boxes):
            list(islice(sequence.frames(), SHOWN))
            list(islice(sequence.without_pictures(), SHOWN))
            _ = sequence.truth
            sequence.background()

    return read


def _truth(folder: Path) -> None:
    read_truth(folder)
    read_detections(folder / "det" / "det.parquet")


def _study(folder: Path) -> None:
    with open_study(study_plan(), folder / "study.journal", "damaged") as study:
        study.records()
        study.finished()


# What reads an input of each kind, given its folder.
READERS: dict[str, Callable[[Path], object]] = {
    "scenario": _scenario,
    "extended-scenario": _scenario,
    "simulated-scenario": _simulated,
    "suite": lambda folder: resolve(str(folder / "suite.toml")),
    "setting": lambda folder: load("merge", set=[_setting(folder)]),
    "tracker-setting": lambda folder: BlobConfig().with_set(_setting(folder)),
    "parameters": lambda folder: BlobConfig.from_toml(folder / "params.toml").to_toml(),
    "sensor-profile": lambda folder: load("merge", set=sensor_settings(folder / "sensor.toml")),
    "observation": lambda folder: load_observation(folder / "view.toml"),
    "camera-json": _camera("camera.json"),
    "camera-xml": _camera("camera.xml"),
    "camera-yaml": _camera("pair.yml"),
    "camera-ros": _camera("camera.yaml"),
    "biwi": _source(),
    "caviar": _source("walk.xml"),
    "mot": _source(),
    "mot-text": _source("people.txt"),
    "trajnet": _source("walk.ndjson"),
    "coco-results": _source("walk.ndjson", "walk.json"),
    "eth": _source("walk.txt"),
    "kitti": _source("0012.txt"),
    "pedpy": _source("walk.txt"),
    "stanford": _source("annotations.txt"),
    "timed-text": _source("walk.csv"),
    "labelled-text": _source("people.csv"),
    "tracks-text": read_tracks,
    "events": lambda folder: read_events(folder / "events.json"),
    "groups": lambda folder: read_groups_csv(folder / "groups.csv", 4),
    "near": lambda folder: read_near(folder / "near.csv"),
    "script": lambda folder: read_script(folder / "script.json"),
    "scene": lambda folder: read_scene(folder / "scene.json"),
    "pictures": _source(),
    "video": _source(),
    "dataset": _source(),
    "truth": _truth,
    "run": lambda folder: [read_tracks(stored.path) for stored in find_tracks(folder)],
    "study": _study,
}
# Kinds whose files are those of `dataset`, damaged without its manifest: beginnings of their names.
FILES = {"truth": ("gt/", "det/")}
