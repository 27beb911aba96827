"""Kernels of tracking.filters.components: linked points in a grid of cells, one by one, and ellipses joined to closure.

The grid's cells have the diagonal `link`, so that points of one cell are linked; others can only be linked with the 20
cells around. A new point is compared with the points of those neighbours that are not of its component yet and whose
bounding box is near enough; at the first one found the components are joined, and so are their moments.
Rows of sums: weight N, mean x, y, and N times the covariance xx, xy, yy; joined without raw sums, which would cancel.
Slow twins: tests/reference_components.py.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from sim.geometry.union_find_kernels import find_root
from sim.types import Array, Bools, Ints
from tracking.filters.ellipse_overlap_kernels import overlap

AROUND = 20
WEIGHT, X, Y, XX, XY, YY = range(6)
FAR = 2.0**40  # cells from the first point: the grid's numbers stay whole numbers


@njit(cache=True)
def cells(points: Array, link: float) -> tuple[Ints, Ints]:
    """(M,) the cell of each point, 0, 1, …, and (C, 20) the cells around each, -1 where nobody is."""
    m = len(points)
    side = link / np.sqrt(2.0) * (1 - 1e-12)
    place = np.empty((m, 2), np.int64)
    for k in range(m):
        for axis in range(2):
            place[k, axis] = np.int64(np.floor(min(max((points[k, axis] - points[0, axis]) / side, -FAR), FAR)))
    order = _sorted(place)
    cell, first = np.empty(m, np.int64), np.empty(m, np.int64)
    count = 0
    for n in range(m):
        k, before = order[n], order[n - 1]
        if n == 0 or place[k, 0] != place[before, 0] or place[k, 1] != place[before, 1]:
            first[count] = k
            count += 1
        cell[k] = count - 1
    around = np.full((count, AROUND), -1)
    for c in range(count):
        x, y = place[first[c], 0], place[first[c], 1]
        n = 0
        for dx in range(-2, 3):
            for dy in range(-2, 3):
                if (dx != 0 or dy != 0) and abs(dx) + abs(dy) < 4:
                    around[c, n] = _find(place, first, count, x + dx, y + dy)
                    n += 1
    return cell, around


@njit(cache=True)
def _sorted(place: Ints) -> Ints:
    """The order of places (M, 2) by x, then y."""
    by_y = np.argsort(place[:, 1], kind="mergesort")
    return by_y[np.argsort(place[by_y, 0], kind="mergesort")]


@njit(cache=True)
def _find(place: Ints, first: Ints, count: int, x: int, y: int) -> int:
    """The cell at x, y, or -1."""
    low, high = 0, count
    while low < high:
        middle = (low + high) // 2
        k = first[middle]
        if place[k, 0] < x or (place[k, 0] == x and place[k, 1] < y):
            low = middle + 1
        else:
            high = middle
    if low < count and place[first[low], 0] == x and place[first[low], 1] == y:
        return low
    return -1


@njit(cache=True)
def insert(
    k: int, points: Array, weight: float, link: float, cell: Ints, around: Ints,
    parent: Ints, head: Ints, after: Ints, box: Array, sums: Array, work: Ints,
) -> None:  # fmt: skip
    """Add point k to the components: G_0(Y + {y}) from G_0(Y) (4.2.1).

    parent (M,): trees of points; head (C,), after (M,): the points of each cell as a list; box (C, 4): their bounds;
    sums (M, 6): of each component, at its root; work (2,): cells and points looked at, components.
    """
    c = cell[k]
    x, y = points[k, 0], points[k, 1]
    parent[k] = k
    sums[k, WEIGHT], sums[k, X], sums[k, Y] = weight, x, y
    sums[k, XX], sums[k, XY], sums[k, YY] = 0.0, 0.0, 0.0
    work[1] += 1
    if head[c] >= 0:
        _join(parent, sums, k, head[c], work)
        box[c, 0], box[c, 1] = min(box[c, 0], x), min(box[c, 1], y)
        box[c, 2], box[c, 3] = max(box[c, 2], x), max(box[c, 3], y)
    else:
        box[c, 0], box[c, 1], box[c, 2], box[c, 3] = x, y, x, y
    after[k], head[c] = head[c], k
    for n in range(AROUND):
        other = around[c, n]
        if other < 0 or head[other] < 0:
            continue
        work[0] += 1
        if find_root(parent, head[other]) == find_root(parent, k):
            continue
        gap_x = max(box[other, 0] - x, x - box[other, 2], 0.0)
        gap_y = max(box[other, 1] - y, y - box[other, 3], 0.0)
        if gap_x * gap_x + gap_y * gap_y > link * link:
            continue
        p = head[other]
        while p >= 0:
            work[0] += 1
            if (points[p, 0] - x) ** 2 + (points[p, 1] - y) ** 2 <= link * link:
                _join(parent, sums, k, p, work)
                break
            p = after[p]


@njit(cache=True)
def _join(parent: Ints, sums: Array, a: int, b: int, work: Ints) -> None:
    """Join the components of a and b under the older root, so that roots depend on the order of points alone."""
    a, b = find_root(parent, a), find_root(parent, b)
    if a == b:
        return
    low, high = min(a, b), max(a, b)
    parent[high] = low
    pool(sums[low], sums[high])
    work[1] -= 1


@njit(cache=True)
def pool(into: Array, other: Array) -> None:
    """The moments (6,) of two sets of points as those of their union, in place: (3.1), the N / N form of it."""
    n = into[WEIGHT] + other[WEIGHT]
    share = other[WEIGHT] / n
    dx, dy = other[X] - into[X], other[Y] - into[Y]
    w = into[WEIGHT] * share
    into[WEIGHT] = n
    into[X] += share * dx
    into[Y] += share * dy
    into[XX] += other[XX] + w * dx * dx
    into[XY] += other[XY] + w * dx * dy
    into[YY] += other[YY] + w * dy * dy


@njit(cache=True)
def components(points: Array, weights: Array, link: float) -> tuple[Ints, Array]:
    """G_0 (3.3): (M,) the component of each point, in the order of their first points, and their sums (K, 6)."""
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
def closure(sums: Array, gate: float, prior: Array, strength: float) -> Ints:
    """(K,) which of K components with `sums` (K, 6) are one by G_x (3.1), in the order of their first ones.

    Components whose regions overlap, also through others, are joined, then the joined ones, until no two overlap:
    one pass is not closed, as a joined region may reach one that none of its parts did. prior (3,), strength: of `fit`.
    """
    k = len(sums)
    label = np.arange(k)
    if k < 2:
        return label
    pooled, shape = sums.copy(), np.empty((k, 5))
    alive = np.ones(k, np.bool_)
    fresh = np.ones(k, np.bool_)  # only pairs with one that has changed need a look
    changed = True
    while changed:
        changed = False
        for i in range(k):
            if alive[i] and fresh[i]:
                fit(pooled[i], gate, prior, strength, shape[i])
        tree = np.arange(k)
        for i in range(k):
            for j in range(i):
                if alive[i] and alive[j] and (fresh[i] or fresh[j]) and find_root(tree, i) != find_root(tree, j):
                    dx, dy = shape[j, 0] - shape[i, 0], shape[j, 1] - shape[i, 1]
                    a, b = shape[i, 2:], shape[j, 2:]
                    if overlap(dx, dy, a[0], a[1], a[2], b[0], b[1], b[2]):
                        p, q = find_root(tree, i), find_root(tree, j)
                        tree[max(p, q)] = min(p, q)
        fresh[:] = False
        for i in range(k):
            top = find_root(tree, i)
            if alive[i] and top != i:
                pool(pooled[top], pooled[i])
                alive[i], fresh[top], changed = False, True, True
        for i in range(k):
            label[i] = find_root(tree, label[i])
    return label


@njit(cache=True)
def fit(sums: Array, gate: float, prior: Array, strength: float, shape: Array) -> None:
    """shape (5,): mean x, y, and gate times the covariance xx, xy, yy shrunk towards `prior`:
    (N S + n0 S0) / (N + n0), S the 1/N covariance, N the weight."""
    shape[0], shape[1] = sums[X], sums[Y]
    scale = gate / (sums[WEIGHT] + strength)
    shape[2] = scale * (sums[XX] + strength * prior[0])
    shape[3] = scale * (sums[XY] + strength * prior[1])
    shape[4] = scale * (sums[YY] + strength * prior[2])


@njit(cache=True)
def prefixes(
    points: Array, weights: Array, start: int, link: float, gate: float, prior: Array, strength: float, least: float
) -> tuple[Bools, int]:
    """Which of the first `start`, start + 1, … M points are one group, |G_y| = 1 (M - start + 1,), and the work done.

    Components of less weight than `least` are no parts, and of such alone there is no group.
    """
    m = len(points)
    one = np.zeros(m - start + 1, np.bool_)
    if m == 0:
        return one, 0
    cell, around = cells(points, link)
    parent, sums = np.empty(m, np.int64), np.empty((m, 6))
    head, after, box = np.full(len(around), -1), np.full(m, -1), np.empty((len(around), 4))
    work = np.zeros(2, np.int64)
    tops, some = np.empty(m, np.int64), 0  # the roots of components so far
    part = np.empty((m, 6))
    for k in range(m):
        insert(k, points, weights[k], link, cell, around, parent, head, after, box, sums, work)
        tops[some] = k
        some += 1
        if work[1] < some:
            kept = 0
            for n in range(some):
                if parent[tops[n]] == tops[n]:
                    tops[kept] = tops[n]
                    kept += 1
            work[0] += some
            some = kept
        if k + 1 >= start:
            one[k + 1 - start] = _whole(sums, tops[:some], part, gate, prior, strength, least, work)
    return one, work[0]


@njit(cache=True)
def _whole(
    sums: Array, tops: Ints, part: Array, gate: float, prior: Array, strength: float, least: float, work: Ints
) -> bool:
    """Are the components with these roots one group?"""
    if len(tops) == 1:
        return bool(sums[tops[0], WEIGHT] >= least)
    count = 0
    for n in range(len(tops)):
        if sums[tops[n], WEIGHT] >= least:
            part[count] = sums[tops[n]]
            count += 1
    work[0] += len(tops) + count * count
    if count < 2:
        return count == 1
    return bool(closure(part[:count], gate, prior, strength).max() == 0)
