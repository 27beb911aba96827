"""Kernels of tracking.filters.components: linked points by a grid of cells, and regions joined until none overlap.

The diagonal of a cell is `link`, the largest distance of linked points, so that points of one cell are linked, and
other points can be linked only from the 20 cells around. A new point is compared with the points of those cells that
are not of its component yet and whose bounding box is near enough. At the first linked point the two components are
joined, and so are their moments. Columns of `sums` (K, 6), a component's moments: weight N, mean x, y, and N times the
covariance xx, xy, yy. Moments are joined without raw sums, in which precision would cancel. Slow twins:
tests/reference_components.py."""

from __future__ import annotations

import numpy as np

from sim.compiler import njit
from sim.geometry.union_find_kernels import find_root
from sim.types import Array, Bools, Ints
from tracking.filters.ellipse_overlap_kernels import overlap

AROUND = 20
"""Cells round a cell from which points can be linked with its points."""
WEIGHT, X, Y, XX, XY, YY = range(6)
"""Columns of `sums`."""
MEAN_X, MEAN_Y, A_XX, A_XY, A_YY = range(5)
"""Slots of `shape`: an ellipse (y - mean)' A^-1 (y - mean) <= 1."""
LOW_X, LOW_Y, HIGH_X, HIGH_Y = range(4)
"""Columns of `box`."""
VISITS, COMPONENTS = range(2)
"""Slots of `work`: cells and points compared so far; number of components."""
FAR = 2.0**40
"""Cells from the first point beyond which a point is moved nearer, so that cell numbers fit in int64."""


@njit(cache=True)
def cells(points: Array, link: float) -> tuple[Ints, Ints]:
    """Returns the cell of each point (M,), 0, 1, …, and the 20 cells around each cell (C, 20), -1 for an empty one.
    points (M, 2), M at least 1. A cell's diagonal is `link`, in the points' unit, above 0. Cells are numbered by
    column, then row of the grid; points 2^40 cells or more from the first count as at that distance."""
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
    """Returns the indices (M,) that sort places (M, 2), grid column x and row y, by x, then y (stable)."""
    by_y = np.argsort(place[:, 1], kind="mergesort")
    return by_y[np.argsort(place[by_y, 0], kind="mergesort")]


@njit(cache=True)
def _find(place: Ints, first: Ints, count: int, x: int, y: int) -> int:
    """Returns the number of the cell in column x and row y of the grid, by bisection, or -1 if it is empty. place (M,
    2): grid column and row of each point; first (C,): a point of each cell, cells sorted by column, then row;
    count: C."""
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
    """Add point k to the components (sets of linked points) of the points before it, in place. Returns nothing (4.2.1).
    points (M, 2): x, y; weight: of point k; link: largest distance of linked points; cell (M,): cell of each point;
    around (C, 20): cells round each cell, -1 if empty. Changed: parent (M,), union-find forest of the points; head
    (C,), after (M,), the last added point of each cell and the one before it of each point, -1 at the end; box (C, 4),
    bounds of each cell's points: least x, y, largest x, y; sums (M, 6), a component's weight, mean x, y, weight times
    covariance xx, xy, yy, at its root; work (2,): comparisons, number of components."""
    c = cell[k]
    x, y = points[k, 0], points[k, 1]
    parent[k] = k
    sums[k, WEIGHT], sums[k, X], sums[k, Y] = weight, x, y
    sums[k, XX], sums[k, XY], sums[k, YY] = 0.0, 0.0, 0.0
    work[COMPONENTS] += 1
    if head[c] >= 0:
        _join(parent, sums, k, head[c], work)
        box[c, LOW_X], box[c, LOW_Y] = min(box[c, LOW_X], x), min(box[c, LOW_Y], y)
        box[c, HIGH_X], box[c, HIGH_Y] = max(box[c, HIGH_X], x), max(box[c, HIGH_Y], y)
    else:
        box[c, LOW_X], box[c, LOW_Y], box[c, HIGH_X], box[c, HIGH_Y] = x, y, x, y
    after[k], head[c] = head[c], k
    for n in range(AROUND):
        other = around[c, n]
        if other < 0 or head[other] < 0:
            continue
        work[VISITS] += 1
        if find_root(parent, head[other]) == find_root(parent, k):
            continue
        gap_x = max(box[other, LOW_X] - x, x - box[other, HIGH_X], 0.0)
        gap_y = max(box[other, LOW_Y] - y, y - box[other, HIGH_Y], 0.0)
        if gap_x * gap_x + gap_y * gap_y > link * link:
            continue
        p = head[other]
        while p >= 0:
            work[VISITS] += 1
            if (points[p, 0] - x) ** 2 + (points[p, 1] - y) ** 2 <= link * link:
                _join(parent, sums, k, p, work)
                break
            p = after[p]


@njit(cache=True)
def _join(parent: Ints, sums: Array, a: int, b: int, work: Ints) -> None:
    """Join the components of points a and b under the older root, so that roots depend only on the order of points.
    Changed: parent (M,), union-find forest; sums (M, 6), moments at the roots; work (2,), whose second number, the
    components, falls by 1. Nothing changes if the points are in one component already."""
    a, b = find_root(parent, a), find_root(parent, b)
    if a == b:
        return
    low, high = min(a, b), max(a, b)
    parent[high] = low
    pool(sums[low], sums[high])
    work[COMPONENTS] -= 1


