"""Do the two pictures of a pair agree with the true disparity, without any matcher?

Each pixel of the left picture is compared with the right picture at its true disparity plus a shift. `people`,
`ground`: the shift with the least mean absolute difference, px, by a parabola through the smallest of 13 shifts and its
neighbours; 0 if pictures and truth agree. `at 1 px`: mean difference at shifts of 1 px over that at the true disparity,
on people; a matcher can be right only if it is well above 1. Pictures are without noise; pixels at the outlines are
left out.
"""

from __future__ import annotations

import argparse
from itertools import product

import cv2
import numpy as np

from benchmarks.stereo.pictures import RIGS
from benchmarks.stereo.scenes import SUITE, entries
from benchmarks.support.tables import head, row
from scenarios.loading.resolve import resolve
from sim.sequence import simulate

SHIFTS = np.arange(-6, 7) / 4
STEP, MOST = 60, 20000


def photometric(args: argparse.Namespace) -> list[list[str]]:
    """Prints the table and returns its rows."""
    head(("scene", "rig", "people", "ground", "at 1 px"))
    made = []
    for name, rig in product(entries(args.only), RIGS):
        (entry,) = [e for e in resolve(SUITE, (*RIGS[rig], "picture.noise=0")) if e.name == f"stereo-{name}"]
        people, ground = (np.mean([_differences(entry, seed, p) for seed in args.seeds], 0) for p in (True, False))
        worse = (people[2] + people[-3]) / 2 / people[len(SHIFTS) // 2]
        cells = [name, rig, f"{_least(people):+.3f}", f"{_least(ground):+.3f}", f"{worse:.1f}"]
        row(cells)
        made.append(cells)
    return made


def _differences(entry, seed: int, people: bool) -> np.ndarray:  # type: ignore[no-untyped-def]
    """Returns the mean absolute differences (13,) of grey values at each shift, on people or on the ground."""
    sequence = simulate(entry.scenario, seed, entry.repeat, streams=("left", "right", "disparity"))
    found = []
    for frame in sequence:
        if frame.index % STEP != 1:
            continue
        pixels = sequence.frame_truth(frame.index).pixels
        d = pixels.disparity
        mask = np.isfinite(d) & ((pixels.ids > 0) if people else (pixels.ids == 0))
        v, u = np.nonzero(cv2.erode(mask.astype(np.uint8), np.ones((3, 3), np.uint8)))
        some = np.random.default_rng(0).permutation(len(v))[:MOST]
        v, u = v[some], u[some]
        if not len(v):
            continue
        left, right = (cv2.cvtColor(i, cv2.COLOR_BGR2GRAY).astype(np.float32) for i in (frame.image, frame.right))
        at = u - d[v, u]
        ok = (at > 2) & (at < left.shape[1] - 3)
        v, u, at = v[ok], u[ok], at[ok]
        rows = v.astype(np.float32)[None]
        shifted = [cv2.remap(right, (at - s).astype(np.float32)[None], rows, cv2.INTER_LINEAR)[0] for s in SHIFTS]
        found.append([np.abs(s - left[v, u]).mean() for s in shifted])
    return np.mean(found, 0)


def _least(values: np.ndarray) -> float:
    """Returns the place of the least value, px, by a parabola through it and its neighbours."""
    k = int(np.clip(values.argmin(), 1, len(values) - 2))
    a, b, c = values[k - 1 : k + 2]
    return float(SHIFTS[k] + (a - c) / (a - 2 * b + c) / 2 * (SHIFTS[1] - SHIFTS[0]))
