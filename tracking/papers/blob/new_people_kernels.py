"""Kernels of tracking.papers.blob.new_people: where guesses stand, and how many templates explain most."""

from __future__ import annotations

import numpy as np

from sim.types import Array, Bools, Ints
from tracking.detect.blobs import Labels
from tracking.papers.blob import person_template_kernels as kernels
from tracking.papers.blob import person_template_search_kernels as moves
from tracking.papers.blob.person_template_kernels import Cover, kernel

LOWEST = 0.98  # quantile of a part's rows: where it stands
REACH = moves.MOST_STEPS + moves.SWEEPS * moves.FINE_STEPS  # coarse steps that settle takes, and some to spare
ROUNDING = 1e-9


@kernel
def part_feet(label: Labels, which: int, box: Ints, most: int) -> Array:
    """(1 + 2 + … + most, 2) where parts of the region `which` of labels (H, W) stand, box ltwh: for each number of
    parts up to `most` the region's columns, with as many pixels each, left to right; their mean x and lower end."""
    left, top, wide, high = box
    per_row = np.zeros(high, np.int64)
    pixels = 0
    for row in range(top, top + high):
        for column in range(left, left + wide):
            pixels += label[row, column] == which
    found = np.empty((most * (most + 1) // 2, 2))
    n = 0
    for count in range(1, most + 1):
        size, more = pixels // count, pixels % count
        taken, total, part = 0, 0, 0
        per_row[:] = 0
        for column in range(left, left + wide):
            for row in range(top, top + high):
                if label[row, column] == which:
                    taken, total = taken + 1, total + column
                    per_row[row - top] += 1
                    if taken == size + (part < more):
                        found[n, 0], found[n, 1] = total / taken + 0.5, quantile(per_row, taken, LOWEST, top) + 1
                        n, part, taken, total = n + 1, part + 1, 0, 0
                        per_row[:] = 0
    return found


@kernel
def quantile(counts: Ints, n: int, q: float, least: int) -> float:
    """The quantile q of n whole numbers of which counts[k] are least + k, linear between neighbours as numpy's."""
    place = q * (n - 1)
    low = int(place)
    below, above, passed = -1, -1, 0
    for value in range(len(counts)):
        passed += counts[value]
        if below < 0 and passed > low:
            below = value
        if passed > min(low + 1, n - 1):
            above = value
            break
    below, above, t = below + least, above + least, place - low
    return above - (above - below) * (1 - t) if t >= 0.5 else below + (above - below) * t


@kernel
def fit_new_people(
    foreground: Bools,
    cover: Cover,
    guesses: Array,
    most: int,
    person: float,
    support: float,
    spread: Array,
    nats: float,
) -> Array:
    """(K, 4) the templates that explain most for their number, painted: of 1, 2, … `most`, settled from their guesses
    (1 + 2 + … + most, 4), each number's after the other; each costs `support` of a person's area, and needs as much of
    its own. spread, nats: as settle has them. Numbers too great to be worth more are not tried."""
    best, worth = np.zeros((0, 4)), 0.0
    first, bound = 0, unexplained_within_reach(foreground, cover, guesses) / person + ROUNDING
    for count in range(1, most + 1):
        if bound - count * support <= worth:
            break
        one, far = guesses[first : first + count], spread[first : first + count]
        first += count
        at = moves.fit_places(foreground, cover, one, far, nats)
        alone = kernels.supports(foreground, cover, at, 1)
        kernels.paint_all(cover, at, -1)
        value = joint_support(foreground, cover, at) / person - count * support
        if value > worth and alone.min() >= support:
            best, worth = at, value
    kernels.paint_all(cover, best, 1)
    return best


@kernel
def unexplained_within_reach(foreground: Bools, cover: Cover, guesses: Array) -> int:
    """Uncovered foreground pixels in the box that holds these templates wherever settle may take them."""
    low, high, left, right = np.inf, -np.inf, np.inf, -np.inf
    for k in range(len(guesses)):
        x, foot, h, w = guesses[k]
        far = REACH * max(h / moves.STEPS_PER_HEIGHT, 1.0)
        low, high = min(low, foot - h - far), max(high, foot + far)
        left, right = min(left, x - w / 2 - far), max(right, x + w / 2 + far)
    found = 0
    for row in range(int(max(low, 0)), int(min(high + 1, foreground.shape[0]))):
        for column in range(int(max(left, 0)), int(min(right + 1, foreground.shape[1]))):
            found += foreground[row, column] and cover[row, column] == 0
    return found


@kernel
def joint_support(foreground: Bools, cover: Cover, templates: Array) -> float:
    """Sum of what pixels are worth that these templates cover; none of them is painted."""
    total = 0.0
    for k in range(len(templates)):
        part = kernels.support(foreground, cover, templates[k], 0)
        total += part * kernels.area(templates[k], cover.shape[0], cover.shape[1])
        kernels.paint(cover, templates[k], 1)
    kernels.paint_all(cover, templates, -1)
    return total