@njit(cache=True)
def pool(into: Array, other: Array) -> None:
    """Change the moments `into` (6,) of a set of points to those of its union with another set, `other` (6,) (3.1).
    Columns: weight N, mean x, y, and N times the covariance (with 1/N) xx, xy, yy. N of the union must be above 0."""
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
    """Returns the component of each point (M,), numbered in the order of first points, and the moments (K, 6) of K
    components.

    Points (M, 2) at most `link` (above 0) apart, also through others, are one component (3.3). weights (M,): of the
    points. Moments: weight N, mean x, y, N times the covariance xx, xy, yy. No points give no components."""
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
    """Returns for each of K components the index of the first component it is joined with, or its own, (K,) (G_x, 3.1).

    sums (K, 6): weight N, mean x, y, N times the covariance xx, xy, yy; not changed. Components whose search regions
    overlap, also through others, are joined; then the joined ones are compared, until no two overlap: a joined region
    may overlap one that none of its parts did. gate: squared Mahalanobis radius of a region. prior (3,), strength:
    covariance xx, xy, yy to which a component's own is shrunk, and its weight."""
    k = len(sums)
    label = np.arange(k)
    if k < 2:
        return label
    pooled, shape = sums.copy(), np.empty((k, 5))
    alive = np.ones(k, np.bool_)
    fresh = np.ones(k, np.bool_)  # only pairs with a changed component are compared again
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
                    dx, dy = shape[j, MEAN_X] - shape[i, MEAN_X], shape[j, MEAN_Y] - shape[i, MEAN_Y]
                    a, b = shape[i, A_XX:], shape[j, A_XX:]
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
    """Write a component's search region, an ellipse, into `shape` (5,): mean x, y, entries xx, xy, yy of its matrix A.
    The region is (y - mean)' A^-1 (y - mean) <= 1. sums (6,): weight N, mean x, y, N S as xx, xy, yy. A is `gate`
    (squared radius) times the shrunk covariance (N S + n0 S0) / (N + n0), S the covariance with 1/N, S0 the `prior`
    (3,) xx, xy, yy, n0 the `strength`. Returns nothing."""
    shape[MEAN_X], shape[MEAN_Y] = sums[X], sums[Y]
    scale = gate / (sums[WEIGHT] + strength)
    shape[A_XX] = scale * (sums[XX] + strength * prior[0])
    shape[A_XY] = scale * (sums[XY] + strength * prior[1])
    shape[A_YY] = scale * (sums[YY] + strength * prior[2])


@njit(cache=True)
def prefixes(
    points: Array, weights: Array, start: int, link: float, gate: float, prior: Array, strength: float, least: float
) -> tuple[Bools, int]:
    """Returns flags (M - start + 1,), True if the first start, start + 1, … M points are one group, and the comparisons
    made.

    points (M, 2), weights (M,). Points at most `link` apart are components, and those lighter than `least` are left
    out. The others are joined by `closure` with gate (squared radius), prior (3,), strength; one must be left. False
    for no point and if all are left out. start: 0 to M."""
    m = len(points)
    one = np.zeros(m - start + 1, np.bool_)
    if m == 0:
        return one, 0
    cell, around = cells(points, link)
    parent, sums = np.empty(m, np.int64), np.empty((m, 6))
    head, after, box = np.full(len(around), -1), np.full(m, -1), np.empty((len(around), 4))
    work = np.zeros(2, np.int64)
    tops, some = np.empty(m, np.int64), 0  # roots of the components so far
    part = np.empty((m, 6))
    for k in range(m):
        insert(k, points, weights[k], link, cell, around, parent, head, after, box, sums, work)
        tops[some] = k
        some += 1
        if work[COMPONENTS] < some:
            kept = 0
            for n in range(some):
                if parent[tops[n]] == tops[n]:
                    tops[kept] = tops[n]
                    kept += 1
            work[VISITS] += some
            some = kept
        if k + 1 >= start:
            one[k + 1 - start] = _whole(sums, tops[:some], part, gate, prior, strength, least, work)
    return one, work[VISITS]


@njit(cache=True)
def _whole(
    sums: Array, tops: Ints, part: Array, gate: float, prior: Array, strength: float, least: float, work: Ints
) -> bool:
    """Returns True if the components with roots `tops` (K,) are one group, leaving out those lighter than `least`. sums
    (M, 6): moments at the roots. gate, prior (3,), strength: as in `fit`, of the search regions. False if all are left
    out. part (M, 6) and work (2,) are changed: working space, number of comparisons."""
    if len(tops) == 1:
        return bool(sums[tops[0], WEIGHT] >= least)
    count = 0
    for n in range(len(tops)):
        if sums[tops[n], WEIGHT] >= least:
            part[count] = sums[tops[n]]
            count += 1
    work[VISITS] += len(tops) + count * count
    if count < 2:
        return count == 1
    return bool(closure(part[:count], gate, prior, strength).max() == 0)
