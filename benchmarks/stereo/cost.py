"""Time of subtraction stereo over dense matching, against the foreground's share; frames per second of the tracker.

`foreground`: mean share of the picture that is foreground, in bins. `touched`: share of the pixels that blocks of
foreground pixels touch, up to the width of a block. `time`: CPU time over that of dense matching by OpenCV's
`StereoBM`, medians of the frames. `target`: foreground + 15 %. The foreground is the silhouettes of the people.
`frames/s`: of the whole tracker, pictures in memory.
"""

from __future__ import annotations

import argparse
import time
from itertools import pairwise

import cv2
import numpy as np

from benchmarks.stereo.scenes import entries, recordings
from benchmarks.support.chart import Panel, lines
from benchmarks.support.tables import table
from tracking.detect.subtraction_stereo import SubtractionStereo
from tracking.run import track

BINS = (0.0, 0.01, 0.02, 0.04, 0.06, 0.08, 0.12, 1.0)
STEP, BLOCK, ROUNDS = 10, 9, 5


def cost(args: argparse.Namespace) -> dict[str, list[list[float]]]:
    """Prints both tables and returns (foreground, touched, time) of each frame by scene."""
    cv2.setNumThreads(1)
    made: dict[str, list[list[float]]] = {}
    speed = {}
    for name, entry in entries(args.only).items():
        made[name] = []
        for seed, sequence in recordings(entry, args.seeds):
            run = track("stereo", sequence, detections="image")
            speed.setdefault(name, []).append(run.info["frames_per_second"])
            camera = sequence.camera
            assert camera is not None
            stereo = SubtractionStereo(camera.focal_px[0] * camera.baseline / 2.5, BLOCK)
            for frame in sequence:
                if frame.index % STEP == 1:
                    truth = sequence.frame_truth(frame.index)
                    assert truth is not None
                    assert truth.pixels is not None
                    made[name].append(_frame(stereo, frame.image, frame.right, truth.pixels.ids > 0))
            print(name, seed, flush=True)
    every = np.array([r for rows in made.values() for r in rows])
    rows = {}
    for low, high in pairwise(BINS):
        here = every[(every[:, 0] > low) & (every[:, 0] <= high)]
        if len(here):
            share, touched, spent = here.mean(0)[0], here.mean(0)[1], np.median(here[:, 2])
            rows[f"{low:g} to {high:g}"] = [
                f"{share:.3f}",
                f"{touched:.3f}",
                f"{spent:.3f}",
                f"{share + 0.15:.3f}",
                str(len(here)),
            ]
    chart = {"time": [float(c[2]) for c in rows.values()], "touched": [float(c[1]) for c in rows.values()]}
    chart["target"] = [float(c[3]) for c in rows.values()]
    share = [float(c[0]) for c in rows.values()]
    if args.chart is not None:
        lines([Panel("Subtraction stereo over dense matching", share, chart, "share of foreground")], args.chart, 1)
    table("Cost of matching", "foreground", ("mean", "touched", "time", "target", "frames"), rows)
    table("Frames per second", "scene", ("frames/s",), {k: [f"{np.mean(v):.0f}"] for k, v in speed.items()})
    return made


def _frame(stereo: SubtractionStereo, left: object, right: object, mask: np.ndarray) -> list[float]:
    grey = [cv2.cvtColor(np.asarray(image), cv2.COLOR_BGR2GRAY) for image in (left, right)]
    touched = stereo.match(grey[0], grey[1], mask).evaluated / stereo.disparities / mask.size
    spent = [np.inf, np.inf]
    for _ in range(ROUNDS):
        for k, work in enumerate(
            (lambda: stereo.match(grey[0], grey[1], mask), lambda: stereo.dense(grey[0], grey[1]))
        ):
            begun = time.process_time_ns()
            work()
            spent[k] = min(spent[k], time.process_time_ns() - begun)
    return [float(mask.mean()), touched, spent[0] / spent[1]]
