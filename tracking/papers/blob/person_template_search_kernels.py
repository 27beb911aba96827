"""Kernels of tracking.papers.blob.person_template: the search for the places where templates explain most.

Templates are upright ellipses x (middle), foot (lower edge), h, w, px. foreground (H, W) bool; cover (H, W) int16: the
number of templates over each pixel, plus EXPLAINED = 1000 where a blob of one person explains it. Slow twins for tests:
tests/reference_templates.py. A template moves on a grid round its place while the others stay. The sum over one of its
rows is a difference of the image row's running sum, so that a place costs one difference per row.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sim.types import Array, Bools, Image
from tracking.papers.blob import person_template_kernels as kernels
from tracking.papers.blob.person_look_kernels import look_fits
from tracking.papers.blob.person_template_kernels import FOOT, HEIGHT, Cover, X, kernel

Whole = NDArray[np.int32]
STEPS_PER_HEIGHT = 24  # a coarse step is the template's height over this, but at least 1 px; a fine step is half of it
MOST_STEPS = 8  # most steps in each direction of the coarse grid, which reaches up to 2.5 standard deviations
FINE_STEPS = 2  # steps in each direction of the fine grid, and fewest of the coarse grid
LOOK_EVIDENCE = 3.0  # nats: weight of the mean log-likelihood ratio of a look's points, which are not independent
SWEEPS = 3  # most sweeps over all templates: the first on the coarse grid, the others on the fine grid


@kernel
def worth_when_moved(foreground: Bools, cover: Cover, template: Array, steps: int, step: float) -> Whole:
    """Returns the sum over a template's uncovered pixels at each place of a grid round its own, in halves of a pixel,
    int32.

    Shape (2 steps + 1, 2 steps + 1): rows are moves down, columns moves to the right, by multiples of `step` px from
    -steps to steps. A pixel counts 2 halves if it is foreground, -1 if background, 0 if its cover is not 0. template
    (4,): x, foot, h, w, px, not painted. Pixels outside the image count 0.
    """
    x, foot, h, w = template
    low, high, left, right = kernels.window(template, steps * step, cover.shape)
    n = 2 * steps + 1
    found = np.zeros((n, n), np.int32)
    if high <= low or right <= left:
        return found
    middle, begin, end = np.empty(n), np.empty(n, np.int32), np.empty(n, np.int32)
    for j in range(n):
        middle[j] = x + step * (j - steps)
    sums = row_sums(foreground[low:high, left:right], cover[low:high, left:right])
    for i in range(n):
        down = foot + (i - steps) * step
        first, last = kernels.row_range(down, h, cover.shape[0])
        for row in range(first, last):
            half = kernels.half_width(row, down, h, w)
            if half > 0:
                for j in range(n):
                    begin[j], end[j] = kernels.column_range(middle[j], half, np.int32(left), np.int32(right))
                for j in range(n):
                    found[i, j] += sums[row - low, end[j]] - sums[row - low, begin[j]]
    return found


@kernel
def row_sums(foreground: Bools, cover: Cover) -> Whole:
    """Returns running sums along the rows, (H, W + 1), first column 0, of what pixels count in halves of a foreground
    pixel.

    A pixel of foreground (H, W) counts 2, of background -1, and 0 where cover (H, W) is not 0.
    """
    sums = np.empty((cover.shape[0], cover.shape[1] + 1), np.int32)
    for row in range(cover.shape[0]):
        total = 0
        sums[row, 0] = 0
        for column in range(cover.shape[1]):
            worth = kernels.HALVES if foreground[row, column] else kernels.EMPTY
            total += worth if cover[row, column] == 0 else 0
            sums[row, column + 1] = total
    return sums


@kernel
def grid(h: float, spread: Array, fine: bool) -> tuple[int, float]:
    """Returns the steps in each direction and the step, px, of the grid round a template of height h.

    spread (2,): standard deviation of its x and foot, px.
    """
    step = max(h / STEPS_PER_HEIGHT, 1.0)
    if fine:
        return FINE_STEPS, step / 2
    return int(min(max(np.ceil(2.5 * max(spread[0], spread[1]) / step), FINE_STEPS), MOST_STEPS)), step


@kernel
def best_place(worth: Array, step: float, at: Array, expected: Array, spread: Array) -> tuple[float, float]:
    """Returns x and foot, px, on the grid round template `at` (4,) x, foot, h, w with the largest worth - d^2 / 2.

    worth: log-likelihood at each place of the grid, whose steps are `step` px. d is the distance from the expected
    place in standard deviations. expected (4,): template at its expected place; spread (2,): standard deviation of its
    x and foot, px. Returns the place of `at` unless another one is better.
    """
    steps = len(worth) // 2
    best, right, down = -np.inf, 0.0, 0.0
    for i in range(2 * steps + 1):
        v = (at[FOOT] - expected[FOOT] + (i - steps) * step) / spread[1]
        for j in range(2 * steps + 1):
            u = (at[X] - expected[X] + (j - steps) * step) / spread[0]
            value = worth[i, j] - (u * u + v * v) / 2
            if value > best:
                best, right, down = value, (j - steps) * step, (i - steps) * step
            if i == steps and j == steps:
                here = value
    return (at[X] + right, at[FOOT] + down) if best > here else (at[X], at[FOOT])


@kernel
def touches_another(templates: Array, k: int) -> bool:
    """Returns True if the box of template k touches that of another of the templates (K, 4)."""
    for other in range(len(templates)):  # noqa: SIM110  (numba has no `any` of a generator)
        if other != k and kernels.boxes_touch(templates[k], templates[other]):
            return True
    return False


@kernel
def fit_places(
    foreground: Bools, cover: Cover, templates: Array, spread: Array, evidence: float, image: Image, looks: Array
) -> Array:
    """Returns the templates (K, 4) x, foot, h, w, px, at the places where they explain most, and paints them into
    `cover`.

    templates: at their expected places, not painted, not changed; sizes stay. Each in turn moves to the largest
    evidence * support + LOOK_EVIDENCE * fit - d^2 / 2 while the others stay, those with low feet first, in at most
    SWEEPS = 3 sweeps; a sweep without a move is the last. Support: the pixels that nothing covers, 1 for foreground,
    -1/2 for background, over the template's area. Fit: of its look, if it touches another template. d: as in
    `best_place`. foreground, cover (H, W). spread (K, 2): standard deviation, px, of the expected x and foot. evidence:
    log-likelihood of full support. image (H, W, 3) BGR; looks (K, POINTS, 5), or (0, POINTS, 5) to ignore looks.
    """
    found, order = templates.copy(), kernels.near_first(templates)
    kernels.paint_all(cover, found, 1)
    for sweep in range(SWEEPS):
        any_moved = False
        for k in order:
            kernels.paint(cover, found[k], -1)
            steps, step = grid(found[k, HEIGHT], spread[k], sweep > 0)
            halves = worth_when_moved(foreground, cover, found[k], steps, step)
            worth = evidence * (halves / kernels.HALVES) / kernels.area(found[k], cover.shape[0], cover.shape[1])
            if len(looks) and touches_another(found, k):
                worth += LOOK_EVIDENCE * look_fits(image, cover, found, k, looks[k], steps, step)
            x, foot = best_place(worth, step, found[k], templates[k], spread[k])
            any_moved |= x != found[k, X] or foot != found[k, FOOT]
            found[k, X], found[k, FOOT] = x, foot
            kernels.paint(cover, found[k], 1)
        if not any_moved:
            break
    return found
