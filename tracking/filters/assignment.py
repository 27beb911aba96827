"""Who measured whom: gated nearest neighbour, or the assignment of least total cost.

Both work on the gated pairs only, given as a cost matrix with inf outside the gates. They answer (track, measurement)
pairs in which no measurement occurs twice; a track may occur twice only with `nearest`, where a measurement goes to the
track of least d^2 in whose gate it lies (Gonzalez et al. 2006, 4.4) and one person may come in several pieces.
`optimal` is ours.
"""

from __future__ import annotations

import numpy as np

from sim.types import Array, Ints


def nearest(cost: Array) -> tuple[Ints, Ints]:
    """Each measurement (column) to its cheapest track (row), where it is in any gate; ties go to the first row."""
    if not cost.size:
        return np.zeros(0, np.int64), np.zeros(0, np.int64)
    row = cost.argmin(0)
    columns = np.flatnonzero(np.isfinite(cost[row, np.arange(cost.shape[1])]))
    return row[columns], columns


def optimal(cost: Array, unassigned: float) -> tuple[Ints, Ints]:
    """One to one with least total cost, a track left out costing `unassigned`, the same for all; no pair costs more.

    Pairs that compete with no other pair are taken as they are; only the rest goes through scipy's solver.
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
    from scipy.optimize import linear_sum_assignment

    r, c = linear_sum_assignment(cost)
    inside = cost[r, c] < unassigned
    return r[inside], c[inside]
