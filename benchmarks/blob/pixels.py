"""Mode `pixels` of `benchmarks.blob`: on PETS and on rendered scenes, with parts of the tracker switched off.

Rows "…, no looks": nobody's colours are learned.
Columns: HOTA, DetA, AssA, MOTA, IDF1 (means over sequences).
pets: PETS09-S2L1-first200, by IoU of boxes; the background sample spread over the recording, and its first 50 frames.
With the calibration View_001.xml also by the position on the ground (similarity 1 - d / 2 m, 0.5 at 1 m).
rendered: scenes of the catalogue under a camera like that of PETS (480 x 360, 7 frames/s, tilts of 15 and 20 degrees,
JPEG of quality 80), once with camera and empty background, once as bare video with a background spread over it.
hall, standing: people who stand, as bare video (hall.toml: 1280 x 720, 25 frames/s, 40 people on a grey floor, a third
stand; standing.toml: 640 x 480, 10 frames/s, 60 s). Columns as above.
In a standing clip people stand for the first 20 s, or, of the same seeds, for the first 48 s. The last row has a
picture of the empty place.
above: seen from straight above at 20 px per m, and the friends-meet scenes at 40 px per m, from pixels and from boxes.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np

import tracking
from benchmarks.support.in_memory import people_in_view, truth_in_view
from benchmarks.support.replaced_code import replaced_code
from benchmarks.support.tables import head, row
from scenarios.loading.resolve import load
from sim.pictures.background_sample import BackgroundChoice, with_copies
from sim.sequence import simulate
from sim.types import Frame, Image
from sim.types import Sequence as Recording
from tracking.papers.blob import person_look_kernels
from tracking.papers.blob.config import BlobConfig
from tracking.recordings.source import open_source
from tracking.running.run import track

KEYS = "HOTA", "DetA", "AssA", "MOTA", "IDF1"
ABLATIONS: dict[str, dict[str, object]] = {
    "blob": {},
    "no splitting, no person size": {"split": False},
    "managed by rho": {"management": "rho"},
    "preset `paper`": dict(BlobConfig.load("paper").as_dict()),
}
NO_LOOKS = (person_look_kernels, "learn", lambda *_: None)
SCENES = (("street", 15), ("street", 20), ("cross", 15), ("mixed", 15), ("pillar", 20), ("split", 15), ("crowd", 20))
VIEW = ("image=[480,360]", "fps=7", "focal_px=600", "crop=true", "baseline=0")
ABOVE = {
    "20 px per m": [(name, ['camera.kind="top"']) for name in ("merge", "cross")],
    "Friends Meet, 40 px per m": [
        (f"scenarios/suites/friends-meet/{name}.toml", []) for name in ("merge", "queue", "hard-party")
    ],
}
LONGEST = 120  # frames of a rendered scene
HERE = Path(__file__).parent
HALL: dict[str, list[str]] = {"hall": []}
STANDING = {
    f"standing for {time} s": [f"group.{who}.stops.0.until=[{time}]" for who in ("alone", "talk")] for time in (20, 48)
}


def pixels(parts: Sequence[str], pets_folder: Path, seeds: range) -> None:
    """Prints the tables of the chosen parts."""
    if "pets" in parts:
        pets(pets_folder)
    if "rendered" in parts:
        rendered(seeds)
    if "hall" in parts:
        people_who_stand("hall", HALL, seeds)
    if "standing" in parts:
        people_who_stand("standing", STANDING, seeds)
    if "above" in parts:
        above(seeds)


def mean_scores(
    sequences: Sequence[Recording], params: dict[str, object], similarity: str = "boxes", mode: str = "image"
) -> list[str]:
    """Returns the cells of a row: means of the scores over the sequences."""
    scores = []
    for sequence in sequences:
        run = track("blob", sequence, params=params, detections=mode)  # type: ignore[arg-type]
        assert sequence.truth is not None
        found = tracking.evaluate(sequence.truth, run, similarity=similarity)
        scores.append([found[k] for k in KEYS])
    return [f"{v:.3f}" for v in np.mean(scores, 0)]


def pets(folder: Path) -> None:
    for background, ablations in (("spread:50", ABLATIONS), ("first:50", {"blob": {}})):
        head([f"PETS, background {background}", *KEYS])
        sequence = open_source(folder, images=True, background=background)[0]
        ablation_rows([sequence], ablations)
    head(["PETS with View_001.xml, background spread:50", *KEYS])
    sequence = open_source(folder, images=True, camera=folder / "View_001.xml")[0]
    for similarity in ("boxes", "ground"):
        row([similarity, *mean_scores([sequence], {}, similarity)])


def rendered(seeds: range) -> None:
    for bare in (False, True):
        made = [rendered_scene(name, tilt, seed, bare) for name, tilt in SCENES for seed in seeds]
        head(["rendered, " + ("bare video" if bare else "camera and empty background"), *KEYS])
        ablation_rows(made, ABLATIONS)


def ablation_rows(made: Sequence[Recording], ablations: dict[str, dict[str, object]]) -> None:
    """Prints a row for each set of parameters, and one like the first row without looks."""
    for title, params in ablations.items():
        row([title, *mean_scores(made, params)])
    title, params = next(iter(ablations.items()))
    with replaced_code([NO_LOOKS]):
        row([f"{title}, no looks", *mean_scores(made, params)])


def rendered_scene(name: str, tilt: int, seed: int, bare: bool) -> Recording:
    """Returns a rendered scene with its pictures in memory; bare: without camera, background spread over the video."""
    settings = [f"camera.{s}" for s in (f"tilt_deg={tilt}", *VIEW)]
    live = simulate(load(name, set=[*settings, "picture.jpeg=80"]), seed)
    video = people_in_view(live, LONGEST)
    if not bare:
        return video
    return replace(with_spread_background(video), camera=None, scene=None, px_per_m=float("nan"))


def with_spread_background(video: Recording) -> Recording:
    """Returns a video with 50 of its pictures as the background sample."""
    frames = list(video.frames())
    spread = np.stack([frames[k].image for k in np.linspace(0, len(frames) - 1, 50).astype(int)])
    return replace(video, load_background=lambda: spread)


def people_who_stand(name: str, clips: dict[str, list[str]], seeds: range) -> None:
    head([f"{name}, bare video", *KEYS])
    for title, settings in clips.items():
        made = [encoded(simulate(load(HERE / f"{name}.toml", set=settings), seed)) for seed in seeds]
        ablation_rows([video for video, _ in made], {title: {}})
    row([f"{title}, picture of the empty place", *mean_scores([with_picture(*each) for each in made], {})])


def encoded(live: Recording) -> tuple[Recording, Image]:
    """Returns a simulated sequence as bare video with its pictures in memory as JPEG, and its first empty picture."""
    codes = [cv2.imencode(".jpg", frame.image, [cv2.IMWRITE_JPEG_QUALITY, 95])[1] for frame in live.frames()]

    def picture(k: int) -> Image:
        return np.asarray(cv2.imdecode(codes[k - 1], cv2.IMREAD_COLOR), np.uint8)

    def frames() -> Iterator[Frame]:
        return (Frame(k, (k - 1) / live.fps, image=picture(k)) for k in range(1, len(codes) + 1))

    def sample() -> Image:
        return np.stack([picture(k) for k in BackgroundChoice().indices(len(codes))])

    empty = live.background()
    assert empty is not None
    truth = truth_in_view(live, len(codes))
    video = replace(
        live, frames=frames, load_truth=lambda: truth, bare=None, load_pixels=None, load_background=sample, camera=None,
        scene=None, px_per_m=float("nan"),
    )  # fmt: skip
    return video, empty[0]


def with_picture(video: Recording, empty: Image) -> Recording:
    sample = video.background()
    assert sample is not None
    return replace(video, load_background=lambda: with_copies(sample, empty))


def above(seeds: range) -> None:
    head(["from straight above", *KEYS])
    for title, scenes in ABOVE.items():
        made = [simulate(load(name, set=settings), seed) for name, settings in scenes for seed in seeds]
        for mode, what in (("image", "pixels"), ("file", "boxes")):
            for variant in ("blob", "preset `paper`"):
                row([f"{title}, {what}, {variant}", *mean_scores(made, ABLATIONS[variant], mode=mode)])
