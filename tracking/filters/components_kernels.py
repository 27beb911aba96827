"""Kernels of tracking.filters.components: linked points by a grid of cells, and sets of points that grow by one.

The diagonal of a cell is `link`, the largest distance of linked points, so that points of one cell are linked, and
other points can be linked only from the 20 cells around. A new point is compared with the points of those cells that
are not of its component yet and whose bounding box is near enough. At the first linked point the two components are
joined, and so are their moments, the rows of `sums` (component_regions_kernels). Slow twins:
tests/reference_components.py."""

from __future__ import annotations

import numpy as np

from sim.compiler import njit
from sim.elementary_kernels import find_root
from sim.types import Array, Bools, Ints
from tracking.filters.component_regions_kernels import WEIGHT, XX, XY, YY, X, Y, closure, fit, meet, pool

AROUND = 20
"""Cells round a cell from which points can be linked with its points."""
LOW_X, LOW_Y, HIGH_X, HIGH_Y = range(4)
"""Columns of `box`."""
VISITS, COMPONENTS = range(2)
"""Slots of `work`: cells and points compared so far; number of components."""
FAR = 2.0**40
"""Cells from the first point beyond which a point is moved nearer, so that cell numbers fit in int64."""


@njit(cache=True)
def cells(points: Array, link: float) -> tuple[Ints, Ints]:
    """Returns the cell of each point (M,), numbered by first points, and the 20 cells around each (C, 20), -1 empty."""
    m = len(points)
    # slightly less than link / sqrt 2, so that rounding never puts two points farther apart into one cell
    side = link / np.sqrt(2.0) * (1 - 1e-12)
    place = np.empty((m, 2), np.int64)
    # at most half full, so that searches are short
    table = np.full(1 << int(np.ceil(np.log2(2 * m))), -1)
    cell, first = np.empty(m, np.int64), np.empty(m, np.int64)
    count = 0
    for k in range(m):
        for axis in range(2):
            place[k, axis] = np.int64(np.floor(min(max((points[k, axis] - points[0, axis]) / side, -FAR), FAR)))
        slot = _slot(table, place, first, place[k, 0], place[k, 1])
        if table[slot] < 0:
            table[slot], first[count] = count, k
            count += 1
        cell[k] = table[slot]
    around = np.full((count, AROUND), -1)
    for c in range(count):
        x, y = place[first[c], 0], place[first[c], 1]
        n = 0
        for dx in range(-2, 3):
            for dy in range(-2, 3):
                # the corners of the 5 x 5 cells are farther away than `link`
                if (dx != 0 or dy != 0) and abs(dx) + abs(dy) < 4:
                    around[c, n] = table[_slot(table, place, first, x + dx, y + dy)]
                    n += 1
    return cell, around


@njit(cache=True)
def _slot(table: Ints, place: Ints, first: Ints, x: int, y: int) -> int:
    """Returns the slot of the hash table that holds the cell in column x and row y, or the free slot for it."""
    last = len(table) - 1
    # primes and a shift spread neighbouring cells over the table
    mixed = (x * 73_856_093) ^ (y * 19_349_663)
    slot = (mixed ^ (mixed >> 15)) & last
    while table[slot] >= 0 and (place[first[table[slot]], 0] != x or place[first[table[slot]], 1] != y):
        slot = (slot + 1) & last
    return slot


@njit(cache=True)
def insert(
    k: int, points: Array, weight: float, link: float, cell: Ints, around: Ints,
    parent: Ints, head: Ints, after: Ints, box: Array, sums: Array, work: Ints,
) -> None:  # fmt: skip
    """Adds point k to the components of the points before it, in place (4.2.1).

    head (C,), after (M,): the last added point of each cell, and the one before each point. box (C, 4): bounds of each
    cell's points. parent (M,), sums (M, 6): forest of the points, and moments at the roots.
    """
    c = cell[k]
    x, y = points[k, 0], points[k, 1]
    parent[k] = k
    sums[k, WEIGHT], sums[k, X], sums[k, Y] = weight, x, y
    sums[k, XX], sums[k, XY], sums[k, YY] = 0.0, 0.0, 0.0
    work[VISITS] += 1
    work[COMPONENTS] += 1
    if head[c] >= 0:
        _join(parent, sums, k, head[c], work)
        box[c, LOW_X], box[c, LOW_Y] = min(box[c, LOW_X], x), min(box[c, LOW_Y], y)
        box[c, HIGH_X], box[c, HIGH_Y] = max(box[c, HIGH_X], x), max(box[c, HIGH_Y], y)
    else:
        box[c, LOW_X], box[c, LOW_Y], box[c, HIGH_X], box[c, HIGH_Y] = x, y, x, y
    after[k], head[c] = head[c], k
    top = find_root(parent, k)
    for n in range(AROUND):
        other = around[c, n]
        # everything is one component: nothing more can be joined
        if work[COMPONENTS] == 1:
            break
        if other < 0 or head[other] < 0:
            continue
        work[VISITS] += 1
        if find_root(parent, head[other]) == top:
            continue
        # the bounding box of the cell's points rules most cells out without a look at its points
        gap_x = max(box[other, LOW_X] - x, x - box[other, HIGH_X], 0.0)
        gap_y = max(box[other, LOW_Y] - y, y - box[other, HIGH_Y], 0.0)
        if gap_x * gap_x + gap_y * gap_y > link * link:
            continue
        p = head[other]
        while p >= 0:
            work[VISITS] += 1
            if (points[p, 0] - x) ** 2 + (points[p, 1] - y) ** 2 <= link * link:
                _join(parent, sums, k, p, work)
                top = find_root(parent, k)
                break
            p = after[p]


