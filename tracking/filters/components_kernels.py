"""Kernels of tracking.filters.components: overlap of ellipses, regions of components, linked points.

An ellipse is the set of points y with y' A^-1 y <= 1 about its centre. Its symmetric 2 x 2 matrix A is given by the
entries xx, xy, yy, in the squared unit of the centres.

A component's moments are a row of `sums` (K, 6): weight N, mean x, y, and N times the covariance xx, xy, yy. Its region
is a row of `shape` (K, 5), an ellipse. Moments are joined without raw sums, in which precision would cancel.

Points are linked by a grid of cells. The diagonal of a cell is `link`, the largest distance of linked points, so that
points of one cell are linked, and other points can be linked only from the 20 cells around. A new point is compared
with the points of those cells that are not of its component yet and whose bounding box is near enough. At the first
linked point the two components are joined, and so are their moments.

Slow twins: tests/reference_components.py. Loops stand in place of np.full, np.argsort and copies of slices, which take
seconds to compile.
"""

from __future__ import annotations

from math import sqrt

import numpy as np

from sim.compiler import njit
from sim.elementary_kernels import find_root, sort_by
from sim.types import Array, Bools, Ints

# Most bisections; two ellipses that are still undecided touch, and count as overlapping.
STEPS = 60
# Columns of `sums`.
WEIGHT, X, Y, XX, XY, YY = range(6)
# Slots of `shape`: an ellipse (y - mean)' A^-1 (y - mean) <= 1.
MEAN_X, MEAN_Y, A_XX, A_XY, A_YY = range(5)
# Components of which all pairs are compared; more are sorted first.
FEW = 16
# A region's box is larger by this factor, and by this share of its place, so that rounding excludes no pair.
SLACK, ROUNDING = 1 + 1e-6, 1e-15
# Cells round a cell from which points can be linked with its points.
AROUND = 20
# Columns of `box`.
LOW_X, LOW_Y, HIGH_X, HIGH_Y = range(4)
# Cells from the first point beyond which a point is moved nearer, so that cell numbers fit in int64.
FAR = 2.0**40


@njit(cache=True)
def overlap(dx: float, dy: float, axx: float, axy: float, ayy: float, bxx: float, bxy: float, byy: float) -> bool:
    """Returns True if the filled ellipses y' A^-1 y <= 1 and (y - d)' B^-1 (y - d) <= 1 have a common point."""
    # Coordinates with B = I and A = diag(l1, l2). The ellipses are disjoint if and only if, for some s in (0, 1), f(s)
    # = d' (A / (1 - s) + B / s)^-1 d = sum of s (1 - s) d_i^2 / (1 + s (l_i - 1)) > 1 (Gilitschenski & Hanebeck 2012).
    l11 = sqrt(bxx)  # B = L L'
    l21 = bxy / l11
    l22 = sqrt(byy - l21 * l21)
    u = dx / l11
    v = (dy - l21 * u) / l22
    cxx = axx / (l11 * l11)  # C = L^-1 A L^-T
    cxy = (axy / l11 - l21 * cxx) / l22
    cyy = (ayy - 2 * l21 * (axy / l11) + l21 * l21 * cxx) / (l22 * l22)
    half, differ = (cxx + cyy) / 2, (cxx - cyy) / 2
    root = sqrt(differ * differ + cxy * cxy)
    large = half + root
    small = (axx * ayy - axy * axy) / (bxx * byy - bxy * bxy) / large  # half - root would cancel
    p, q = large - 1, small - 1
    # Direction of the first eigenvector: (cxy, l1 - cxx) or (l1 - cyy, cxy), whichever is the longer.
    ex, ey = (root + differ, cxy) if differ >= 0 else (cxy, root - differ)
    length = sqrt(ex * ex + ey * ey)
    # a circle: every direction is an eigenvector
    if length == 0:
        ex, ey, length = 1.0, 0.0, 1.0
    a = (u * ex + v * ey) / length
    b = (v * ex - u * ey) / length
    a2, b2 = a * a, b * b
    low, high = 0.0, 1.0
    value_low, slope_low, value_high, slope_high = 0.0, a2 + b2, 0.0, -(a2 / (1 + p) + b2 / (1 + q))
    for _ in range(STEPS):
        # f is concave: the tangents at both ends of a bracket bound its maximum
        if min(value_low + slope_low * (high - low), value_high - slope_high * (high - low)) <= 1:
            return True
        s = (low + high) / 2
        m, n = 1 + s * p, 1 + s * q
        value = s * (1 - s) * (a2 / m + b2 / n)
        if value > 1:
            return False
        slope = a2 * (1 - 2 * s - s * s * p) / (m * m) + b2 * (1 - 2 * s - s * s * q) / (n * n)
        if slope > 0:
            low, value_low, slope_low = s, value, slope
        else:
            high, value_high, slope_high = s, value, slope
    return True


