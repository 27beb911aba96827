"""Compiled convex hulls of many sets of points (x, y in any unit) at once, by Andrew's monotone chain.

The result is one array of vertices for each set. `sim.geometry.polygons.convex_hull` computes a single hull.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from sim.compiler import njit
from sim.types import Array


def convex_hulls(sets: Sequence[Array]) -> tuple[Array, ...]:
    """Returns the convex hull (V, 2) of each set of points (K, 2), counter-clockwise from the leftmost point.

    Points on an edge are dropped. The hull of an empty set, and of one with a nan, is (0, 2).
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
    """Returns the vertices (V, 2) of G hulls one after the other, and ends (G,) of each.

    points (N, 2): set g is points[cuts[g]:cuts[g + 1]], sorted by x, then y.
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
