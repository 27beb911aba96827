"""Kernels of tracking.papers.blob_template: sums over upright ellipses, row by row.

A template is an ellipse filling a box of h x w px that stands on the row `foot` at column x. A row of it from column
left to right (right excluded) takes one difference of that row's running sum.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from sim.types import Array, Ints


@njit(cache=True)
def span(x: float, half: float, width: int) -> tuple[int, int]:
    """Columns whose middle lies within `half` of x, clipped to the image: left, right (excluded)."""
    left, right = int(np.ceil(x - half - 0.5)), int(np.floor(x + half - 0.5)) + 1
    return min(max(left, 0), width), min(max(right, 0), width)


@njit(cache=True)
def half_width(row: int, foot: float, h: float, w: float) -> float:
    """Half the ellipse's width in the middle of a row; negative outside."""
    t = 2 * (row + 0.5 - foot) / h + 1
    return 0.5 * w * np.sqrt(1 - t * t) if abs(t) < 1 else -1.0


@njit(cache=True)
def paint(cover: Ints, x: float, foot: float, h: float, w: float, more: int) -> None:
    """Add `more` to the pixels of a template."""
    for row in range(max(int(foot - h), 0), min(int(foot) + 1, cover.shape[0])):
        half = half_width(row, foot, h, w)
        if half > 0:
            left, right = span(x, half, cover.shape[1])
            for column in range(left, right):
                cover[row, column] += more


@njit(cache=True)
def running(gain: Array, cover: Ints, low: int, high: int, left: int, right: int, sums: Array) -> None:
    """Running sums of gain over uncovered pixels along the rows low..high, columns left..right; sums (., width + 1)."""
    for row in range(low, high):
        total = 0.0
        sums[row, left] = 0.0
        for column in range(left, right):
            if cover[row, column] == 0:
                total += gain[row, column]
            sums[row, column + 1] = total


@njit(cache=True)
def template_sum(sums: Array, x: float, foot: float, h: float, w: float, left: int, right: int) -> float:
    """Sum over a template's pixels in the columns left..right for which there are running sums."""
    total = 0.0
    for row in range(max(int(foot - h), 0), min(int(foot) + 1, sums.shape[0])):
        half = half_width(row, foot, h, w)
        if half > 0:
            a, b = span(x, half, sums.shape[1] - 1)
            a, b = max(a, left), min(b, right)
            if b > a:
                total += sums[row, b] - sums[row, a]
    return total


@njit(cache=True)
def moved(gain: Array, cover: Ints, sums: Array, template: Array, steps: int, step: float) -> Array:
    """(2 steps + 1, 2 steps + 1) sums over uncovered pixels of the template moved by multiples of step (rows: down)."""
    x, foot, h, w = template
    reach = steps * step
    low, high = max(int(foot - h - reach) - 1, 0), min(int(foot + reach) + 2, gain.shape[0])
    left, right = max(int(x - w / 2 - reach) - 1, 0), min(int(x + w / 2 + reach) + 2, gain.shape[1])
    found = np.zeros((2 * steps + 1, 2 * steps + 1))
    if high <= low or right <= left:
        return found
    running(gain, cover, low, high, left, right, sums)
    for i in range(2 * steps + 1):
        down = foot + (i - steps) * step
        for row in range(max(int(down - h), 0), min(int(down) + 1, gain.shape[0])):
            half = half_width(row, down, h, w)
            if half > 0:
                for j in range(2 * steps + 1):
                    a, b = span(x + (j - steps) * step, half, gain.shape[1])
                    a, b = max(a, left), min(b, right)
                    if b > a:
                        found[i, j] += sums[row, b] - sums[row, a]
    return found


@njit(cache=True)
def placed(gain: Array, cover: Ints, sums: Array, templates: Array) -> Array:
    """(K,) sums over uncovered pixels of templates (K, 4) x, foot, h, w."""
    found = np.zeros(len(templates))
    if not len(templates):
        return found
    low = max(int((templates[:, 1] - templates[:, 2]).min()) - 1, 0)
    high = min(int(templates[:, 1].max()) + 2, gain.shape[0])
    left = max(int((templates[:, 0] - templates[:, 3] / 2).min()) - 1, 0)
    right = min(int((templates[:, 0] + templates[:, 3] / 2).max()) + 2, gain.shape[1])
    if high <= low or right <= left:
        return found
    running(gain, cover, low, high, left, right, sums)
    for k in range(len(templates)):
        x, foot, h, w = templates[k]
        found[k] = template_sum(sums, x, foot, h, w, left, right)
    return found