@njit(cache=True)
def _join(parent: Ints, sums: Array, a: int, b: int, work: Ints) -> None:
    """Joins the components of points a and b under the older root, so that roots depend only on the order of points."""
    a, b = find_root(parent, a), find_root(parent, b)
    if a == b:
        return
    # the older root wins: roots depend on the order of points only, not on that of joins
    low, high = min(a, b), max(a, b)
    parent[high] = low
    pool(sums[low], sums[high])
    work[COMPONENTS] -= 1


@njit(cache=True)
def components(points: Array, weights: Array, link: float) -> tuple[Ints, Array]:
    """Returns the component of each point (M,), numbered by first points, and the moments (K, 6) of the components."""
    m = len(points)
    parent, sums = np.empty(m, np.int64), np.empty((m, 6))
    label, count = np.empty(m, np.int64), 0
    if m == 0:
        return label, sums
    cell, around = cells(points, link)
    head, after, box = np.full(len(around), -1), np.full(m, -1), np.empty((len(around), 4))
    work = np.zeros(2, np.int64)
    for k in range(m):
        insert(k, points, weights[k], link, cell, around, parent, head, after, box, sums, work)
    for k in range(m):
        top = find_root(parent, k)
        if top == k:
            label[k] = count
            sums[count] = sums[k]
            count += 1
        else:
            label[k] = label[top]
    return label, sums[:count]


@njit(cache=True)
def prefixes(
    points: Array, weights: Array, start: int, link: float, gate: float, prior: Array, strength: float, least: float
) -> tuple[Bools, int]:
    """Returns whether the first start, … M points are one group, (M - start + 1,), and the comparisons made."""
    m = len(points)
    one = np.zeros(m - start + 1, np.bool_)
    if m == 0:
        return one, 0
    cell, around = cells(points, link)
    parent, sums = np.empty(m, np.int64), np.empty((m, 6))
    head, after, box = np.full(len(around), -1), np.full(m, -1), np.empty((len(around), 4))
    work = np.zeros(2, np.int64)
    heavy = np.empty(0, np.int64)  # roots of the components that are not left out, from the first prefix asked for
    shape = np.empty((m, 5))  # their regions
    apart = False  # True if no two of the regions overlap
    for k in range(m):
        before = work[COMPONENTS]
        insert(k, points, weights[k], link, cell, around, parent, head, after, box, sums, work)
        if k + 1 < start:
            continue
        top, now = find_root(parent, k), k + 1 - start
        # all components once; later only that of the new point changes
        if k + 1 == max(start, 1):
            heavy = _heavy(np.arange(k + 1), parent, sums, least)
            for n in range(len(heavy)):
                top = heavy[n]
                fit(sums[top], gate, prior, strength, shape[top])
        elif sums[top, WEIGHT] < least:  # the others are as before
            one[now] = one[now - 1]
            continue
        elif work[COMPONENTS] != before or not (heavy == top).any():
            heavy = _heavy(np.unique(np.append(heavy, top)), parent, sums, least)
        fit(sums[top], gate, prior, strength, shape[top])
        if len(heavy) < 2:
            one[now], apart = len(heavy) == 1, True
            continue
        if apart or len(heavy) == 2:  # no region has changed but that of the last point's component
            apart = True
            for n in range(len(heavy)):
                other = heavy[n]
                work[VISITS] += 1
                if other != top and meet(shape[max(top, other)], shape[min(top, other)]):
                    apart = False
                    break
            one[now] = len(heavy) == 2 and not apart
        if not apart and len(heavy) > 2:
            label, compared = closure(sums[heavy], gate, prior, strength)
            one[now], apart = label.max() == 0, bool((label == np.arange(len(heavy))).all())
            work[VISITS] += len(heavy) + compared
    return one, work[VISITS]


@njit(cache=True)
def _heavy(points: Ints, parent: Ints, sums: Array, least: float) -> Ints:
    """Returns those of the points (K,) that are roots of components of at least the weight `least`."""
    kept = (parent[points] == points) & (sums[points, WEIGHT] >= least)
    return np.asarray(points[kept])
