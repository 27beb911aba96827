"""Foreground by pixels: the five classes, what shadows cost, and OpenCV's MOG2 on the same frames.

    PYTHONPATH=. python benchmarks/segmentation.py highway DATA [--out PNG]      DATA: a folder as of CDnet 2014
    PYTHONPATH=. python benchmarks/segmentation.py rendered [--seeds 20000:20002] [--size 640x480] [--dark]

highway: all frames without a mask train the models, the others are measured, each as it is and after the same windows
(majority, opening, closing at 20 px per m). Masks: 255 foreground; 0, 50 not; 50 shadow; 85, 170 not counted.
rendered: people in front are the truth (exact ids); frames 10, 20, … of each scene are measured after adapting in all.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np

from scenarios import load
from sim import simulate
from sim.types import Sequence
from tracking.detect import blobs
from tracking.detect.background import Background, fused_foreground
from tracking.detect.background_settings import BackgroundSettings
from tracking.detect.mog2 import Mog2

SCALE = 20.0
COLOURS = np.array([[0, 0, 0], [255, 255, 255], [0, 255, 255], [0, 160, 0], [0, 0, 255]], np.uint8)
Maker = Callable[[np.ndarray, float], Background | Mog2]
SCENES = {
    "merge, no shadows": ("merge", ["light.shadow=0"]),
    "merge, shadows 0.3": ("merge", ["light.shadow=0.3"]),
    "merge, shadows 0.5": ("merge", ["light.shadow=0.5"]),
    "merge, shadows 0.7": ("merge", ["light.shadow=0.7"]),
    "merge, noise 8": ("merge", ["picture.noise=8"]),
    "lights: low sun, drift, a switch": ("lights", []),
}


def ours(**settings: object) -> Maker:
    return lambda sample, fps: Background(sample, fps, BackgroundSettings(**settings))  # type: ignore[arg-type]


MODELS: dict[str, Maker] = {
    "five classes": ours(),
    "without shadow classes": ours(dark=1.0, bright=1.0),
    "without gain": ours(gain="none"),
    "MOG2": Mog2,
}


@dataclass
class Count:
    """Pixels counted: right and wrong foreground, missed, and labelled shadow that is not called foreground."""

    tp: int = 0
    fp: int = 0
    fn: int = 0
    shadow: int = 0
    spared: int = 0

    def add(self, said: np.ndarray, true: np.ndarray, counts: np.ndarray, shadow: np.ndarray) -> None:
        """One frame more."""
        self.tp += int(np.sum(said & true & counts))
        self.fp += int(np.sum(said & ~true & counts))
        self.fn += int(np.sum(~said & true & counts))
        self.shadow += int(np.sum(shadow))
        self.spared += int(np.sum(shadow & ~said))

    def row(self) -> str:
        """F1, precision, recall, share of shadows spared."""
        precision, recall = self.tp / max(self.tp + self.fp, 1), self.tp / max(self.tp + self.fn, 1)
        f1 = 2 * self.tp / max(2 * self.tp + self.fp + self.fn, 1)
        shadow = f"{self.spared / self.shadow:6.3f}" if self.shadow else "     –"
        return f"{f1:6.3f} {precision:6.3f} {recall:6.3f} {shadow}"


def highway(data: Path, out: Path | None) -> None:
    masks = {path.stem[2:]: path for path in sorted((data / "groundtruth").iterdir())}
    frames = {path.stem[2:]: path for path in sorted((data / "input").iterdir())}
    sample = np.stack([cv2.imread(str(path)) for name, path in frames.items() if name not in masks])
    tests = [(cv2.imread(str(frames[name])), cv2.imread(str(path), 0)) for name, path in masks.items()]
    print(f"{len(sample)} frames to train on, {len(tests)} with masks")
    made: dict[str, Maker] = {name: MODELS[name] for name in ("five classes", "without shadow classes", "MOG2")}
    made |= {f"dark = {dark:g}": ours(dark=dark) for dark in (0.6, 0.5, 0.3, 0.2, 0.1, 0.05)}
    made["MOG2, shadows down to 0.1"] = lambda sample, fps: Mog2(sample, fps, deep)
    deep = Mog2(sample[:10], 25.0).settings.from_dict({"shadow": 0.1})
    print(
        f"{'':28s}   as it is                      after the windows\n{'':28s}" + "       F1      P      R shadow" * 2
    )
    for name, maker in made.items():
        model = maker(sample, 25.0)
        raw, cleaned = Count(), Count()
        for image, mask in tests:
            said = fused_foreground(model.classify(image))
            true, shadow, counts = mask == 255, mask == 50, np.isin(mask, (0, 50, 255))
            raw.add(said, true, counts, shadow)
            cleaned.add(blobs.clean(said, SCALE), true, counts, shadow)
        print(f"{name:28s}  {raw.row()}  {cleaned.row()}")
    kinds(Background(sample, 25.0), tests)
    if out is not None:
        picture(Background(sample, 25.0), Mog2(sample, 25.0), tests, out)


def kinds(model: Background, tests: Iterable[tuple[np.ndarray, np.ndarray]]) -> None:
    """What the five classes call the pixels of each label, and how bright labelled shadows are beside the road."""
    table, ratio = np.zeros((3, 5)), {50: [], 255: []}
    for image, mask in tests:
        classes = model.classify(image)
        for row, value in enumerate((0, 50, 255)):
            table[row] += np.bincount(classes[mask == value], minlength=5)
        relative = np.mean(image / np.moveaxis(model.mean * model.gain[:, None, None], 0, -1), axis=-1)
        for value, found in ratio.items():
            found.append(relative[mask == value])
    print("\nlabel        background foreground       dark     shadow  highlight")
    for name, row in zip(("background", "shadow", "foreground"), table, strict=True):
        print(f"{name:12s}" + "".join(f"{share:11.3f}" for share in row / row.sum()))
    for name, value in (("shadow", 50), ("foreground", 255)):
        quantiles = np.percentile(np.concatenate(ratio[value]), [5, 25, 50, 75, 95])
        print(f"brightness of labelled {name}, 5 25 50 75 95 %: " + " ".join(f"{q:.2f}" for q in quantiles))


def picture(model: Background, other: Mog2, tests: list[tuple[np.ndarray, np.ndarray]], out: Path) -> None:
    """Rows: frames; columns: frame, mask, five classes, MOG2's."""
    rows = [
        np.hstack(
            [image, cv2.cvtColor(mask, cv2.COLOR_GRAY2BGR), *(COLOURS[m.classify(image)] for m in (model, other))]
        )
        for image, mask in tests[:: max(len(tests) // 3, 1)]
    ]
    cv2.imwrite(str(out), np.vstack(rows))
    print(f"\nwrote {out}")


def rendered(seeds: range, size: str, dark: bool) -> None:
    models = {f"dark = {d:g}": ours(dark=d) for d in (0.2, 0.3, 0.4, 0.5, 0.6, 0.7)} if dark else MODELS
    print(f"seeds {seeds.start}:{seeds.stop}, {size}\n{'':60s}    F1      P      R")
    for title, (name, settings) in SCENES.items():
        totals = {model: (Count(), Count()) for model in models}
        for seed in seeds:
            scenario = load(name, [*settings, f"camera.image=[{size.replace('x', ',')}]"])
            measure(simulate(scenario, seed), models, totals)
        for model, (raw, cleaned) in totals.items():
            print(f"{title:34s} {model:24s} {raw.row()[:20]}   cleaned {cleaned.row()[:20]}", flush=True)


def measure(sequence: Sequence, made: dict[str, Maker], totals: dict[str, tuple[Count, Count]]) -> None:
    sample = sequence.background()
    models = {name: maker(sample, sequence.fps) for name, maker in made.items()}
    for frame in sequence:
        if frame.index % 10 == 0:
            true = sequence.load_pixels(frame.index).ids > 0
            everywhere, none = np.ones_like(true), np.zeros_like(true)
        for name, model in models.items():
            classes = model.classify(frame.image)
            model.adapt(frame.image, classes)
            if frame.index % 10 == 0:
                said = fused_foreground(classes)
                raw, cleaned = totals[name]
                raw.add(said, true, everywhere, none)
                cleaned.add(blobs.clean(said, sequence.px_per_m), true, everywhere, none)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    commands = parser.add_subparsers(dest="command", required=True)
    real = commands.add_parser("highway")
    real.add_argument("data", type=Path)
    real.add_argument("--out", type=Path)
    made = commands.add_parser("rendered")
    made.add_argument("--seeds", default="20000:20002")
    made.add_argument("--size", default="640x480")
    made.add_argument("--dark", action="store_true", help="a sweep over the dark threshold")
    chosen = parser.parse_args()
    if chosen.command == "highway":
        highway(chosen.data, chosen.out)
    else:
        rendered(range(*map(int, chosen.seeds.split(":"))), chosen.size, chosen.dark)


if __name__ == "__main__":
    main()
