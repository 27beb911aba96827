"""Kernels of tracking.detect.subtraction_stereo: block matching at the pixels of a mask.

The same integers as OpenCV's `cv2.StereoBM`, at fewer pixels: its prefilter (Sobel along the row, clipped), the sum of
absolute differences (SAD) over a square block, its test of uniqueness, and its parabola. Row sums of differences are
made for the rows and columns that blocks of masked pixels touch. The SAD of a pixel is that of the pixel above it, with
one row more and one less.

Disparities d are in the order D - 1 to 0 px, so that the right pictures' columns x - D + 1 to x are read in order. A
run (row, first column, end) is a maximal sequence of pixels of a mask in one row.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sim.compiler import njit
from sim.types import Bools, Image

Runs = NDArray[np.int32]
Shorts = NDArray[np.int16]
Sads = NDArray[np.int16] | NDArray[np.int32]
Costs = NDArray[np.int32]
Floats = NDArray[np.float32]
CAP = 31
"""Largest absolute value of the filtered pictures, OpenCV's default."""
STEPS = 16
"""Disparity steps per px."""


@njit(cache=True)
def reach(runs: Runs, half: int, shape: tuple[int, int]) -> Bools:
    """Returns the pixels (H, W) of a picture of this shape at most `half` rows above or below runs (R, 3)."""
    near = np.zeros(shape, np.bool_)
    for k in range(len(runs)):
        row, first, end = runs[k]
        near[max(row - half, 0) : row + half + 1, first:end] = True
    return near


@njit(cache=True)
def sobel(picture: Image, row: int, first: int, end: int, filtered: Shorts, smooth: Shorts) -> None:
    """Fills columns first to end of `filtered` (W,), a row of the filtered picture, -CAP to CAP.

    It is 0 at the first and last column. Beyond the first and last row lies the next row inside. smooth (W,): work
    space, the row smoothed down the columns.
    """
    high, wide = picture.shape
    above = picture[row - 1 if row > 0 else min(1, high - 1)]
    here = picture[row]
    below = picture[row + 1 if row < high - 1 else max(high - 2, 0)]
    for x in range(max(first - 1, 0), min(end + 1, wide)):
        smooth[x] = np.int16(int(above[x]) + int(below[x]) + 2 * int(here[x]))
    for x in range(max(first, 1), min(end, wide - 1)):
        filtered[x] = np.int16(max(-CAP, min(CAP, int(smooth[x + 1]) - int(smooth[x - 1]))))
    if first == 0:
        filtered[0] = 0
    if end == wide:
        filtered[wide - 1] = 0


@njit(cache=True)
def filtered_pair(left: Image, right: Image, needed: Runs, half: int, D: int, filters: Shorts) -> None:
    """Fills `filters` (2, H, W), the filtered left and right picture, where `row_sums` of the runs `needed` (R, 3)
    reads them."""
    smooth = np.empty(left.shape[1], np.int16)
    for k in range(len(needed)):
        row, first, end = needed[k]
        sobel(left, row, first - half, end + half, filters[0, row], smooth)
        sobel(right, row, first - half - D + 1, end + half, filters[1, row], smooth)


@njit(cache=True)
def row_sums(left: Shorts, right: Shorts, first: int, end: int, half: int, apart: Shorts, sums: Shorts) -> None:
    """Fills columns first to end of `sums` (W, D): the sums over 2 half + 1 columns of the absolute differences at each
    disparity.

    left, right (W,): a row of the filtered pictures. apart (W, D): work space, the differences themselves.
    """
    D = sums.shape[1]
    for x in range(first - half, end + half):
        value, other, here = left[x], right[x - D + 1 : x + 1], apart[x]
        for d in range(D):
            here[d] = np.int16(max(value, other[d]) - min(value, other[d]))
    total = sums[first]
    total[:] = 0
    for x in range(first - half, first + half + 1):
        here = apart[x]
        for d in range(D):
            total[d] += here[d]
    for x in range(first + 1, end):
        total, before, new, old = sums[x], sums[x - 1], apart[x + half], apart[x - half - 1]
        for d in range(D):
            total[d] = np.int16(before[d] + new[d] - old[d])