@njit(cache=True)
def overlaps(mean: Array, shape: Array) -> Bools:
    """Returns flags (G, G): True where two filled ellipses, centres mean (G, 2), matrices (G, 2, 2), overlap."""
    count = len(mean)
    found = np.ones((count, count), np.bool_)
    region = np.empty((count, 5))
    for i in range(count):
        region[i, MEAN_X], region[i, MEAN_Y] = mean[i, 0], mean[i, 1]
        region[i, A_XX], region[i, A_XY], region[i, A_YY] = shape[i, 0, 0], shape[i, 0, 1], shape[i, 1, 1]
        for j in range(i):
            found[i, j] = found[j, i] = meet(region[i], region[j])
    return found


@njit(cache=True)
def pool(into: Array, other: Array) -> None:
    """Changes the moments `into` (6,) of a set of points to those of its union with another set (eq. 3.1)."""
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
def fit(sums: Array, gate: float, prior: Array, strength: float, shape: Array) -> None:
    """Writes a component's search region into `shape` (5,): `gate` times its covariance, shrunk to `prior` (3,)."""
    shape[MEAN_X], shape[MEAN_Y] = sums[X], sums[Y]
    scale = gate / (sums[WEIGHT] + strength)
    shape[A_XX] = scale * (sums[XX] + strength * prior[0])
    shape[A_XY] = scale * (sums[XY] + strength * prior[1])
    shape[A_YY] = scale * (sums[YY] + strength * prior[2])


@njit(cache=True)
def meet(a: Array, b: Array) -> bool:
    """Returns True if two search regions overlap; a, b (5,): written by `fit`."""
    dx, dy = b[MEAN_X] - a[MEAN_X], b[MEAN_Y] - a[MEAN_Y]
    # A cheap test of the bounding boxes first: most pairs are far apart.
    far = 2 * SLACK  # (p + q)^2 <= 2 p^2 + 2 q^2 of the half widths p, q
    if dx * dx > far * (a[A_XX] + b[A_XX]) or dy * dy > far * (a[A_YY] + b[A_YY]):
        return False
    return overlap(dx, dy, a[A_XX], a[A_XY], a[A_YY], b[A_XX], b[A_XY], b[A_YY])


@njit(cache=True)
def unset(count: int) -> Ints:
    """Returns -1, `count` times."""
    out = np.empty(count, np.int64)
    for k in range(count):
        out[k] = -1
    return out


@njit(cache=True)
def closure(sums: Array, gate: float, prior: Array, strength: float) -> Ints:
    """Returns the first component that each of K is joined with, (K,) (G_x, sec. 3.1)."""
    k = len(sums)
    label, alive = np.empty(k, np.int64), np.empty(k, np.int64)
    order, tree = np.empty(k, np.int64), np.empty(k, np.int64)
    pooled, shape = np.empty((k, 6)), np.empty((k, 5))
    left, wide = np.empty(k), np.empty(k)  # of a region: least x, half of its width
    fresh = np.empty(k, np.bool_)  # only pairs with a changed component are compared again
    for i in range(k):
        alive[i] = tree[i] = i
        fresh[i] = True
        for c in range(6):
            pooled[i, c] = sums[i, c]
    count = k
    changed = k > 1
    while changed:
        for n in range(count):
            order[n] = alive[n]
            i = alive[n]
            if fresh[i]:
                fit(pooled[i], gate, prior, strength, shape[i])
                wide[i] = SLACK * np.sqrt(shape[i, A_XX]) + ROUNDING * abs(shape[i, MEAN_X])
                left[i] = shape[i, MEAN_X] - wide[i]
        # Few are compared in all pairs; of many only those whose boxes overlap along x.
        many = count > FEW
        if many:
            sort_by(left, order[:count])
        for n in range(count):
            for later in range(n + 1, count):
                p, q = order[n], order[later]
                if many and left[q] > left[p] + 2 * wide[p]:
                    break
                if (
                    (fresh[p] or fresh[q])
                    # pairs that are joined already need no test
                    and find_root(tree, p) != find_root(tree, q)
                    # in one order of arguments, so that rounding does not depend on who is first
                    and meet(shape[max(p, q)], shape[min(p, q)])
                ):
                    i, j = find_root(tree, p), find_root(tree, q)
                    tree[max(i, j)] = min(i, j)
        kept = 0
        for n in range(count):
            fresh[alive[n]] = False
        for n in range(count):
            i = alive[n]
            top = find_root(tree, i)
            if top == i:
                alive[kept] = i
                kept += 1
            else:
                pool(pooled[top], pooled[i])
                fresh[top] = True
        # A joined region may overlap one that none of its parts did: repeat until nothing changes.
        changed = 1 < kept < count
        count = kept
    for i in range(k):
        label[i] = find_root(tree, i)
    return label


