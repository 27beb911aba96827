"""Are stereo pictures honest? OpenCV's StereoSGBM against the true disparity, and the tracker's matcher beside it.

Rows: a scene of the suite subtraction-stereo, with the paper's rig (f b = 30 px m) and with one of 0.9 m baseline (15
to 60 px): as the suite has it, with the catalogue's default contrast of the ground, and without noise. Every 40th frame
of each seed is matched. `median`, `within 0.75 px`: of the absolute error of StereoSGBM on pixels of people and ground
whose true disparity is known; `HH`: of its mode HH, which adds costs along paths from all sides and not only from
above, left and right; `sample`: with the parameters of OpenCV's sample stereo_match.py, which hardly penalise steps of
disparity. `bad`: share of errors above 1 px, over that of the best constant disparity. `people`: the median on people
alone, of StereoSGBM, and of the tracker's block matcher inside their silhouettes. `one row`: median over people nearer
than 5 m of the spread of the true disparity along one image row, px times 60 / (f b): a flat figure has 0.
"""

from __future__ import annotations

import argparse
from itertools import product
from typing import Any

import cv2
import numpy as np

from benchmarks.stereo.scenes import SUITE, entries
from benchmarks.support.tables import head, row
from scenarios.loading.resolve import resolve
from sim.sequence import simulate
from tracking.detect.subtraction_stereo import SubtractionStereo

RIGS = {"paper's": (), "15 to 60 px": ("camera.baseline=0.9",)}
PICTURES = {"as the suite": (), "texture 0.5": ("picture.texture=0.5",), "without noise": ("picture.noise=0",)}
STEP, BLOCK = 40, 9
COLUMNS = (
    "scene", "rig", "pictures", "median", "within 0.75 px", "bad", "people", "block matcher", "one row",
    "HH median", "HH within", "sample median", "sample within",
)  # fmt: skip


def pictures(args: argparse.Namespace) -> list[dict[str, Any]]:
    """Prints the table of matching errors and returns its rows."""
    head(COLUMNS)
    made = []
    for name, rig, kind in product(entries(args.only), RIGS, PICTURES):
        settings = (*RIGS[rig], *PICTURES[kind])
        (entry,) = [e for e in resolve(SUITE, settings) if e.name == f"stereo-{name}"]
        parts = [_errors(entry, seed) for seed in args.seeds]
        every, people, own, constant, spread, two_sided, sample = (
            np.concatenate([p[k] for p in parts]) for k in range(7)
        )
        size = np.abs(every)
        bad = float((size > 1).mean() / max((np.abs(constant) > 1).mean(), 1e-9))
        cells = [
            np.median(size), (size <= 0.75).mean(), bad, np.median(np.abs(people)), np.median(np.abs(own)),
            np.median(spread) if len(spread) else np.nan,
            np.median(np.abs(two_sided)), (np.abs(two_sided) <= 0.75).mean(),
            np.median(np.abs(sample)), (np.abs(sample) <= 0.75).mean(),
        ]  # fmt: skip
        row([name, rig, kind, *(f"{c:.3f}" for c in cells)])
        made.append({"scene": name, "rig": rig, "pictures": kind, "cells": [float(c) for c in cells]})
    return made


def _errors(entry: Any, seed: int) -> list[np.ndarray]:
    """Returns errors of StereoSGBM everywhere and on people, of the block matcher, of a constant; spreads of people;
    errors of StereoSGBM's mode HH, and with the parameters of OpenCV's sample."""
    sequence = simulate(entry.scenario, seed, entry.repeat, streams=("left", "right", "disparity"))
    camera = sequence.camera
    assert camera is not None
    scale = camera.focal_px[0] * camera.baseline
    largest = 16 * int(np.ceil((scale / 2.5 + 1) / 16))
    sgbm = cv2.StereoSGBM.create(0, largest, 5, 8 * 75, 32 * 75, 1, 31, 5, 0, 0)
    sided = cv2.StereoSGBM.create(0, largest, 5, 8 * 75, 32 * 75, 1, 31, 5, 0, 0, cv2.STEREO_SGBM_MODE_HH)
    sample = cv2.StereoSGBM.create(0, largest, 16, 8 * 27, 32 * 27, 1, 0, 10, 100, 32)
    own = SubtractionStereo(scale / 2.5, BLOCK)
    made: list[list[np.ndarray]] = [[np.zeros(0)] for _ in range(7)]
    for frame in sequence:
        if frame.index % STEP != 1:
            continue
        truth = sequence.frame_truth(frame.index)
        assert truth is not None
        assert truth.pixels is not None
        assert truth.pixels.disparity is not None
        assert frame.image is not None
        assert frame.right is not None
        d, ids = truth.pixels.disparity, truth.pixels.ids
        known = np.isfinite(d) & (ids >= 0)
        known[:, :largest] = False
        found = sgbm.compute(frame.image, frame.right) / 16.0
        grey = [cv2.cvtColor(image, cv2.COLOR_BGR2GRAY) for image in (frame.image, frame.right)]
        inside = own.match(grey[0], grey[1], ids > 0).disparity
        valid = known & (found > 0)
        made[0].append((found - d)[valid])
        both = sided.compute(frame.image, frame.right) / 16.0
        made[5].append((both - d)[known & (both > 0)])
        usual = sample.compute(frame.image, frame.right) / 16.0
        made[6].append((usual - d)[known & (usual > 0)])
        made[1].append((found - d)[valid & (ids > 0)])
        made[2].append((inside - d)[known & (ids > 0) & np.isfinite(inside)])
        made[3].append((d - np.median(d[known]))[known])
        for person in np.unique(ids[ids > 0]).tolist():
            rows, _ = np.nonzero(ids == person)
            middle = int(np.median(rows))
            line = d[middle][(ids[middle] == person) & np.isfinite(d[middle])]
            if len(line) > 3 and scale / np.median(line) < 5:
                made[4].append(np.array([np.ptp(line) * 60 / scale]))
    return [np.concatenate(m) for m in made]