@njit(cache=True)
def best(sad: Sads, unique: int) -> tuple[float, int]:
    """Returns the disparity, px, with the least of the SADs (D,), and that SAD; nan if there is no disparity.

    The largest of equal ones counts. There is none if another disparity more than 1 px away has a SAD at most `unique`
    % larger. It may be a little below 0.
    """
    D = len(sad)
    least = sad[0]
    for d in range(1, D):
        least = min(least, sad[d])
    limit = sad.dtype.type(least + least * unique // 100)
    close = sad.dtype.type(0)
    for d in range(D):
        close += sad.dtype.type(sad[d] <= limit)
    k = 0
    while sad[k] != least:
        k += 1
    for d in range(max(k - 1, 0), min(k + 2, D)):
        close -= sad.dtype.type(sad[d] <= limit)
    if close:
        return np.nan, int(least)
    more = int(sad[k + 1] if k < D - 1 else sad[D - 2])
    less = int(sad[k - 1] if k > 0 else sad[1])
    bend = more + less - 2 * int(least) + abs(more - less)
    part = 0
    if bend:
        part = abs(more - less) * 256 // bend
        part = part if more > less else -part
    found = ((D - 1 - k) * 256 + part + 15) >> 4
    return found / STEPS, int(least)


@njit(cache=True)
def block_match(
    runs: Runs, needed: Runs, half: int, unique: int, filters: Shorts, sad: Sads, found: Floats, cost: Costs
) -> None:
    """Fills `found` (H, W) with the disparities, px, at the pixels of the runs (R, 3), in raster order, and `cost`
    (H, W) with their SADs.

    needed (Q, 3): runs of the pixels at most `half` rows above or below them; filters (2, H, W): the filtered pictures.
    sad (W, D): work space; its type must hold 2 CAP times the area of a block, and `unique` % more.
    Blocks and the columns of their matches must lie inside the pictures.
    """
    wide, D = sad.shape
    kept = 2 * half + 2
    sums = np.empty((kept, wide, D), np.int16)
    apart = np.empty((wide, D), np.int16)
    at = np.full(wide, -2)
    q = 0
    for k in range(len(runs)):
        row, first, end = runs[k]
        while q < len(needed) and needed[q, 0] <= row + half:
            y = needed[q, 0]
            row_sums(filters[0, y], filters[1, y], needed[q, 1], needed[q, 2], half, apart, sums[y % kept])
            q += 1
        one_more, one_less = sums[(row + half) % kept], sums[(row - half - 1) % kept]
        line, prices = found[row], cost[row]
        for x in range(first, end):
            total = sad[x]
            if at[x] == row - 1:
                new, old = one_more[x], one_less[x]
                for d in range(D):
                    total[d] += sad.dtype.type(np.int16(new[d] - old[d]))
            else:
                total[:] = 0
                for y in range(row - half, row + half + 1):
                    new = sums[y % kept, x]
                    for d in range(D):
                        total[d] += sad.dtype.type(new[d])
            at[x] = row
            line[x], prices[x] = best(total, unique)


@njit(cache=True)
def left_right(runs: Runs, found: Floats, cost: Costs) -> None:
    """Sets `found` (H, W) to nan where another pixel of the runs (R, 3) matches the same place better, by `cost`.

    It is OpenCV's check: a disparity d at column x stays if the best match of column x - d, rounded down or up, has a
    disparity at most 1 px from d, or if there is none. Disparities up to 0 take part, and become nan.
    """
    wide = found.shape[1]
    price, match = np.empty(wide, np.int32), np.empty(wide, np.float32)
    k = 0
    while k < len(runs):
        row, begun = runs[k, 0], k
        match[:] = np.nan
        while k < len(runs) and runs[k, 0] == row:
            for x in range(runs[k, 1], runs[k, 2]):
                d = found[row, x]
                if not np.isnan(d):
                    there = x - int(np.floor(d + 0.5))
                    if np.isnan(match[there]) or cost[row, x] < price[there]:
                        price[there], match[there] = cost[row, x], d
            k += 1
        for j in range(begun, k):
            for x in range(runs[j, 1], runs[j, 2]):
                d = found[row, x]
                if np.isnan(d):
                    continue
                low, high = x - int(np.floor(d)), x - int(np.ceil(d))
                if d <= 0 or (abs(match[low] - d) > 1 and abs(match[high] - d) > 1):
                    found[row, x] = np.nan
