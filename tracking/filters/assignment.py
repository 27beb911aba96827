"""Assignment of measurements to tracks: gated nearest neighbour, or least total cost.

Input: a cost matrix (N, M), one row per track, one column per measurement, inf outside a track's gate (region where its
measurements may lie). Output: two index arrays (K,), rows and columns of the assigned pairs. No measurement is assigned
twice. A track can have several measurements with `nearest` only: there each measurement goes to the track of least cost
(squared Mahalanobis distance d^2) in whose gate it lies (Gonzalez et al. 2006, sec. 4.4), and one person may be
detected in several pieces. `optimal` is ours.
"""

from __future__ import annotations

import numpy as np

from sim.types import Array, Ints


def nearest(cost: Array) -> tuple[Ints, Ints]:
    """Returns rows and columns (K,) of the pairs of each measurement with its cheapest track, in order of columns.

    cost (N, M): a row per track, a column per measurement, inf outside a track's gate (region where its measurements
    may lie), no nan. Of equal costs the first row wins. A track can be in several pairs. A measurement outside all
    gates is in no pair. An empty matrix gives no pairs.
    """
    if not cost.size:
        return np.zeros(0, np.int64), np.zeros(0, np.int64)
    row = cost.argmin(0)
    columns = np.flatnonzero(np.isfinite(cost[row, np.arange(cost.shape[1])]))
    return row[columns], columns


def cheapest_per_track(rows: Ints, columns: Ints, cost: Array) -> tuple[Ints, Ints]:
    """Returns rows and columns (L,) of the cheapest pair of each track that is in a pair, sorted by row.

    rows, columns (K,): track and measurement of the given pairs, in any order; cost (N, M): a row per track, a column
    per measurement. Of equal costs the smallest column wins. No pairs give empty arrays.
    """
    order = np.lexsort((columns, cost[rows, columns], rows))
    rows, columns = rows[order], columns[order]
    first = np.ones(len(rows), bool)
    first[1:] = rows[1:] != rows[:-1]
    return rows[first], columns[first]


def optimal(cost: Array, unassigned: float) -> tuple[Ints, Ints]:
    """Returns rows and columns (K,) of the one-to-one pairs of tracks and measurements with the least total cost.

    cost (N, M): a row per track, a column per measurement, inf outside a track's gate (region where its measurements
    may lie), no nan. unassigned: the cost of a track without a measurement, finite; a pair that costs as much or more
    is never made. The pairs are in no particular order. No possible pair, or an empty matrix, gives empty arrays. Pairs
    that share neither row nor column with another possible pair are taken directly; scipy solves the rest.
    """
    rows, columns = np.nonzero(cost < unassigned)
    in_row = np.bincount(rows, minlength=cost.shape[0])
    in_column = np.bincount(columns, minlength=cost.shape[1])
    alone = (in_row[rows] == 1) & (in_column[columns] == 1)
    if alone.all():
        return rows, columns
    contested_rows, contested_columns = np.unique(rows[~alone]), np.unique(columns[~alone])
    part = np.minimum(cost[np.ix_(contested_rows, contested_columns)], unassigned)
    r, c = _solve(part, unassigned)
    rows = np.concatenate([rows[alone], contested_rows[r]])
    columns = np.concatenate([columns[alone], contested_columns[c]])
    return rows, columns


def _solve(cost: Array, unassigned: float) -> tuple[Ints, Ints]:
    """Returns rows and columns (K,) of scipy's one-to-one assignment of least total cost, without pairs that cost
    `unassigned` or more.

    cost (N, M): finite, a row per track, a column per measurement. The pairs are sorted by row. scipy raises ValueError
    for nan.
    """
    from scipy.optimize import linear_sum_assignment

    r, c = linear_sum_assignment(cost)
    inside = cost[r, c] < unassigned
    return r[inside], c[inside]
