"""Assignment of measurements to tracks: gated nearest neighbour, or least total cost.

Input: a cost matrix (N, M), one row per track, one column per measurement, inf outside a track's gate (region where its
measurements may lie). Output: two index arrays (K,), rows and columns of the assigned pairs. No measurement is assigned
twice. With `nearest` each measurement goes to the track of least cost (squared Mahalanobis distance d^2) in whose gate
it lies (Gonzalez et al. 2006, sec. 4.4), so that a track can have several: one person may be detected in several
pieces. `optimal` is ours.
"""

from __future__ import annotations

import numpy as np

from sim.types import Array, Ints


def nearest(cost: Array) -> tuple[Ints, Ints]:
    """Returns rows and columns (K,) of the pairs of each measurement with its cheapest track, in order of columns.
    cost: tracks by measurements; inf forbids a pair, and a measurement without an allowed pair has none."""
    if not cost.size:
        return np.zeros(0, np.int64), np.zeros(0, np.int64)
    row = cost.argmin(0)
    columns = np.flatnonzero(np.isfinite(cost[row, np.arange(cost.shape[1])]))
    return row[columns], columns


def cheapest_per_track(rows: Ints, columns: Ints, cost: Array) -> tuple[Ints, Ints]:
    """Returns rows and columns (L,) of the cheapest of the given pairs of each track, sorted by row."""
    # columns last, so that of equal costs the smallest column wins whatever the order of pairs
    order = np.lexsort((columns, cost[rows, columns], rows))
    rows, columns = rows[order], columns[order]
    first = np.ones(len(rows), bool)
    first[1:] = rows[1:] != rows[:-1]
    return rows[first], columns[first]


def optimal(cost: Array, unassigned: float) -> tuple[Ints, Ints]:
    """Returns rows and columns (K,) of the one-to-one pairs with the least total cost, where a row without a pair costs
    `unassigned`. No pair costs `unassigned` or more; inf forbids a pair."""
    from scipy.optimize import linear_sum_assignment

    # scipy refuses a table of which no full assignment is finite, so that inf becomes the cost of no measurement
    rows, columns = linear_sum_assignment(np.minimum(cost, unassigned))
    inside = cost[rows, columns] < unassigned
    return rows[inside], columns[inside]