@njit(cache=True)
def cells(points: Array, link: float) -> tuple[Ints, Ints]:
    """Returns the cell of each point (M,), numbered by first points, and the 20 cells around each (C, 20), -1 empty."""
    m = len(points)
    # slightly less than link / sqrt 2, so that rounding never puts two points farther apart into one cell
    side = link / np.sqrt(2.0) * (1 - 1e-12)
    place = np.empty((m, 2), np.int64)
    slots = 1
    while slots < 2 * m:  # at most half full, so that searches are short
        slots *= 2
    table = unset(slots)
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
    around = np.empty((count, AROUND), np.int64)
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
def add_point(
    k: int, points: Array, weight: float, link: float, cell: Ints, around: Ints,
    parent: Ints, head: Ints, after: Ints, box: Array, sums: Array, left: Ints,
) -> None:  # fmt: skip
    """Adds point k to the components of the points before it, in place (sec. 4.2.1).

    head (C,), after (M,): the last added point of each cell, and the one before each point. box (C, 4): bounds of each
    cell's points. parent (M,), sums (M, 6): forest of the points, and moments at the roots. left (1,): number of
    components.
    """
    c = cell[k]
    x, y = points[k, 0], points[k, 1]
    parent[k] = k
    sums[k, WEIGHT], sums[k, X], sums[k, Y] = weight, x, y
    sums[k, XX], sums[k, XY], sums[k, YY] = 0.0, 0.0, 0.0
    left[0] += 1
    if head[c] >= 0:
        _join(parent, sums, k, head[c], left)
        box[c, LOW_X], box[c, LOW_Y] = min(box[c, LOW_X], x), min(box[c, LOW_Y], y)
        box[c, HIGH_X], box[c, HIGH_Y] = max(box[c, HIGH_X], x), max(box[c, HIGH_Y], y)
    else:
        box[c, LOW_X], box[c, LOW_Y], box[c, HIGH_X], box[c, HIGH_Y] = x, y, x, y
    after[k], head[c] = head[c], k
    top = find_root(parent, k)
    for n in range(AROUND):
        other = around[c, n]
        # everything is one component: nothing more can be joined
        if left[0] == 1:
            break
        if other < 0 or head[other] < 0:
            continue
        if find_root(parent, head[other]) == top:
            continue
        # the bounding box of the cell's points rules most cells out without a look at its points
        gap_x = max(box[other, LOW_X] - x, x - box[other, HIGH_X], 0.0)
        gap_y = max(box[other, LOW_Y] - y, y - box[other, HIGH_Y], 0.0)
        if gap_x * gap_x + gap_y * gap_y > link * link:
            continue
        p = head[other]
        while p >= 0:
            if (points[p, 0] - x) ** 2 + (points[p, 1] - y) ** 2 <= link * link:
                _join(parent, sums, k, p, left)
                top = find_root(parent, k)
                break
            p = after[p]


@njit(cache=True)
def _join(parent: Ints, sums: Array, a: int, b: int, left: Ints) -> None:
    """Joins the components of points a and b under the older root, so that roots depend only on the order of points."""
    a, b = find_root(parent, a), find_root(parent, b)
    if a == b:
        return
    # the older root wins: roots depend on the order of points only, not on that of joins
    low, high = min(a, b), max(a, b)
    parent[high] = low
    pool(sums[low], sums[high])
    left[0] -= 1


