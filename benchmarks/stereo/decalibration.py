"""What a slightly wrong rig costs: matching, and the position error of the tracker.

Rows: settings of the scenario, whose right camera is not as calibrated: rolled by 0.1 degrees about the image's centre;
0.3 px too low; both; with 10 % more gain; and both pictures with more independent noise. Matching: the tracker's block
matcher on every 40th frame of each seed, inside the true silhouettes of people. `bias`, `median`: of the error of
disparity and of its absolute value, px; `within 0.75 px`: share; `matched`: share of the pixels that have a disparity.
The tracker: `error, m`, `along`, `group F1` as in the mode `scenes`, means over sequences.
"""

from __future__ import annotations

import argparse
from typing import Any

import cv2
import numpy as np

from benchmarks.stereo.scenes import SUITE, Variant, recordings, row_of
from benchmarks.stereo.stored_rows import Row
from benchmarks.support.tables import head, row
from scenarios.loading.resolve import resolve
from sim.sequence import simulate
from tracking.detect.subtraction_stereo import SubtractionStereo

STEP, BLOCK = 40, 9
SETTINGS = {
    "as calibrated": (),
    "roll 0.1°": ("picture.right_roll_deg=0.1",),
    "roll -0.1°": ("picture.right_roll_deg=-0.1",),
    "0.3 px down": ("picture.right_down_px=0.3",),
    "roll 0.1°, 0.3 px down": ("picture.right_roll_deg=0.1", "picture.right_down_px=0.3"),
    "gain 1.1": ("picture.right_gain=1.1",),
    "noise 5 instead of 3": ("picture.noise=5",),
}


def decalibration(args: argparse.Namespace) -> dict[str, list[float]]:
    """Prints the table over all scenes and returns its rows."""
    head(("right picture", "bias", "median", "within 0.75 px", "matched", "error, m", "along", "group F1"))
    wanted = None if args.only is None else {f"stereo-{name}" for name in args.only.split(",")}
    made = {}
    for name, settings in SETTINGS.items():
        parts: list[np.ndarray] = []
        rows: list[Row] = []
        for entry in [e for e in resolve(SUITE, settings) if wanted is None or e.name in wanted]:
            for seed, sequence in recordings(entry, args.seeds):
                parts += _errors(entry, seed)
                rows.append(row_of(sequence, Variant("stereo")))
        every = np.concatenate(parts)
        e = every[np.isfinite(every)]
        cells = [np.median(e), np.median(abs(e)), (abs(e) <= 0.75).mean(), len(e) / len(every)]
        cells += [np.nanmean([r[key] for r in rows]) for key in ("error", "along", "group_F1_hull")]
        made[name] = [float(v) for v in cells]
        row([name, *(f"{v:.3f}" for v in cells)])
    return made


def _errors(entry: Any, seed: int) -> list[np.ndarray]:
    """Returns the errors of disparity (P,), px, on the P pixels of people of some frames; nan where not matched."""
    sequence = simulate(entry.scenario, seed, entry.repeat, streams=("left", "right", "disparity"))
    stereo = SubtractionStereo(sequence.camera.focal_px[0] * sequence.camera.baseline / 2.5, BLOCK)
    found = []
    for frame in sequence:
        if frame.index % STEP != 1:
            continue
        pixels = sequence.frame_truth(frame.index).pixels
        mask = (pixels.ids > 0) & np.isfinite(pixels.disparity)
        left, right = (cv2.cvtColor(image, cv2.COLOR_BGR2GRAY) for image in (frame.image, frame.right))
        found.append((stereo.match(left, right, mask).disparity - pixels.disparity)[mask])
    return found
