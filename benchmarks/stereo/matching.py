"""Do matchers that have never heard of us find the true disparities of the suite `stereo-matching`?

OpenCV's block matcher (BM) and its semi-global matcher in three modes (SGBM: 5 directions, HH: 8, 3WAY: 3), with the
settings of OCV-SGBM on KITTI (block 3; BM: 15), on the first pair of each sequence, in grey. Both pictures get 128
columns more at the left, so that matchers try all pixels. Pixels without an estimate are filled from their row with the
smaller of the two nearest disparities, as on KITTI; `estimated` is the share before.

bad-1, bad-2, bad-3: % of pixels with an error above 1, 2, 3 px, mean of the sequences; of the pixels that both cameras
see, or of all that show no sky. True disparities of pixels that only the left camera sees follow from a pair of the
same scene whose cameras are 1 mm apart. `best plane`: the plane a u + b v + c that most disparities are within 1 px of,
found among 4000 planes through three pixels and fitted to its own pixels.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable

import cv2
import numpy as np

from benchmarks.support.tables import head, row, table
from scenarios.loading.resolve import load, resolve
from sim.sequence import simulate
from sim.types import Array, Image

FOLDER = "scenarios/suites/stereo-matching"
DISPARITIES, BLOCK, SMOOTH = 128, 3, 36  # px; of SGBM: smoothness penalties are SMOOTH and 8 SMOOTH
NEAR = 1e-3  # m: distance between two cameras that see the same points
PLANES = 4000
# Geiger, Lenz and Urtasun 2012, table 2: error above 3 px, non-occluded and all; pixels estimated.
KITTI = {"BM": ("25.39", "26.72", "55.84"), "HH": ("7.64", "9.13", "86.50")}
Matcher = Callable[[Image, Image], Array]


def _semi_global(mode: int) -> cv2.StereoSGBM:
    return cv2.StereoSGBM.create(
        0, DISPARITIES, BLOCK, SMOOTH, 8 * SMOOTH, disp12MaxDiff=1, preFilterCap=63, uniquenessRatio=10,
        speckleWindowSize=100, speckleRange=32, mode=mode,
    )  # fmt: skip


MATCHERS = {
    "BM": cv2.StereoBM.create(DISPARITIES, 15),
    "SGBM": _semi_global(cv2.STEREO_SGBM_MODE_SGBM),
    "HH": _semi_global(cv2.STEREO_SGBM_MODE_HH),
    "3WAY": _semi_global(cv2.STEREO_SGBM_MODE_SGBM_3WAY),
}
PLANE = "best plane"
METHODS = (*MATCHERS, PLANE)
SCORES = [f"bad-{k} {which}" for which in ("seen", "all") for k in (1, 2, 3)]


def matching(args: argparse.Namespace) -> dict[str, dict[str, dict[str, float]]]:
    """Prints the tables, and returns the mean scores by kind and method."""
    found = {}
    for name in (entry.name for entry in resolve("stereo-matching")):
        rows = [scores(name, seed) for seed in args.seeds]
        print(f"{name} {len(rows)}", file=sys.stderr, flush=True)
        found[name] = {m: {k: float(np.mean([r[m][k] for r in rows])) for k in rows[0][m]} for m in METHODS}
    found["mean"] = {
        m: {k: float(np.mean([kind[m][k] for kind in found.values()])) for k in found["thin"][m]} for m in METHODS
    }
    for which, words in (("seen", "pixels that both cameras see"), ("all", "all pixels but sky")):
        cells = {
            kind: [f"{by[m][f'bad-1 {which}']:.1f} / {by[m][f'bad-2 {which}']:.1f}" for m in METHODS]
            for kind, by in found.items()
        }
        table(f"bad-1 / bad-2, %, of {words}", "kind", METHODS, cells)
    print("\nBeside KITTI 2012: all kinds, error above 3 px, %")
    head(("matcher", "seen", "all", "estimated", "KITTI, seen", "KITTI, all", "KITTI, estimated"))
    for name in MATCHERS:
        own = [f"{found['mean'][name][key]:.2f}" for key in ("bad-3 seen", "bad-3 all", "estimated")]
        row([name, *own, *KITTI.get(name, ("–", "–", "–"))])
    return found


def scores(name: str, seed: int) -> dict[str, dict[str, float]]:
    """Returns SCORES and `estimated`, all in %, of each method for the first pair of one sequence."""
    file = f"{FOLDER}/{name}.toml"
    pair = simulate(load(file), seed, streams=("left", "right", "disparity"))
    near = simulate(load(file, [f"camera.baseline={NEAR}"]), seed, streams=("disparity",))
    (frame, *_), camera = pair.frames(), pair.camera
    seen, of_near = (sequence.load_pixels(1).disparity for sequence in (pair, near))
    every = of_near * (camera.baseline / NEAR)
    left, right = (cv2.cvtColor(image, cv2.COLOR_BGR2GRAY) for image in (frame.image, frame.right))
    made = {}
    for method in METHODS:
        estimate = plane(every, seed) if method == PLANE else matched(MATCHERS[method], left, right)
        known = np.isfinite(every)
        made[method] = {"estimated": 100 * float(np.isfinite(estimate[known]).mean())}
        error = np.abs(filled(estimate) - every)
        for score in SCORES:
            limit, which = float(score[4]), np.isfinite(seen) if score.endswith("seen") else known
            made[method][score] = 100 * float((error[which] > limit).mean())
    return made


def matched(matcher: cv2.StereoMatcher, left: Image, right: Image) -> Array:
    """Returns a matcher's disparities (H, W) px; nan without an estimate."""
    wide = [cv2.copyMakeBorder(i, 0, 0, DISPARITIES, 0, cv2.BORDER_REPLICATE) for i in (left, right)]
    found = matcher.compute(*wide)[:, DISPARITIES:] / 16.0
    return np.where(found >= 0, found, np.nan)


