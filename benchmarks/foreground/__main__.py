"""Foreground by pixels: the five classes, what shadows cost, OpenCV's MOG2 on the same frames, adaptation over time.

    python -m benchmarks.foreground highway [--data FOLDER] [--out PNG]
    python -m benchmarks.foreground rendered [--seeds 20000:20002] [--size 640x480] [--dark]
    python -m benchmarks.foreground adaptation [--seed 40000] [--out adaptation.svg]
    python -m benchmarks.foreground opening [--seeds 0:8]
    python -m benchmarks.foreground ghosts [--seeds 20000:20002] [--data FOLDER]

highway: CDnet 2014, FOLDER/cdnet-highway. All frames without a mask train the models, the others are scored, each as it
is and after cleaning (majority, opening, closing at 20 px per m). Masks: 255 foreground; 0 and 50 not; 50 shadow; 85
and 170 are not counted. Columns: F1, precision, recall of foreground pixels, and the share of labelled shadow that is
not called foreground. Below: shares of the five classes by label, brightness of labelled shadow and foreground.
rendered: people (exact ids) are the truth; frames 10, 20, … of each scene are scored, all frames adapt the models.
--dark: a sweep over the threshold `dark` instead of other models.
adaptation: empty rendered frames (`merge`, 320x240, one per second). At 60 s a lamp casts a bright warm spot, an object
that lay there during training is carried away, or a person arrives and stands for the rest. The curves are the share of
these pixels that is called foreground, by rates of adaptation; the table says after how many seconds it stays at or
below 0.5 and 0.1. Last, `lights` with its people at ten frames per second: share of the pixels without people that is
called anything but background, with and without the gain of each frame.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np

from benchmarks.foreground.adaptation import FixedGain, adaptation
from benchmarks.foreground.ghosts import ghosts
from benchmarks.foreground.opening import opening
from benchmarks.support.mog2 import Mog2
from benchmarks.support.options import PETS, add_data, add_seeds, new_parser, seeds_text
from scenarios import load
from sim import simulate
from sim.types import Sequence
from tracking.detect import blobs
from tracking.detect.background import Background, fused_foreground
from tracking.detect.background_settings import BackgroundSettings

SCALE = 20.0  # px per m
COLOURS = np.array([[0, 0, 0], [255, 255, 255], [0, 255, 255], [0, 160, 0], [0, 0, 255]], np.uint8)
Model = Background | Mog2
ModelMaker = Callable[[np.ndarray, float], Model]
Labelled = tuple[np.ndarray, np.ndarray]  # image, mask
SCENES = {
    "merge, no shadows": ("merge", ["light.shadow=0"]),
    "merge, shadows 0.3": ("merge", ["light.shadow=0.3"]),
    "merge, shadows 0.5": ("merge", ["light.shadow=0.5"]),
    "merge, shadows 0.7": ("merge", ["light.shadow=0.7"]),
    "merge, noise 8": ("merge", ["picture.noise=8"]),
    "lights: low sun, drift, a switch": ("lights", []),
}


def five_classes(**settings: object) -> ModelMaker:
    return lambda sample, fps: Background(sample, fps, BackgroundSettings(**settings))  # type: ignore[arg-type]


def without_shadow_classes(sample: np.ndarray, fps: float) -> Background:
    model = Background(sample, fps)
    model.bounds = (1.0, 1.0)
    return model


MODELS: dict[str, ModelMaker] = {
    "five classes": five_classes(),
    "without shadow classes": without_shadow_classes,
    "without gain": FixedGain,
    "MOG2": Mog2,
}


@dataclass
class PixelCounts:
    """Pixels so far: true and false positives, false negatives, labelled shadow, and shadow not called foreground."""

    tp: int = 0
    fp: int = 0
    fn: int = 0
    shadow: int = 0
    spared: int = 0

    def add(self, found: np.ndarray, true: np.ndarray, counted: np.ndarray, shadow: np.ndarray) -> None:
        """Adds one frame: foreground found and true, pixels that count, labelled shadow, each (H, W) bool."""
        self.tp += int(np.sum(found & true & counted))
        self.fp += int(np.sum(found & ~true & counted))
        self.fn += int(np.sum(~found & true & counted))
        self.shadow += int(np.sum(shadow))
        self.spared += int(np.sum(shadow & ~found))

    def cells(self) -> str:
        """Returns F1, precision, recall, and the share of shadow that is not called foreground."""
        precision, recall = self.tp / max(self.tp + self.fp, 1), self.tp / max(self.tp + self.fn, 1)
        f1 = 2 * self.tp / max(2 * self.tp + self.fp + self.fn, 1)
        shadow = f"{self.spared / self.shadow:6.3f}" if self.shadow else "     –"
        return f"{f1:6.3f} {precision:6.3f} {recall:6.3f} {shadow}"


def labelled_frames(folder: Path) -> tuple[np.ndarray, list[Labelled]]:
    """Returns the frames without a mask (K, H, W, 3) and the frames with one."""
    masks = {path.stem[2:]: path for path in sorted((folder / "groundtruth").iterdir())}
    frames = {path.stem[2:]: path for path in sorted((folder / "input").iterdir())}
    sample = np.stack([cv2.imread(str(path)) for name, path in frames.items() if name not in masks])
    return sample, [(cv2.imread(str(frames[name])), cv2.imread(str(path), 0)) for name, path in masks.items()]


def highway(folder: Path, out: Path | None) -> None:
    sample, tests = labelled_frames(folder)
    print(f"{len(sample)} frames to train on, {len(tests)} with masks")
    made = {name: MODELS[name] for name in ("five classes", "without shadow classes", "MOG2")}
    made |= {f"dark = {dark:g}": five_classes(dark=dark) for dark in (0.6, 0.5, 0.3, 0.2, 0.1, 0.05)}
    made["MOG2, shadows down to 0.1"] = lambda sample, fps: Mog2(sample, fps, BackgroundSettings(dark=0.1))
    print(f"{'':28s}   as it is                      cleaned\n{'':28s}" + "       F1      P      R shadow" * 2)
    for name, maker in made.items():
        model = maker(sample, 25.0)
        raw, cleaned = PixelCounts(), PixelCounts()
        for image, mask in tests:
            found = fused_foreground(model.classify(image))
            true, shadow, counted = mask == 255, mask == 50, np.isin(mask, (0, 50, 255))
            raw.add(found, true, counted, shadow)
            cleaned.add(blobs.clean(found, SCALE), true, counted, shadow)
        print(f"{name:28s}  {raw.cells()}  {cleaned.cells()}")
    print_classes(Background(sample, 25.0), tests)
    if out is not None:
        write_classes([Background(sample, 25.0), Mog2(sample, 25.0)], tests, out)


def print_classes(model: Background, tests: Iterable[Labelled]) -> None:
    """Prints the shares of the classes by label, and the brightness of pixels relative to the background."""
    shares, ratio = np.zeros((3, 5)), {50: [], 255: []}
    for image, mask in tests:
        classes = model.classify(image)
        for row, value in enumerate((0, 50, 255)):
            shares[row] += np.bincount(classes[mask == value], minlength=5)
        relative = np.mean(image / np.moveaxis(model.mean * model.gain[:, None, None], 0, -1), axis=-1)
        for value, found in ratio.items():
            found.append(relative[mask == value])
    print("\nlabel        background foreground       dark     shadow  highlight")
    for name, row in zip(("background", "shadow", "foreground"), shares, strict=True):
        print(f"{name:12s}" + "".join(f"{share:11.3f}" for share in row / row.sum()))
    for name, value in (("shadow", 50), ("foreground", 255)):
        quantiles = np.percentile(np.concatenate(ratio[value]), [5, 25, 50, 75, 95])
        print(f"brightness of labelled {name}, 5 25 50 75 95 %: " + " ".join(f"{q:.2f}" for q in quantiles))


def write_classes(models: list[Model], tests: list[Labelled], out: Path) -> None:
    """Writes a picture: three frames in rows; frame, mask and the classes of each model in columns."""
    rows = []
    for image, mask in tests[:: max(len(tests) // 3, 1)]:
        classes = (COLOURS[model.classify(image)] for model in models)
        rows.append(np.hstack([image, cv2.cvtColor(mask, cv2.COLOR_GRAY2BGR), *classes]))
    cv2.imwrite(str(out), np.vstack(rows))
    print(f"\nwrote {out}")


def rendered(seeds: range, size: str, dark: bool) -> None:
    models = {f"dark = {d:g}": five_classes(dark=d) for d in (0.2, 0.3, 0.4, 0.5, 0.6, 0.7)} if dark else MODELS
    print(f"seeds {seeds_text(seeds)}, {size}\n{'':60s}    F1      P      R")
    for title, (name, settings) in SCENES.items():
        totals = {model: (PixelCounts(), PixelCounts()) for model in models}
        for seed in seeds:
            scenario = load(name, [*settings, f"camera.image=[{size.replace('x', ',')}]"])
            add_sequence(simulate(scenario, seed), models, totals)
        for model, (raw, cleaned) in totals.items():
            print(f"{title:34s} {model:24s} {raw.cells()[:20]}   cleaned {cleaned.cells()[:20]}", flush=True)


def add_sequence(
    sequence: Sequence, makers: dict[str, ModelMaker], totals: dict[str, tuple[PixelCounts, PixelCounts]]
) -> None:
    """Adds the pixels of one sequence to the counts of each model, raw and cleaned."""
    sample = sequence.background()
    models = {name: maker(sample, sequence.fps) for name, maker in makers.items()}
    for frame in sequence:
        scored = frame.index % 10 == 0
        true = sequence.load_pixels(frame.index).ids > 0 if scored else np.zeros(())
        for name, model in models.items():
            classes = model.classify(frame.image)
            model.adapt(frame.image, classes)
            if scored:
                found, everywhere, none = fused_foreground(classes), np.ones_like(true), np.zeros_like(true)
                totals[name][0].add(found, true, everywhere, none)
                totals[name][1].add(blobs.clean(found, sequence.px_per_m), true, everywhere, none)


def main() -> None:
    parser = new_parser(__doc__)
    parser.add_argument("mode", choices=["highway", "rendered", "adaptation", "opening", "ghosts"])
    add_data(parser)
    parser.add_argument("--out", type=Path, help="highway: a picture of the classes; adaptation: the chart")
    add_seeds(parser, "20000:20002", what="rendered, opening, ghosts: ")
    parser.add_argument("--size", default="640x480", help="rendered: size of the image")
    parser.add_argument("--dark", action="store_true", help="rendered: a sweep over the threshold `dark`")
    parser.add_argument("--seed", type=int, default=40_000, help="adaptation")
    args: argparse.Namespace = parser.parse_args()
    if args.mode == "highway":
        highway(args.data / "cdnet-highway", args.out)
    elif args.mode == "rendered":
        rendered(args.seeds, args.size, args.dark)
    elif args.mode == "opening":
        opening(args.seeds)
    elif args.mode == "ghosts":
        ghosts(args.seeds, args.data / PETS)
    else:
        adaptation(args.seed, args.out or Path("adaptation.svg"))


if __name__ == "__main__":
    main()
