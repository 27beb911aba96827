"""Do our pictures look like real video to a detector? Contrast of people, and how still the background is.

    python -m benchmarks.picture_realism [--data FOLDER] [--seeds 40000:40006] [--png FILE]

The real video is PETS 2009 S2.L1 view 1, first 200 frames (480 x 360). Ours has 8 people who walk, a camera of the same
size and about the same height and tilt, JPEG of quality 80. The background is the median of the frames in both.
First table, 10, 50 and 90 % over labelled boxes that lie wholly in the image and share less than a tenth of their area:
mean of |pixel - background| over the differing pixels, grey levels, per channel and relative to the background; share
of the box that differs by more than 3 standard deviations of the noise in some channel, and by more than 20 levels;
height of the box, px. W: Wasserstein distance of the two distributions, in standard deviations of PETS. Noise: standard
deviation over time of pixels that no box touches, grey levels. --png: people of both, side by side.
Second table, of pixels that labelled people leave free in more than half of the frames (boxes grown by 16 px; frames in
which the pixel is covered do not count, shadows do): of each pixel the largest standard deviation of its three colours
over time, grey levels, over all frames (`sd`) and from one frame to the next divided by √2 (`step`); 50, 90, 99 %, and
the share of pixels above 5 and 10 levels. Ours with several settings, of the first three seeds.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.stats import wasserstein_distance

from benchmarks.support.options import PETS, add_data, add_seeds, new_parser
from benchmarks.support.tables import head, row
from scenarios.schema.picture import Light, Picture
from scenarios.schema.scenario import Scenario
from sim.crowd.world import run
from sim.render.renderer import make_renderer
from sim.scene.camera_placement import place_camera
from sim.truth.label import bodies

CAMERA = {"image": [480, 360], "focal_px": 560, "tilt_deg": 15, "height": 6.5, "crop": True, "fps": 7}
CLEAR = 20  # grey levels
GROWN = 16  # px
SETTINGS = {
    "ours, defaults": (Light(), Picture(jpeg=80)),
    "clouds 0.02": (Light(cloud=0.02), Picture(jpeg=80)),
    "foliage 0.05": (Light(), Picture(jpeg=80, foliage=0.05)),
    "foliage, sway 4 px": (Light(), Picture(jpeg=80, foliage=0.05, sway_px=4.0)),
    "all, noise 1": (Light(cloud=0.02), Picture(jpeg=80, foliage=0.05, sway_px=4.0, noise=1.0)),
}
QUANTITIES = (
    "contrast B",
    "contrast G",
    "contrast R",
    "contrast, relative",
    "differs by 3 sd",
    "differs by 20",
    "height, px",
)


@dataclass(frozen=True)
class LabelledVideo:
    """frames (T, H, W, 3) BGR uint8; boxes: per frame (N, 4) left, top, width, height, px."""

    frames: np.ndarray
    boxes: list[np.ndarray]


def pets(data: Path) -> LabelledVideo:
    import cv2

    files = sorted((data / PETS / "img1").glob("*.jpg"))
    rows = np.loadtxt(data / PETS / "gt" / "gt.txt", delimiter=",")
    frames = np.stack([cv2.imread(str(file)) for file in files])
    return LabelledVideo(frames, [rows[rows[:, 0] == k + 1, 2:6] for k in range(len(files))])


def rendered(seed: int, picture: Picture, light: Light | None = None, frames: int = 100) -> LabelledVideo:
    """Returns a rendered video of 8 people who cross a square, each on a path of their own."""
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
    return LabelledVideo(np.stack([made.frame(k + 1) for k in range(frames)]), boxes)


def part(box: np.ndarray, margin: int = 0) -> tuple[slice, slice]:
    """Returns the rows and columns of a box, grown by `margin` px on each side and cut at the image's first row and
    column."""
    left, top, width, height = box
    rows = slice(max(round(top - margin), 0), round(top + height + margin))
    return rows, slice(max(round(left - margin), 0), round(left + width + margin))


def separate_boxes(boxes: np.ndarray, size: tuple[int, int]) -> np.ndarray:
    """Returns the boxes that lie in the image of (height, width) and share less than a tenth of their area."""
    low, high = boxes[:, :2], boxes[:, :2] + boxes[:, 2:]
    both = np.clip(np.minimum(high[:, None], high) - np.maximum(low[:, None], low), 0, None).prod(axis=2)
    shared = (both / boxes[:, 2:].prod(axis=1)[:, None])[~np.eye(len(boxes), dtype=bool)].reshape(len(boxes), -1)
    inside = (low >= 0).all(axis=1) & (high <= (size[1], size[0])).all(axis=1)
    return boxes[inside & (shared < 0.1).all(axis=1)]


def people_measured(video: LabelledVideo) -> tuple[np.ndarray, float]:
    """Returns QUANTITIES of all separate boxes, (people, 7), and the standard deviation of the noise."""
    background = np.median(video.frames[::2], axis=0)
    noise, size, rows = noise_sd(video), video.frames.shape[1:3], []
    for frame, boxes in zip(video.frames, video.boxes, strict=True):
        for box in separate_boxes(boxes, size):
            off, empty = np.abs(frame[part(box)] - background[part(box)]), background[part(box)]
            differs = (off > 3 * noise).any(axis=2)
            if differs.any():
                relative = (off[differs] / np.maximum(empty[differs], 16)).mean()
                clearly = (off > CLEAR).any(axis=2).mean()
                rows.append([*off[differs].mean(axis=0), relative, differs.mean(), clearly, box[3]])
    return np.array(rows), noise


def noise_sd(video: LabelledVideo) -> float:
    """Returns the standard deviation of the differences of successive frames over √2, median over untouched pixels."""
    free = np.ones(video.frames.shape[1:3], bool)
    for boxes in video.boxes:
        for box in boxes:
            free[part(box, 8)] = False
    values = video.frames[:, free][:, ::17].astype(float)
    return float(np.median(np.diff(values, axis=0).std(axis=0)) / np.sqrt(2))


def variation(video: LabelledVideo) -> np.ndarray:
    """Returns (pixels, 2): `sd` and `step` of the pixels that people leave free in more than half of the frames."""
    free = np.ones(video.frames.shape[:3], bool)
    for k, boxes in enumerate(video.boxes):
        for box in boxes:
            free[(k, *part(box, GROWN))] = False
    seen = free.mean(axis=0) > 0.5
    frames, free = video.frames[:, seen].astype(np.float32), free[:, seen, None]
    mean = frames.mean(axis=0, where=free)
    sd = np.sqrt(np.square(frames - mean).mean(axis=0, where=free))
    both = free[1:] & free[:-1]
    step = np.sqrt(np.square(np.diff(frames, axis=0)).mean(axis=0, where=both) / 2)
    return np.stack([sd.max(axis=1), step.max(axis=1)], axis=1)


def print_variation(name: str, found: np.ndarray) -> None:
    cells = []
    for x in found.T:
        cells.append(", ".join(f"{q:.2f}" for q in np.percentile(x, (50, 90, 99))))
        cells.append(", ".join(f"{100 * (x > level).mean():.2f} %" for level in (5, 10)))
    row([name, *cells])


def write_people(videos: list[LabelledVideo], file: Path) -> None:
    """Writes the first separate people of each video, one row per video, three times as large."""
    import cv2

    strips = []
    for video in videos:
        cells = []
        for frame, boxes in list(zip(video.frames, video.boxes, strict=True))[::12]:
            for left, top, width, height in separate_boxes(boxes, video.frames.shape[1:3])[:2]:
                y, x = round(top + height / 2), round(left + width / 2)
                bordered = cv2.copyMakeBorder(frame, 60, 60, 60, 60, cv2.BORDER_REPLICATE)
                cell = bordered[y + 20 : y + 100, x + 40 : x + 80]
                cells.append(cv2.resize(cell, None, fx=3, fy=3, interpolation=cv2.INTER_CUBIC))
        strips.append(np.hstack(cells[:12]))
    cv2.imwrite(str(file), np.vstack(strips))


def main() -> None:
    parser = new_parser(__doc__)
    add_data(parser)
    add_seeds(parser, "40000:40006")
    parser.add_argument("--png", type=Path, help="a picture of people of both")
    args = parser.parse_args()
    real, videos = pets(args.data), [rendered(seed, Picture(jpeg=80)) for seed in args.seeds]
    theirs, noise = people_measured(real)
    found = [people_measured(video) for video in videos]
    ours = np.concatenate([rows for rows, _ in found])
    sd = np.median([n for _, n in found])
    print(f"{len(theirs)} boxes in PETS, {len(ours)} in ours; noise {noise:.2f} and {sd:.2f}\n")
    head(["", "PETS 10, 50, 90 %", "ours 10, 50, 90 %", "W"])
    for k, name in enumerate(QUANTITIES):
        cells = [", ".join(f"{q:.2f}" for q in np.percentile(x[:, k], (10, 50, 90))) for x in (theirs, ours)]
        row([name, *cells, f"{wasserstein_distance(theirs[:, k], ours[:, k]) / theirs[:, k].std():.2f}"])
    if args.png:
        write_people([real, videos[0]], args.png)
    print()
    head(["", "sd 50, 90, 99 %", "above 5, 10", "step 50, 90, 99 %", "above 5, 10"])
    print_variation("PETS", variation(real))
    for name, (light, picture) in SETTINGS.items():
        print_variation(name, np.concatenate([variation(rendered(s, picture, light)) for s in args.seeds[:3]]))


if __name__ == "__main__":
    main()
