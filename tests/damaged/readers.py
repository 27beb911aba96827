"""Reads a damaged input the way the commands do: opens it, then reads frames, truth, background, groups and events."""

from __future__ import annotations

from collections.abc import Callable
from itertools import islice
from pathlib import Path

SHOWN = 20
"""Frames of a recording that are read."""
SIMULATED = 500
"""Most frames times people of a scenario that is simulated."""


def _scenario(folder: Path) -> None:
    from scenarios import load
    from scenarios.loading.resolve import dump

    dump(load(folder / "scene.toml"))


def _simulated(folder: Path) -> None:
    from scenarios import load
    from scenarios.loading.checks import most_people
    from sim.sequence import simulate

    scenario = load(folder / "scene.toml")
    if most_people(scenario) * scenario.duration * scenario.camera.fps > SIMULATED:
        return
    sequence = simulate(scenario, 40_000)
    list(islice(sequence.without_pictures(), SHOWN))
    _ = sequence.truth
    if sequence.image_size is not None and max(sequence.image_size) <= 256:
        list(islice(sequence.frames(), 2))


def _suite(folder: Path) -> None:
    from scenarios.loading.resolve import resolve

    resolve(str(folder / "suite.toml"))


def _setting(folder: Path) -> None:
    from scenarios import load

    load("merge", set=[_text(folder / "setting.txt")])


def _tracker_setting(folder: Path) -> None:
    from tracking.papers.blob.config import BlobConfig

    BlobConfig().with_set(_text(folder / "setting.txt"))


def _text(path: Path) -> str:
    """Returns a text as the command line gives it: bytes that are not UTF-8 become surrogates."""
    return path.read_bytes().replace(b"\0", b"").decode("utf-8", "surrogateescape")


def _parameters(folder: Path) -> None:
    from tracking.papers.blob.config import BlobConfig

    BlobConfig.from_toml(folder / "params.toml").to_toml()


def _sensor(folder: Path) -> None:
    from scenarios import load, sensor_settings

    load("merge", set=sensor_settings(folder / "sensor.toml"))


def _observation(folder: Path) -> None:
    from scenarios.loading.resolve import load_observation

    load_observation(folder / "view.toml")


def _camera(name: str) -> Callable[[Path], None]:
    def read(folder: Path) -> None:
        import numpy as np

        from sim.io.formats.calibration import read_calibration
        from sim.scene.camera import ground_jacobian, px_per_m_at_centre, to_ground

        camera = read_calibration(folder / name)
        foot = np.array([[camera.centre_px[0], camera.image[1]]])
        to_ground(camera, foot)
        ground_jacobian(camera, foot)
        px_per_m_at_centre(camera)

    return read


def _source(name: str = "") -> Callable[[Path], None]:
    def read(folder: Path) -> None:
        from sim.io.source import open_source

        for sequence in open_source(folder / name if name else folder):
            list(islice(sequence.frames(), SHOWN))
            list(islice(sequence.without_pictures(), SHOWN))
            _ = sequence.truth
            sequence.background()

    return read


def _tracks(folder: Path) -> None:
    from sim.io.store.track_files import read_tracks

    read_tracks(folder)


def _run(folder: Path) -> None:
    from sim.io.store.track_files import read_tracks
    from tracking.app.stored_tracks import find_tracks

    for stored in find_tracks(folder):
        read_tracks(stored.path)


def _events(folder: Path) -> None:
    from sim.io.store.group_files import read_events

    read_events(folder / "events.json")


def _groups(folder: Path) -> None:
    from sim.io.store.group_files import read_groups_csv

    read_groups_csv(folder / "groups.csv", 4)


def _near(folder: Path) -> None:
    from sim.io.store.group_files import read_near

    read_near(folder / "near.csv")


def _script(folder: Path) -> None:
    from sim.io.store.group_files import read_script

    read_script(folder / "script.json")


def _scene(folder: Path) -> None:
    from sim.io.store.camera_files import read_scene

    read_scene(folder / "scene.json")


def _truth(folder: Path) -> None:
    from sim.io.store.truth_files import read_detections, read_truth

    read_truth(folder)
    read_detections(folder / "det" / "det.parquet")


def _study(folder: Path) -> None:
    from tests.damaged.specimens import study_plan
    from tracking.tuning.study import open_study

    with open_study(study_plan(), folder / "study.journal", "damaged") as study:
        study.records()
        study.finished()


READERS: dict[str, Callable[[Path], None]] = {
    "scenario": _scenario,
    "extended scenario": _scenario,
    "simulated scenario": _simulated,
    "suite": _suite,
    "setting": _setting,
    "tracker setting": _tracker_setting,
    "parameters": _parameters,
    "sensor profile": _sensor,
    "observation": _observation,
    "camera json": _camera("camera.json"),
    "camera xml": _camera("camera.xml"),
    "camera yaml": _camera("pair.yml"),
    "biwi": _source(),
    "caviar": _source("walk.xml"),
    "mot": _source(),
    "mot text": _source("people.txt"),
    "trajnet": _source("walk.ndjson"),
    "eth": _source("walk.txt"),
    "pedpy": _source("walk.txt"),
    "labelled text": _source("people.csv"),
    "tracks text": _tracks,
    "events": _events,
    "groups": _groups,
    "near": _near,
    "script": _script,
    "scene": _scene,
    "pictures": _source(),
    "video": _source(),
    "dataset": _source(),
    "truth": _truth,
    "run": _run,
    "study": _study,
}
"""What reads an input of each kind, given its folder."""
FILES = {"truth": ("gt/", "det/")}
"""Kinds whose files are those of `dataset`, damaged without its manifest: beginnings of their names."""
