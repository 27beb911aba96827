"""Assignment of measurements to tracks: the cheapest of each, or least total cost.

Input: P allowed pairs (region in which a track's measurements may lie: its gate) as arrays rows, columns and cost (P,),
row by row: tracks, measurements, costs. Output: indices (K,) of the assigned pairs. In the paper each measurement goes
to the track of least cost (squared Mahalanobis distance d^2) in whose gate it lies (Gonzalez et al. 2006, sec. 4.4), so
that a track can have several: one person may be detected in several pieces. One-to-one assignment is ours.
"""

from __future__ import annotations

import numpy as np

from sim.types import Array, Ints


def cheapest(of: Ints, cost: Array, ties: Ints) -> Ints:
    """Returns the index of the cheapest pair of each row, or column, `of` (P,), sorted by it. Of equal costs the
    smallest of `ties` (P,) wins."""
    order = np.lexsort((ties, cost, of))
    return np.asarray(order[np.diff(of[order], prepend=-1) > 0])


def one_to_one(rows: Ints, columns: Ints, cost: Array, unassigned: float = 0.0) -> Ints:
    """Returns the ascending indices of the one-to-one pairs with the least total cost, where a row without a pair costs
    `unassigned`, more than each pair (P,)."""
    from scipy.optimize import linear_sum_assignment

    # most pairs share neither row nor column with another: the search, cubic in their number, is for the others
    contested = np.bincount(rows)[rows] + np.bincount(columns)[columns] > 2
    many = np.flatnonzero(contested)
    if not len(many):
        return np.arange(len(rows))
    i, j = ((np.bincount(each) > 0).cumsum()[each] - 1 for each in (rows[many], columns[many]))
    index = np.full((i.max() + 1, j.max() + 1), -1)
    table = np.full(index.shape, unassigned)
    table[i, j], index[i, j] = cost[many], many
    best = index[linear_sum_assignment(table)]
    contested[best[best >= 0]] = False
    return np.flatnonzero(~contested)


def optimal(cost: Array, unassigned: float) -> tuple[Ints, Ints]:
    """Returns rows and columns (K,) of the one-to-one pairs of a table cost (N, M) with the least total cost, where a
    row without a pair costs `unassigned`. No pair costs `unassigned` or more; inf forbids a pair."""
    rows, columns = np.nonzero(cost < unassigned)
    best = one_to_one(rows, columns, cost[rows, columns], unassigned)
    return rows[best], columns[best]
