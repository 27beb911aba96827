"""What a slightly wrong rig costs: matching, and the position error of the tracker.

Rows: settings of the scenario, whose right camera is not as calibrated: rolled by 0.1 degrees about the image's centre;
0.3 px too low; both; with 10 % more gain; and both pictures with more independent noise. Matching: the tracker's block
matcher on every 40th frame of each seed, inside the true silhouettes of people. `bias`, `median`: of the error of
disparity and of its absolute value, px; `within 0.75 px`: share; `matched`: share of the pixels that have a disparity.
The tracker: `error, m`, `along`, `group F1` as in the mode `scenes`, means over sequences. `more error, m`, `more F1`:
paired differences to the first row with 95 % intervals (Student's); * if 0 lies outside.
"""

from __future__ import annotations

import argparse
from typing import Any

import cv2
import numpy as np

from benchmarks.stereo.scenes import SUITE, Variant, recordings, row_of
from benchmarks.stereo.stored_rows import Row
from benchmarks.support.tables import head, row, signed
from scenarios.loading.resolve import resolve
from sim.sequence import simulate
from tracking.detect.subtraction_stereo import SubtractionStereo
from tracking.stats import mean_interval

STEP, BLOCK = 40, 9
COLUMNS = (
    "bias", "median", "within 0.75 px", "matched", "error, m", "more error, m", "along", "group F1", "more F1",
)  # fmt: skip
KEYS = ("error", "along", "group_F1_hull")
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
    head(("right picture", *COLUMNS))
    wanted = None if args.only is None else {f"stereo-{name}" for name in args.only.split(",")}
    made: dict[str, list[float]] = {}
    usual: list[Row] = []
    for name, settings in SETTINGS.items():
        parts: list[np.ndarray] = []
        rows: list[Row] = []
        for entry in [e for e in resolve(SUITE, settings) if wanted is None or e.name in wanted]:
            for seed, sequence in recordings(entry, args.seeds):
                parts += _errors(entry, seed)
                rows.append(row_of(sequence, Variant("stereo")))
        usual = usual or rows
        every = np.concatenate(parts)
        e = every[np.isfinite(every)]
        matching = [np.median(e), np.median(abs(e)), (abs(e) <= 0.75).mean(), len(e) / len(every)]
        error, along, score = (float(np.nanmean([r[key] for r in rows])) for key in KEYS)
        more = [_more(rows, usual, key) if rows is not usual else "–" for key in KEYS]
        made[name] = [*map(float, matching), error, along, score]
        cells = [f"{v:.3f}" for v in made[name]]
        row([name, *cells[:5], more[0], *cells[5:], more[2]])
    return made


def _more(rows: list[Row], usual: list[Row], key: str) -> str:
    return signed(*map(float, mean_interval(np.array([r[key] - u[key] for r, u in zip(rows, usual, strict=True)]))))


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