def filled(disparity: Array) -> Array:
    """Returns disparities (H, W) px without nan: the smaller of the nearest to the left and right; 0 in empty rows."""
    sides = []
    for ahead in (disparity, disparity[:, ::-1]):
        last = np.maximum.accumulate(np.where(np.isfinite(ahead), np.arange(ahead.shape[1]), -1), axis=1)
        sides.append(np.where(last >= 0, np.take_along_axis(ahead, np.maximum(last, 0), axis=1), np.nan))
    return np.nan_to_num(np.fmin(sides[0], sides[1][:, ::-1]))


def plane(disparity: Array, seed: int) -> Array:
    """Returns the best plane (H, W) px of a disparity map (H, W) px with nan, by random triples of pixels."""
    r = np.random.default_rng(seed)
    v, u = np.nonzero(np.isfinite(disparity))
    uv1, d = np.column_stack([u, v, np.ones(len(u))]) / 100, disparity[v, u]
    some = r.choice(len(d), 3000)
    corners = r.choice(len(d), (PLANES, 3))
    corners = corners[np.abs(np.linalg.det(uv1[corners])) > 1e-6]
    fits = np.linalg.solve(uv1[corners], d[corners][..., None])[..., 0]
    hits = [int((np.abs(uv1[some] @ fit - d[some]) <= 1).sum()) for fit in fits]
    best, most = np.zeros(3), -1.0
    for fit in fits[np.argsort(hits)[-10:]]:
        for _ in range(10):
            near = np.abs(uv1 @ fit - d) <= 1
            if near.mean() > most:
                best, most = fit, float(near.mean())
            fit = np.linalg.lstsq(uv1[near], d[near], rcond=None)[0]
    height, width = disparity.shape
    rows, columns = np.mgrid[:height, :width] / 100
    return np.asarray(best[0] * columns + best[1] * rows + best[2] / 100)
