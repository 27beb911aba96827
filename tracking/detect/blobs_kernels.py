"""Kernels of tracking.detect.blobs: connected regions of a mask, from runs of pixels.

A run is a maximal sequence of foreground pixels in one row. `runs` (R, 3) int32 has row, first column, last column + 1
of each, in raster order. After the runs are found the mask is not read again. Slow twins: tests/reference_blobs.py.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sim.compiler import njit
from sim.elementary_kernels import find_root
from sim.types import Array, Bools, Image, Ints

Labels = NDArray[np.int32]
ROW, FIRST, END = range(3)
"""Columns of `runs`; END is the last column + 1."""
LEFT, TOP, RIGHT, BOTTOM = range(4)
"""Columns of `corners`; RIGHT and BOTTOM are the last column and row + 1."""
XX, XY, YY = range(3)
"""Columns of `spread`: variance of the columns, covariance, variance of the rows."""


def runs(mask: Bools) -> Labels:
    """Returns the runs (R, 3) int32 of a foreground mask (H, W) bool, in raster order; R = 0 for an empty mask.

    A run is a maximal sequence of foreground pixels in one row; its columns are row, first column, last column + 1.
    """
    pixels = mask.ravel().view(np.uint8)
    pixels = pixels.copy() if pixels.ctypes.data % 8 else pixels
    high, wide = mask.shape
    found = np.empty((high * ((wide + 1) // 2), 3), np.int32)
    n = find_runs(pixels, pixels[: len(pixels) // 8 * 8].view(np.uint64), wide, found)
    return found[:n].copy()


@njit(cache=True)
def find_runs(pixels: Image, eights: NDArray[np.uint64], wide: int, found: Labels) -> int:
    """Writes the runs of pixels (H wide,) to `found`, and returns how many; eights: the same bytes, eight at once.

    Eight background pixels at once are skipped in one step.
    """
    n = 0
    for row in range(len(pixels) // max(wide, 1)):
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
                found[n, ROW], found[n, FIRST], found[n, END] = row, first - row * wide, at - row * wide
                n += 1
    return n


@njit(cache=True)
def connect(runs: Labels) -> tuple[Ints, int]:
    """Returns the region of each run (R,), and the number of regions; regions are numbered 0, 1, … by their first
    pixels.

    runs (R, 3): row, first column, last column + 1, in raster order. Two runs are in one region if pixels of theirs are
    8 neighbours, directly or through other runs.
    """
    parent = np.empty(len(runs), np.int64)
    above = 0
    for k in range(len(runs)):
        parent[k] = k
        row, first, end = runs[k, ROW], runs[k, FIRST], runs[k, END]
        while runs[above, ROW] < row - 1 or (runs[above, ROW] == row - 1 and runs[above, END] < first):
            above += 1
        other = above
        while runs[other, ROW] == row - 1 and runs[other, FIRST] <= end:
            a, b = find_root(parent, k), find_root(parent, other)
            parent[max(a, b)] = min(a, b)
            other += 1
    count = 0
    for k in range(len(runs)):
        if parent[k] == k:
            parent[k] = count
            count += 1
        else:
            parent[k] = parent[parent[k]]
    return parent, count


@njit(cache=True)
def extents(runs: Labels, region: Ints, count: int) -> tuple[Ints, Ints]:
    """Returns the number of pixels (M,) of each of M regions, and its corners (M, 4).

    Corners: first column, first row, last column + 1, last row + 1. runs (R, 3): row, first column, last column + 1, in
    raster order. region (R,): region 0 to M - 1 of each run. count: M.
    """
    area, corners = np.zeros(count, np.int64), np.zeros((count, 4), np.int64)
    for k in range(len(runs)):
        row, first, end = runs[k, ROW], runs[k, FIRST], runs[k, END]
        m = region[k]
        if area[m] == 0:
            corners[m, LEFT], corners[m, TOP] = first, row
        area[m] += end - first
        corners[m, LEFT], corners[m, RIGHT] = min(corners[m, LEFT], first), max(corners[m, RIGHT], end)
        corners[m, BOTTOM] = row + 1
    return area, corners


@njit(cache=True)
def moments(runs: Labels, region: Ints, area: Ints) -> tuple[Array, Array]:
    """Returns mean column and row (M, 2), and variance of columns, covariance, variance of rows (M, 3) of M regions.

    They are moments (divided by the number of pixels) of the pixels' indices, in px and px^2. runs (R, 3): row, first
    column, last column + 1. region (R,): number of each run's region, 0 to M - 1; runs with a negative number are left
    out. area (M,): pixels of each region; a region with area 0 gives nan.
    """
    centre, spread = np.zeros((len(area), 2)), np.zeros((len(area), 3))
    for k in range(len(runs)):
        m = region[k]
        if m >= 0:
            row, first, end = runs[k, ROW], runs[k, FIRST], runs[k, END]
            n = end - first
            centre[m, 0] += n * (first + end - 1) / 2
            centre[m, 1] += n * row
    for m in range(len(area)):
        for d in range(2):
            centre[m, d] = centre[m, d] / area[m] if area[m] else np.nan
    for k in range(len(runs)):
        m = region[k]
        if m >= 0:
            row, first, end = runs[k, ROW], runs[k, FIRST], runs[k, END]
            y = row - centre[m, 1]
            xx, xy, yy = spread[m, XX], spread[m, XY], spread[m, YY]
            for column in range(first, end):
                x = column - centre[m, 0]
                xx, xy, yy = xx + x * x, xy + x * y, yy + y * y
            spread[m, XX], spread[m, XY], spread[m, YY] = xx, xy, yy
    for m in range(len(area)):
        for d in range(3):
            spread[m, d] = spread[m, d] / area[m] if area[m] else np.nan
    return centre, spread


@njit(cache=True)
def write_labels(runs: Labels, region: Ints, label: Labels) -> None:
    """Writes region + 1 into the pixels of each run in `label` (H, W), in place; other pixels are not changed.

    runs (R, 3): row, first column, last column + 1. region (R,): region of each run, from 0; a run with a negative
    region is left out.
    """
    for k in range(len(runs)):
        if region[k] >= 0:
            row, value = runs[k, ROW], region[k] + 1
            for column in range(runs[k, FIRST], runs[k, END]):
                label[row, column] = value
