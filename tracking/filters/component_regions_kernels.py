"""Kernels of tracking.filters.components: search regions of components, and regions joined until none overlap.

A component's moments are a row of `sums` (K, 6): weight N, mean x, y, and N times the covariance xx, xy, yy. Its region
is a row of `shape` (K, 5), an ellipse. Moments are joined without raw sums, in which precision would cancel. Slow
twins: tests/reference_components.py. Loops stand in place of np.full, np.argsort and copies of slices, which take
seconds to compile.
"""

from __future__ import annotations

import numpy as np

from sim.compiler import njit
from sim.elementary_kernels import find_root, sort_by
from sim.types import Array, Ints
from tracking.filters.ellipse_overlap_kernels import overlap

WEIGHT, X, Y, XX, XY, YY = range(6)
"""Columns of `sums`."""
MEAN_X, MEAN_Y, A_XX, A_XY, A_YY = range(5)
"""Slots of `shape`: an ellipse (y - mean)' A^-1 (y - mean) <= 1."""
FEW = 16
"""Components of which all pairs are compared; more are sorted first."""
SLACK, ROUNDING = 1 + 1e-6, 1e-15
"""A region's box is larger by this factor, and by this share of its place, so that rounding excludes no pair."""


@njit(cache=True)
def pool(into: Array, other: Array) -> None:
    """Changes the moments `into` (6,) of a set of points to those of its union with another set (3.1)."""
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


@njit(cache=True, shared=True)
def closure(sums: Array, gate: float, prior: Array, strength: float) -> tuple[Ints, int]:
    """Returns the first component that each of K is joined with (K,) (G_x, 3.1), and the number of pairs compared."""
    k, compared = len(sums), 0
    label, alive, order, tree = (
        np.empty(k, np.int64),
        np.empty(k, np.int64),
        np.empty(k, np.int64),
        np.empty(k, np.int64),
    )
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
                compared += 1
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
    return label, compared
