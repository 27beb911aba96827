"""Kernels of tracking.papers.blob.person_template: where templates explain most; twins: tests/reference_templates.

A template is moved on a grid round its place while the others rest. Its rows' sums, in halves of a foreground pixel,
are differences of the image rows' running sums, so that a place costs one difference per row.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sim.types import Array, Bools
from tracking.papers.blob.person_template_kernels import (
    EMPTY,
    HALVES,
    Cover,
    area,
    half_width,
    kernel,
    near_first,
    paint,
    paint_all,
    row_range,
)

Whole = NDArray[np.int32]
STEPS_PER_HEIGHT = 24  # of the coarse grid, whose steps are 1 px at least; the fine grid's are half as long
MOST_STEPS = 8  # either way on the coarse grid, which reaches as far as 2.5 standard deviations
FINE_STEPS = 2  # either way on the fine grid
SWEEPS = 3  # over all templates: one coarse, the others fine


@kernel
def column_range_within(x: float, half: float, low: np.int32, high: np.int32) -> tuple[np.int32, np.int32]:
    """As `span`, but within the columns low..high and counted from low; both ends are equal where there are none."""
    left, right = np.int32(np.ceil(x - half - 0.5)), np.int32(np.floor(x + half - 0.5)) + np.int32(1)
    left = min(max(left, low), high)
    return left - low, min(max(right, left), high) - low


@kernel
def worth_when_moved(foreground: Bools, cover: Cover, template: Array, steps: int, step: float) -> Whole:
    """(2 steps + 1, 2 steps + 1) what uncovered pixels of the template are worth, in halves, when it is moved by
    multiples of step (rows: down). Each of its rows takes one difference of the image row's running sum."""
    x, foot, h, w = template
    reach = steps * step
    low, high = max(int(foot - h - reach) - 1, 0), min(int(foot + reach) + 2, cover.shape[0])
    left, right = max(int(x - w / 2 - reach) - 1, 0), min(int(x + w / 2 + reach) + 2, cover.shape[1])
    n = 2 * steps + 1
    found = np.zeros((n, n), np.int32)
    if high <= low or right <= left:
        return found
    middle, edges = x + step * np.arange(-steps, steps + 1), (np.int32(left), np.int32(right))
    begin, end = np.empty(n, np.int32), np.empty(n, np.int32)
    sums = row_sums(foreground[low:high, left:right], cover[low:high, left:right])
    for i in range(n):
        down = foot + (i - steps) * step
        first, last = row_range(down, h, cover.shape[0])
        for row in range(first, last):
            half = half_width(row, down, h, w)
            if half > 0:
                for j in range(n):
                    begin[j], end[j] = column_range_within(middle[j], half, *edges)
                for j in range(n):
                    found[i, j] += sums[row - low, end[j]] - sums[row - low, begin[j]]
    return found


@kernel
def row_sums(foreground: Bools, cover: Cover) -> Whole:
    """(H, W + 1) sums along rows of what uncovered pixels are worth, in halves."""
    sums = np.empty((cover.shape[0], cover.shape[1] + 1), np.int32)
    for row in range(cover.shape[0]):
        total = 0
        sums[row, 0] = 0
        for column in range(cover.shape[1]):
            worth = HALVES if foreground[row, column] else EMPTY
            total += worth if cover[row, column] == 0 else 0
            sums[row, column + 1] = total
    return sums


@kernel
def best_place(
    foreground: Bools, cover: Cover, at: Array, expected: Array, spread: Array, evidence: float, fine: bool
) -> tuple[float, float]:
    """The best x, foot round `at` of a template that is not painted: evidence * support - d^2 / 2, see settle."""
    step, steps = max(at[2] / STEPS_PER_HEIGHT, 1.0), FINE_STEPS
    if fine:
        step /= 2
    else:
        steps = int(min(max(np.ceil(2.5 * max(spread[0], spread[1]) / step), FINE_STEPS), MOST_STEPS))
    halves = worth_when_moved(foreground, cover, at, steps, step)
    whole = area(at, cover.shape[0], cover.shape[1])
    best, right, down = -np.inf, 0.0, 0.0
    for i in range(2 * steps + 1):
        v = (at[1] - expected[1] + (i - steps) * step) / spread[1]
        for j in range(2 * steps + 1):
            u = (at[0] - expected[0] + (j - steps) * step) / spread[0]
            value = evidence * (halves[i, j] / HALVES) / whole - (u * u + v * v) / 2
            if value > best:
                best, right, down = value, (j - steps) * step, (i - steps) * step
            if i == steps and j == steps:
                here = value
    return (at[0] + right, at[1] + down) if best > here else (at[0], at[1])


@kernel
def fit_places(foreground: Bools, cover: Cover, templates: Array, spread: Array, evidence: float) -> Array:
    """(K, 4) templates where they explain most, near ones first, each while the others rest; painted when done.

    spread (K, 2): standard deviation px of each one's expected x and foot; evidence: nats for full support.
    """
    found, order = templates.copy(), near_first(templates)
    paint_all(cover, found, 1)
    for sweep in range(SWEEPS):
        any_moved = False
        for k in order:
            paint(cover, found[k], -1)
            x, foot = best_place(foreground, cover, found[k], templates[k], spread[k], evidence, sweep > 0)
            any_moved |= x != found[k, 0] or foot != found[k, 1]
            found[k, 0], found[k, 1] = x, foot
            paint(cover, found[k], 1)
        if not any_moved:
            break
    return found
