"""Kernels of tracking.detect.blobs: connected regions of a mask, from runs of pixels.

A run is a maximal sequence of foreground pixels in one row. `runs` (R, 3) int32 has row, first column, last column + 1
of each, in raster order. region (R,): the region of each run, from 0. Slow twins: tests/reference_blobs.py.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from sim.compiler import njit
from sim.elementary_kernels import find_root
from sim.types import Array, Bools, Ints

Runs = NDArray[np.int32]


@njit(cache=True)
def find_runs(mask: Bools) -> Runs:
    """Returns the runs (R, 3) of a mask (H, W), which must be contiguous. Eight background pixels are skipped at
    once."""
    high, wide = mask.shape
    pixels = mask.ravel().view(np.uint8)
    eights = pixels[: len(pixels) // 8 * 8].view(np.uint64)
    found = np.empty((high * ((wide + 1) // 2), 3), np.int32)
    n = 0
    for row in range(high):
        at, end = row * wide, (row + 1) * wide
        while at < end:
            if at % 8 == 0 and at // 8 < len(eights) and eights[at // 8] == 0:
                at += 8
            elif pixels[at] == 0:
                at += 1
            else:
                first = at
                while at < end and pixels[at] != 0:
                    at += 1
                found[n, 0], found[n, 1], found[n, 2] = row, first - row * wide, at - row * wide
                n += 1
    return found[:n].copy()


@njit(cache=True)
def connect(runs: Runs) -> Ints:
    """Returns the first run (R,) of each run's region. Runs whose pixels are 8 neighbours are in one region."""
    region = np.arange(len(runs))
    above = 0
    for k in range(len(runs)):
        row, first, end = runs[k]
        while runs[above, 0] < row - 1 or (runs[above, 0] == row - 1 and runs[above, 2] < first):
            above += 1
        other = above
        while runs[other, 0] == row - 1 and runs[other, 1] <= end:
            a, b = find_root(region, k), find_root(region, other)
            region[max(a, b)] = min(a, b)
            other += 1
    for k in range(len(runs)):
        region[k] = region[region[k]]
    return region


@njit(cache=True)
def moments(runs: Runs, region: Ints, count: int) -> tuple[Array, Array, Array, Array]:
    """Returns, of M = `count` regions, the boxes (M, 4) left, top, width, height, px; the numbers of pixels (M,); mean
    column and row of the pixels (M, 2); and variance of columns, covariance, variance of rows (M, 3), px^2."""
    box, area, centre, spread = np.zeros((count, 4)), np.zeros(count), np.zeros((count, 2)), np.zeros((count, 3))
    for k in range(len(runs)):
        row, first, end = runs[k]
        m, n = region[k], end - first
        if area[m] == 0:
            box[m, 0], box[m, 1] = first, row
        left, right = min(box[m, 0], first), max(box[m, 0] + box[m, 2], end)
        box[m, 0], box[m, 2], box[m, 3] = left, right - left, row + 1 - box[m, 1]
        area[m] += n
        centre[m, 0] += n * (first + end - 1) / 2
        centre[m, 1] += n * row
    centre /= area.reshape(-1, 1)
    for k in range(len(runs)):
        row, first, end = runs[k]
        m = region[k]
        y, (xx, xy, yy) = row - centre[m, 1], spread[m]
        for column in range(first, end):
            x = column - centre[m, 0]
            xx, xy, yy = xx + x * x, xy + x * y, yy + y * y
        spread[m, 0], spread[m, 1], spread[m, 2] = xx, xy, yy
    return box, area, centre, spread / area.reshape(-1, 1)


@njit(cache=True)
def paint(runs: Runs, values: Any, picture: Any) -> None:
    """Writes the value of each run (R,) into its pixels of a picture (H, W), in place."""
    for k in range(len(runs)):
        picture[runs[k, 0], runs[k, 1] : runs[k, 2]] = values[k]
