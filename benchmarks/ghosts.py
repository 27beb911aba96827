"""Backgrounds with people who stood, with and without the search for ghosts: scores of `blob` from pixels.

    python -m benchmarks.ghosts [--seeds 20000:20002] [--data FOLDER]

videos: 30 s at FPS frames per second, JPEG of quality 80. Scenes of the catalogue are seen from the side, as bare video
with the scale; streets from above, with their camera. Columns: means over videos of HOTA and MOTA of `blob`; what the
search adds, paired over videos; pixels mended per video, and those of them that were foreground and show a person.
pets: PETS09-S2L1-first200. Each figure is a mean over RATES of `detection_rate`, as a small change of it moves HOTA by
0.03. One recording: indicative.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from functools import partial
from multiprocessing import get_context
from pathlib import Path

import numpy as np

import tracking
from benchmarks.support.in_memory import people_in_view
from benchmarks.support.options import PETS, add_data, add_seeds, new_parser
from benchmarks.support.replaced_code import replaced_code
from benchmarks.support.tables import difference_cell, head, row
from scenarios import load
from sim import simulate
from sim.pictures.background_sample import parse_choice
from sim.types import Array, Bools, Frame, Sequence
from tracking.detect import foreground as pipeline_module
from tracking.detect.background import Background
from tracking.detect.foreground import Foreground, Segmented
from tracking.recordings.source import open_source
from tracking.running.run import track

FPS, SECONDS = 7, 30
VIEW = ("tilt_deg=20", "image=[480,360]", "focal_px=600", "crop=true", "baseline=0")
SIDE, STREETS = ("party", "queue", "mixed"), ("stop", "signal", "square")
SAMPLES = "spread:50", "first:50", "first:100"
SEARCHES = False, True
RATES = 0.999, 0.9993, 0.9995, 0.9997, 0.9998
WORKERS = 2


def main() -> None:
    parser = new_parser(__doc__)
    add_data(parser)
    add_seeds(parser, "20000:20002")
    given = parser.parse_args()
    jobs = [(name, seed) for name in (*SIDE, *STREETS) for seed in given.seeds]
    rows_of(f"{len(jobs)} videos", jobs, of_video)
    rows_of("PETS, one recording: indicative", [(given.data / PETS, rate) for rate in RATES], of_pets)


def rows_of(title: str, jobs: Iterable[tuple[object, ...]], of: Callable[..., Array]) -> None:
    """Prints a row for each of SAMPLES; of(*job) returns HOTA, MOTA, pixels mended, and those of people, for each
    sample, without and with the search (S, 2, 4)."""
    with ProcessPoolExecutor(WORKERS, get_context("spawn")) as pool:
        found = np.stack(list(pool.map(of, *zip(*jobs, strict=True))))
    head([title, "HOTA without", "HOTA", "added", "MOTA without", "MOTA", "added", "mended, px", "of people, px"])
    for k, sample in enumerate(SAMPLES):
        without, with_search = found[:, k, 0], found[:, k, 1]
        means, added = (without.mean(0), with_search.mean(0)), with_search - without
        ends = [difference_cell(added[:, n], score) for n, score in enumerate(("HOTA", "MOTA"))]
        scores = [[f"{means[0][n]:.3f}", f"{means[1][n]:.3f}", ends[n]] for n in (0, 1)]
        row([sample, *scores[0], *scores[1], f"{means[1][2]:.0f}", f"{means[1][3]:.0f}"])


def of_video(name: str, seed: int) -> Array:
    """Returns what `rows_of` needs, of one video."""
    street = name in STREETS
    source = f"scenarios/suites/streets/{name}.toml" if street else name
    view = [] if street else [f"camera.{s}" for s in VIEW]
    whole = simulate(load(source, set=[*view, f"camera.fps={FPS}", "picture.jpeg=80"]), seed)
    video = people_in_view(whole, SECONDS * FPS)
    if not street:
        video = replace(video, camera=None, scene=None)
    images = [frame.image for frame in video.frames()]
    samples = [np.stack([images[n - 1] for n in parse_choice(text).indices(len(images))]) for text in SAMPLES]
    people = partial(people_pixels, whole)
    return np.array(
        [[measure(with_sample(video, sample), {}, search, people) for search in SEARCHES] for sample in samples]
    )


def with_sample(video: Sequence, sample: Array) -> Sequence:
    return replace(video, load_background=lambda: sample)


def people_pixels(whole: Sequence, index: int) -> Bools:
    return np.asarray(whole.load_pixels(index).ids > 0)  # type: ignore[misc]


def of_pets(folder: Path, rate: float) -> Array:
    """Returns what `rows_of` needs, of PETS at a `detection_rate`; people are the labelled boxes."""
    found = []
    for sample in SAMPLES:
        sequence = open_source(folder, images=True, background=sample)[0]
        people = partial(labelled_pixels, sequence)
        found.append([measure(sequence, {"detection_rate": rate}, search, people) for search in SEARCHES])
    return np.array(found)


def labelled_pixels(sequence: Sequence, index: int) -> Bools:
    truth, (wide, high) = sequence.truth, sequence.image_size or (0, 0)
    assert truth is not None
    inside = np.zeros((high, wide), bool)
    for left, top, w, h in truth.box[truth.frame == index].round().astype(int):
        inside[max(top, 0) : top + h, max(left, 0) : left + w] = True
    return inside


def measure(video: Sequence, params: dict[str, object], search: bool, people: Callable[[int], Bools]) -> list[float]:
    """Returns HOTA, MOTA, pixels mended, and pixels mended that were foreground and show a person.

    people(index): the pixels of people in frame `index`.
    """
    shown, mended, of_people = 0, 0, 0
    foreground = np.zeros(())
    mend, adapt = Background.mend, Foreground.adapt

    def watched(pipeline: Foreground, seen: Segmented, protected: Bools) -> None:
        nonlocal foreground
        foreground = seen.mask
        adapt(pipeline, seen, protected)

    def counted(model: Background, where: Bools, colour: Array) -> None:
        nonlocal mended, of_people
        if shown:  # not in training
            mended += int(np.count_nonzero(where))
            of_people += int(np.count_nonzero(where & foreground & people(shown)))
        mend(model, where, colour)  # type: ignore[arg-type]

    def frames() -> Iterator[Frame]:
        nonlocal shown
        for frame in video.frames():
            shown = frame.index
            yield frame

    changes = [(Background, "mend", counted), (Foreground, "adapt", watched)]
    with replaced_code(changes if search else [*changes, (pipeline_module, "Ghosts", lambda *_: None)]):
        run = track("blob", replace(video, frames=frames), params=params, detections="image")
    assert video.truth is not None
    scores = tracking.evaluate(video.truth, run, similarity="boxes")
    return [float(scores["HOTA"]), float(scores["MOTA"]), mended, of_people]


if __name__ == "__main__":
    main()
