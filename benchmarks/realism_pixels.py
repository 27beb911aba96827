"""Do our pictures look like real video? A blind comparison of what a detector would measure: people, and what is still.

    PYTHONPATH=. python benchmarks/realism_pixels.py [--data ../shared/data] [--seeds 6] [--png FILE]

PETS 2009 S2.L1 view 1, first 200 frames (480 × 360), against pictures of ours at a camera of the same size and much the
same height and tilt: 8 people who walk, JPEG of quality 80. The background is the median of the frames in both. In each
labelled box that is whole in the image and shares less than a tenth with others: contrast, the mean over its differing
pixels of |pixel - background| in grey levels (per channel, and relative to the background); the share of the box that
differs by more than 3 sd of the noise in some channel, and by more than CLEAR levels; its height in px. Noise is the sd
over time of pixels that no box touches. W is the Wasserstein distance of the two distributions, in units of PETS's sd.

Then how still the background is: of each pixel the largest sd over time of its colours, over all frames (`sd`) and from
one frame to the next (`step`, over √2), where no labelled box, grown by GROWN px, is in more than half of the frames;
frames in which one is do not count. Shadows that reach further count in both. Ours with several settings.
"""

from __future__ import annotations

import argparse
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.stats import wasserstein_distance

from scenarios.schema.picture import Light, Picture
from scenarios.schema.scenario import Scenario
from sim.crowd.world import run
from sim.render.renderer import make_renderer
from sim.scene.camera_placement import place_camera
from sim.truth.label import bodies

PETS = "mot/PETS09-S2L1-first200"
CAMERA = {"image": [480, 360], "focal_px": 560, "tilt_deg": 15, "height": 6.5, "crop": True, "fps": 7}
CLEAR = 20
GROWN = 16
WAYS = {
    "ours, still": (Light(), Picture(jpeg=80)),
    "clouds 0.02": (Light(cloud=0.02), Picture(jpeg=80)),
    "foliage 0.05": (Light(), Picture(jpeg=80, foliage=0.05)),
    "foliage, sway 4 px": (Light(), Picture(jpeg=80, foliage=0.05, sway_px=4.0)),
    "all, noise 1": (Light(cloud=0.02), Picture(jpeg=80, foliage=0.05, sway_px=4.0, noise=1.0)),
}
NAMES = (
    "contrast B",
    "contrast G",
    "contrast R",
    "contrast, relative",
    "differs by 3 sd",
    "differs by 20",
    "height, px",
)


@dataclass(frozen=True)
class Film:
    """frames (T, H, W, 3) uint8; boxes: per frame (N, 4) ltwh px."""

    frames: np.ndarray
    boxes: list[np.ndarray]


def pets(data: Path) -> Film:
    import cv2

    files = sorted((data / PETS / "img1").glob("*.jpg"))
    rows = np.loadtxt(data / PETS / "gt" / "gt.txt", delimiter=",")
    frames = np.stack([cv2.imread(str(file)) for file in files])
    return Film(frames, [rows[rows[:, 0] == k + 1, 2:6] for k in range(len(files))])


def ours(seed: int, picture: Picture, light: Light | None = None, frames: int = 100) -> Film:
    """People who cross a square, each on a way of their own."""
    place = [{"uniform": [-2, 12]}, {"uniform": [2, 20]}]
    group = [{"id": "g", "size": 1, "start": place, "goal": place, "at_goal": "walk", "repeat": 8}]
    world = {"size": [10, 22]}
    keys = {"schema": 1, "name": "pets-like", "group": group, "duration": frames / 7, "camera": CAMERA, "world": world}
    scenario = Scenario.model_validate(keys)
    motion = run(scenario, seed)
    camera = place_camera(scenario.camera, motion)
    made, truth = make_renderer(motion, camera, light or scenario.light, picture), bodies(motion, camera)
    assert truth.box is not None
    boxes = [b[np.isfinite(b).all(axis=1)] for b in (truth.box[truth.rows(k + 1)] for k in range(frames))]
    return Film(np.stack([made.frame(k + 1) for k in range(frames)]), boxes)


def apart(boxes: np.ndarray, size: tuple[int, int]) -> np.ndarray:
    """Boxes wholly in the image that share less than a tenth of their area with each other."""
    low, high = boxes[:, :2], boxes[:, :2] + boxes[:, 2:]
    both = np.clip(np.minimum(high[:, None], high) - np.maximum(low[:, None], low), 0, None).prod(axis=2)
    shared = (both / boxes[:, 2:].prod(axis=1)[:, None])[~np.eye(len(boxes), dtype=bool)].reshape(len(boxes), -1)
    inside = (low >= 0).all(axis=1) & (high <= (size[1], size[0])).all(axis=1)
    return boxes[inside & (shared < 0.1).all(axis=1)]


