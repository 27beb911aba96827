"""Has the rendered ground the contrast of real ground? A matcher needs contrast from pixel to pixel.

Real: the median over time of PETS09-S2L1 (every 5th of the first 200 frames, rows below 45 % of the height: paving,
lawn, kerbs) and of cdnet-highway (every 20th frame, inside its region of interest: asphalt). Ours: background pictures
of the suite without noise and shadows, by `picture.texture` and `picture.samples`, means over seeds. `slope`: absolute
central difference along the row, grey levels per px, 50 and 90 % of the pixels. `local`: standard deviation of 9 x 9
px, grey levels, 10, 50 and 90 %. `relative`: its median over the brightness. `1 px / 8 px`: mean absolute difference of
grey values 1 px apart along the row over that 8 px apart.
"""

from __future__ import annotations

import argparse

import cv2
import numpy as np

from benchmarks.stereo.scenes import SUITE
from benchmarks.support.options import PETS
from benchmarks.support.tables import head, row
from scenarios.loading.resolve import resolve
from sim.sequence import simulate

KINDS = ((0.5, 1), (0.7, 1), (0.7, 2), (0.5, 3), (0.7, 3), (0.8, 3))
"""Contrast of the texture, samples per pixel and axis."""
SKY = 0.45


def contrast(args: argparse.Namespace) -> dict[str, list[float]]:
    """Prints the table and returns its rows."""
    head(("ground", "slope 50, 90 %", "local 10, 50, 90 %", "relative", "1 px / 8 px"))
    pets = _still(sorted((args.data / PETS / "img1").glob("*.jpg"))[::5])
    below = np.zeros(pets.shape, bool)
    below[int(SKY * len(pets)) :] = True
    road = args.data / "cdnet-highway"
    inside = cv2.imread(str(road / "ROI.bmp"), cv2.IMREAD_GRAYSCALE) > 128
    made = {"PETS": _measures(pets, below)}
    made["cdnet-highway"] = _measures(_still(sorted((road / "input").glob("*.jpg"))[::20]), inside)
    wanted = ("cross", "stairs") if args.only is None else args.only.split(",")
    for texture, samples in KINDS:
        settings = (f"picture.texture={texture}", f"picture.samples={samples}", "picture.noise=0", "light.shadow=0")
        entries = [e for e in resolve(SUITE, settings) if e.name.removeprefix("stereo-") in wanted]
        rows = []
        for entry in entries:
            for seed in args.seeds:
                sample = simulate(entry.scenario, seed, entry.repeat, streams=("left",)).background()
                assert sample is not None
                image = cv2.cvtColor(np.asarray(sample)[0], cv2.COLOR_BGR2GRAY).astype(float)
                rows.append(_measures(image, np.ones(image.shape, bool)))
        made[f"ours, texture {texture:g}, samples {samples}"] = np.mean(rows, 0).tolist()
    for name, (a, b, c, d, e, relative, ratio) in made.items():
        row([name, f"{a:.1f}, {b:.1f}", f"{c:.1f}, {d:.1f}, {e:.1f}", f"{relative:.3f}", f"{ratio:.2f}"])
    return made


def _still(paths: list) -> np.ndarray:  # type: ignore[type-arg]
    """Returns the median (H, W) of the grey values of pictures."""
    return np.asarray(np.median([cv2.imread(str(p), cv2.IMREAD_GRAYSCALE) for p in paths], 0), float)


def _measures(grey: np.ndarray, mask: np.ndarray) -> list[float]:
    slope = np.abs(grey[:, 2:] - grey[:, :-2])[mask[:, 1:-1]] / 2
    mean = cv2.blur(grey, (9, 9))
    local = np.sqrt(np.maximum(cv2.blur(grey**2, (9, 9)) - mean**2, 0))
    found = [*np.percentile(slope, (50, 90)), *np.percentile(local[mask], (10, 50, 90))]
    near, far = (np.abs(grey[:, by:] - grey[:, :-by])[mask[:, by:] & mask[:, :-by]].mean() for by in (1, 8))
    return [float(v) for v in (*found, np.median((local / np.maximum(mean, 1))[mask]), near / far)]
