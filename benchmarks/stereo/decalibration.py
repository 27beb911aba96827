"""What a slightly wrong rig costs: the tracker's block matcher on pairs whose right picture is changed.

Rows: the right picture as it is; rolled by 0.1 degrees about its centre; moved down by 0.3 px; both; with 10 % more
gain; with further independent noise of 4 grey values (standard deviation). Every 40th frame of each seed, inside the
true silhouettes of people. `bias`, `median`: of the error of disparity and of its absolute value, px; `within 0.75 px`:
share; `matched`: share of the pixels that have a disparity.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable

import cv2
import numpy as np

from benchmarks.stereo.scenes import entries
from benchmarks.support.tables import head, row
from sim.sequence import simulate
from tracking.detect.subtraction_stereo import SubtractionStereo

STEP, BLOCK = 40, 9
Change = Callable[[np.ndarray], np.ndarray]


def moved(roll_deg: float, down: float) -> Change:
    """Returns the change of a picture that is rolled about its centre and moved down by `down` px."""

    def change(image: np.ndarray) -> np.ndarray:
        high, wide = image.shape[:2]
        matrix = cv2.getRotationMatrix2D((wide / 2, high / 2), roll_deg, 1.0)
        matrix[1, 2] += down
        return cv2.warpAffine(image, matrix, (wide, high), flags=cv2.INTER_CUBIC, borderMode=cv2.BORDER_REPLICATE)

    return change


def noisy(image: np.ndarray) -> np.ndarray:
    """Returns the picture with further noise of 4 grey values."""
    noise = 4 * np.random.default_rng(0).standard_normal(image.shape)
    return np.clip(np.rint(image + noise), 0, 255).astype(np.uint8)


CHANGES: dict[str, Change] = {
    "none": lambda image: image,
    "roll 0.1°": moved(0.1, 0.0),
    "0.3 px down": moved(0.0, 0.3),
    "both": moved(0.1, 0.3),
    "gain 1.1": lambda image: np.clip(np.rint(1.1 * image), 0, 255).astype(np.uint8),
    "noise 4": noisy,
}


def decalibration(args: argparse.Namespace) -> dict[str, list[float]]:
    """Prints the table over all scenes and returns its rows."""
    found: dict[str, list[np.ndarray]] = {name: [] for name in CHANGES}
    for entry in entries(args.only).values():
        for seed in args.seeds:
            sequence = simulate(entry.scenario, seed, entry.repeat, streams=("left", "right", "disparity"))
            scale = sequence.camera.focal_px[0] * sequence.camera.baseline
            stereo = SubtractionStereo(scale / 2.5, BLOCK)
            for frame in sequence:
                if frame.index % STEP != 1:
                    continue
                pixels = sequence.frame_truth(frame.index).pixels
                mask = (pixels.ids > 0) & np.isfinite(pixels.disparity)
                left = cv2.cvtColor(frame.image, cv2.COLOR_BGR2GRAY)
                for name, change in CHANGES.items():
                    right = cv2.cvtColor(change(frame.right), cv2.COLOR_BGR2GRAY)
                    found[name].append((stereo.match(left, right, mask).disparity - pixels.disparity)[mask])
    head(("right picture", "bias", "median", "within 0.75 px", "matched"))
    made = {}
    for name, parts in found.items():
        every = np.concatenate(parts)
        e = every[np.isfinite(every)]
        made[name] = [float(v) for v in (np.median(e), np.median(abs(e)), (abs(e) <= 0.75).mean(), len(e) / len(every))]
        row([name, *(f"{v:.3f}" for v in made[name])])
    return made
