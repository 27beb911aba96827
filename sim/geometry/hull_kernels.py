"""Compiled convex hulls of many sets of points (x, y in any unit) at once, by Andrew's monotone chain.

The result is one array of vertices for each set.
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


def convex_hull(points: Array) -> Array:
    """Returns the convex hull (V, 2) of points (N, 2), counter-clockwise from the leftmost, without points on edges.

    V is 2 if all points lie on a line, 1 if all are equal, 0 without points.
    """
    return convex_hulls([np.unique(points, axis=0)])[0]


@njit(cache=True)
def _turns_left(chain, n, x, y):  # type: ignore[no-untyped-def]
    """Returns True if the way over the last two of n vertices to (x, y) turns left."""
    ax, ay, bx, by = chain[n - 2, 0], chain[n - 2, 1], chain[n - 1, 0], chain[n - 1, 1]
    return (bx - ax) * (y - ay) > (by - ay) * (x - ax)


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
        known = True
        for i in range(first, last):
            known = known and not (np.isnan(points[i, 0]) or np.isnan(points[i, 1]))
        if known:
            for back in range(2):  # to the last point, and from the one before it back to the first
                start = n - back
                for k in range(back, last - first):
                    i = last - 1 - k if back else first + k
                    x, y = points[i, 0], points[i, 1]
                    while n - start > 1 and not _turns_left(out, n, x, y):
                        n -= 1
                    out[n, 0], out[n, 1] = x, y
                    n += 1
            n -= last > first + 1  # the chain ends with its first vertex: drop the repetition
        ends[g] = n
    return out[:n], ends