def measure(film: Film) -> tuple[np.ndarray, float]:
    """(people, NAMES) of all frames, and the sd of the noise."""
    background = np.median(film.frames[::2], axis=0)
    noise = sd_of_noise(film)
    size, rows = film.frames.shape[1:3], []
    for frame, boxes in zip(film.frames, film.boxes, strict=True):
        for left, top, width, height in apart(boxes, size):
            part = np.s_[round(top) : round(top + height), round(left) : round(left + width)]
            off, there = np.abs(frame[part] - background[part]), background[part]
            differs = (off > 3 * noise).any(axis=2)
            if differs.any():
                mean = off[differs].mean(axis=0)
                relative = (off[differs] / np.maximum(there[differs], 16)).mean()
                clearly = (off > CLEAR).any(axis=2).mean()
                rows.append([*mean, relative, differs.mean(), clearly, height])
    return np.array(rows), noise


def sd_of_noise(film: Film) -> float:
    """Median over pixels that no box touches of the sd of the differences of successive frames, over √2."""
    free = np.ones(film.frames.shape[1:3], bool)
    for boxes in film.boxes:
        for left, top, width, height in boxes:
            free[
                max(round(top - 8), 0) : round(top + height + 8), max(round(left - 8), 0) : round(left + width + 8)
            ] = 0
    part = film.frames[:, free][:, ::17].astype(float)
    return float(np.median(np.diff(part, axis=0).std(axis=0)) / np.sqrt(2))


def restless(film: Film) -> np.ndarray:
    """(pixels, 2): sd and step of pixels that are mostly free of people."""
    free = np.ones(film.frames.shape[:3], bool)
    for k, boxes in enumerate(film.boxes):
        for left, top, width, height in boxes:
            rows = slice(max(round(top) - GROWN, 0), round(top + height) + GROWN)
            free[k, rows, max(round(left) - GROWN, 0) : round(left + width) + GROWN] = False
    seen = free.mean(axis=0) > 0.5
    frames, free = film.frames[:, seen].astype(np.float32), free[:, seen, None]
    mean = frames.mean(axis=0, where=free)
    sd = np.sqrt(np.square(frames - mean).mean(axis=0, where=free))
    both = free[1:] & free[:-1]
    step = np.sqrt(np.square(np.diff(frames, axis=0)).mean(axis=0, where=both) / 2)
    return np.stack([sd.max(axis=1), step.max(axis=1)], axis=1)


def tell_restless(name: str, found: np.ndarray) -> None:
    cells = "".join(
        "".join(f"{q:7.2f}" for q in np.percentile(x, (50, 90, 99)))
        + "".join(f"{100 * (x > level).mean():7.2f} %" for level in (5, 10))
        for x in found.T
    )
    print(f"{name:22}{cells}", flush=True)


def sheet(films: list[Film], file: Path) -> None:
    """The first whole people of both, side by side, five times as large."""
    import cv2

    strips = []
    for film in films:
        cells = []
        for frame, boxes in list(zip(film.frames, film.boxes, strict=True))[::12]:
            for left, top, width, height in apart(boxes, film.frames.shape[1:3])[:2]:
                y, x = round(top + height / 2), round(left + width / 2)
                cell = cv2.copyMakeBorder(frame, 60, 60, 60, 60, cv2.BORDER_REPLICATE)[
                    y + 20 : y + 100, x + 40 : x + 80
                ]
                cells.append(cv2.resize(cell, None, fx=3, fy=3, interpolation=cv2.INTER_CUBIC))
        strips.append(np.hstack(cells[:12]))
    cv2.imwrite(str(file), np.vstack(strips))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--data", type=Path, default=Path(__file__).resolve().parents[2] / "shared" / "data")
    parser.add_argument("--seeds", type=int, default=6)
    parser.add_argument("--png", type=Path)
    args = parser.parse_args()
    real = pets(args.data)
    films = [ours(40_000 + k, Picture(jpeg=80)) for k in range(args.seeds)]
    a, noise = measure(real)
    found = [measure(film) for film in films]
    b = np.concatenate([rows for rows, _ in found])
    print(f"{len(a)} people in PETS, {len(b)} in ours; noise {noise:.2f} and {np.median([n for _, n in found]):.2f}\n")
    print(f"{'':22}{'PETS 10, 50, 90 %':>26}{'ours':>26}{'W':>8}")
    for k, name in enumerate(NAMES):
        shown = "".join(("".join(f"{q:8.2f}" for q in np.percentile(x[:, k], (10, 50, 90)))).rjust(26) for x in (a, b))
        print(f"{name:22}{shown}{wasserstein_distance(a[:, k], b[:, k]) / a[:, k].std():8.2f}")
    if args.png:
        sheet([real, films[0]], args.png)
    columns = "".join(f"{name:>7}" for name in ("50 %", "90 %", "99 %")) + f"{'> 5':>9}{'> 10':>9}"
    print(f"\n{'':22}{'sd over time':>39}{'step':>39}\n{'':22}{columns}{columns}")
    tell_restless("PETS", restless(real))
    for name, (light, picture) in WAYS.items():
        seeds = range(40_000, 40_000 + min(args.seeds, 3))
        tell_restless(name, np.concatenate([restless(ours(seed, picture, light)) for seed in seeds]))


if __name__ == "__main__":
    main()
