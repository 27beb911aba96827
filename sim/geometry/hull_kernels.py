"""Compiled convex hulls of many sets of points (x, y in any unit) at once, by Andrew's monotone chain.

The result is one array of vertices for each set. `sim.geometry.polygons.convex_hull` computes a single hull.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from sim.compiler import njit
from sim.types import Array


def convex_hulls(sets: Sequence[Array]) -> tuple[Array, ...]:
    """Return the convex hull of each set of points (K, 2), as one array of vertices (V, 2) per set, in the order of the
    sets.

    Vertices are counter-clockwise from the leftmost point, the lowest of several. Points on an edge and repeated points
    are dropped: points on one line give its two ends. But a set of one point repeated gives that point twice. The hull
    of an empty set, and of a set that contains a nan, has shape (0, 2). Without sets the result is ().
    """
    count = np.array([len(points) for points in sets], np.int64)
    if not count.any():
        return tuple(np.zeros((0, 2)) for _ in sets)
    points, owner = np.concatenate(sets), np.repeat(np.arange(len(sets)), count)
    order = np.lexsort((points[:, 1], points[:, 0], owner))
    vertices, ends = monotone_chains(points[order], np.concatenate([[0], np.cumsum(count)]))
    return tuple(np.split(vertices, ends[:-1]))


@njit(cache=True)
def _turns_left(a, b, c):  # type: ignore[no-untyped-def]
    return (b[0] - a[0]) * (c[1] - a[1]) > (b[1] - a[1]) * (c[0] - a[0])


@njit(cache=True)
def monotone_chains(points, cuts):  # type: ignore[no-untyped-def]
    """Return the hulls of G point sets by Andrew's monotone chain: vertices (V, 2) one hull after the other, and ends
    (G,).

    ends[g] is the row behind the last vertex of hull g; hull g begins at ends[g - 1], hull 0 at 0. Each hull is
    counter-clockwise from its leftmost point, the lowest of several, without points on its edges. Set g is
    points[cuts[g]:cuts[g + 1]] and must be sorted by x, then y. points (N, 2), cuts (G + 1,). An empty set and a set
    with a nan have no vertices. A set of one point repeated gives that point twice.
    """
    out = np.empty((2 * len(points) + 2, 2))
    ends = np.empty(len(cuts) - 1, np.int64)
    n = 0
    for g in range(len(cuts) - 1):
        first, last = cuts[g], cuts[g + 1]
        if not np.isnan(points[first:last]).any():
            start = n
            for i in range(first, last):
                while n - start > 1 and not _turns_left(out[n - 2], out[n - 1], points[i]):
                    n -= 1
                out[n] = points[i]
                n += 1
            start = n - 1
            for i in range(last - 2, first - 1, -1):
                while n - start > 1 and not _turns_left(out[n - 2], out[n - 1], points[i]):
                    n -= 1
                out[n] = points[i]
                n += 1
            n -= last > first + 1  # the chain ends with its first vertex: drop the repetition
        ends[g] = n
    return out[:n].copy(), ends