@njit(cache=True)
def components(points: Array, weights: Array, link: float) -> tuple[Ints, Array]:
    """Returns the component of each point (M,), numbered by first points, and the moments (K, 6) of the components."""
    m = len(points)
    parent, sums = np.empty(m, np.int64), np.empty((m, 6))
    label, count = np.empty(m, np.int64), 0
    if m == 0:
        return label, sums
    cell, around = cells(points, link)
    head, after, box = unset(len(around)), unset(m), np.empty((len(around), 4))
    left = np.zeros(1, np.int64)
    for k in range(m):
        add_point(k, points, weights[k], link, cell, around, parent, head, after, box, sums, left)
    for k in range(m):
        top = find_root(parent, k)
        if top == k:
            label[k] = count
            for c in range(6):
                sums[count, c] = sums[k, c]
            count += 1
        else:
            label[k] = label[top]
    return label, sums[:count]


@njit(cache=True)
def prefixes(
    points: Array, weights: Array, start: int, link: float, gate: float, prior: Array, strength: float, least: float
) -> Bools:
    """Returns whether the first start, … M points are one group, (M - start + 1,)."""
    # All associations of a group at once: the points of the group alone, then one shared point more each time (4.2.1).
    # While a single component is heavy, n points cost O(n). Of more, only the region of the last point's is new; it is
    # compared with the M others if no two of those overlap. Else all are sorted along x and joined in rounds, O(M^1.5)
    # a point or less on scattered points. The least weight bounds M.
    m = len(points)
    one = np.zeros(m - start + 1, np.bool_)
    if m == 0:
        return one
    cell, around = cells(points, link)
    parent, sums = np.empty(m, np.int64), np.empty((m, 6))
    head, after, box = unset(len(around)), unset(m), np.empty((len(around), 4))
    left = np.zeros(1, np.int64)
    # Roots of the components that are not left out, ascending, from the first prefix on; their moments and regions.
    heavy, count, moments, shape = np.empty(m, np.int64), 0, np.empty((m, 6)), np.empty((m, 5))
    apart = False  # True if no two of the regions overlap
    for k in range(m):
        add_point(k, points, weights[k], link, cell, around, parent, head, after, box, sums, left)
        if k + 1 < start:
            continue
        top, now = find_root(parent, k), k + 1 - start
        # all components once; later only that of the new point changes
        if k + 1 == max(start, 1):
            for p in range(k + 1):
                if parent[p] == p and sums[p, WEIGHT] >= least:
                    top = heavy[count] = p
                    count += 1
                    fit(sums[top], gate, prior, strength, shape[top])
        elif sums[top, WEIGHT] < least:  # the others are as before
            one[now] = one[now - 1]
            continue
        else:
            count = _with_root(top, heavy, count, parent, sums, least)
        fit(sums[top], gate, prior, strength, shape[top])
        if count < 2:
            one[now], apart = count == 1, True
            continue
        if apart or count == 2:  # no region has changed but that of the last point's component
            apart = True
            for n in range(count):
                other = heavy[n]
                if other != top and meet(shape[max(top, other)], shape[min(top, other)]):
                    apart = False
                    break
            one[now] = count == 2 and not apart
        if not apart and count > 2:
            for n in range(count):
                for c in range(6):
                    moments[n, c] = sums[heavy[n], c]
            label = closure(moments[:count], gate, prior, strength)
            one[now] = apart = True
            for n in range(count):
                one[now] = one[now] and label[n] == 0
                apart = apart and label[n] == n
    return one


@njit(cache=True)
def _with_root(top: int, heavy: Ints, count: int, parent: Ints, sums: Array, least: float) -> int:
    """Adds a root to the ascending list heavy[:count], takes out those that are no roots now, and returns the count."""
    kept = 0
    for n in range(count):
        p = heavy[n]
        if p != top and parent[p] == p and sums[p, WEIGHT] >= least:
            heavy[kept] = p
            kept += 1
    at = kept
    while at > 0 and heavy[at - 1] > top:
        heavy[at] = heavy[at - 1]
        at -= 1
    heavy[at] = top
    return kept + 1
