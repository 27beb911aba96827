"""One-to-one matching of greatest total weight in every frame of a sequence at once.

A pair is settled without a solver where it weighs at least as much as the best rival of its row and the best rival of
its column together: exchanging any other partners for it loses nothing. What is left (dense tangles) goes to
scipy's assignment, frame by frame.
"""

from __future__ import annotations

import numpy as np

from sim.types import Array, Bools, Ints

ROUNDS = 4  # of settling; each halves what is left on crowds, and further ones cost more than the solver


def match(frame: Ints, i: Ints, j: Ints, weight: Array) -> Bools:
    """Which of the K pairs are matched; pairs sorted by (frame, i), rows i and j belong to one frame each, weights > 0."""
    chosen = np.zeros(len(i), bool)
    left = np.arange(len(i))
    for _ in range(ROUNDS):
        if len(left) == 0:
            return chosen
        settled = _settled(i[left], j[left], weight[left])
        if not settled.any():
            break
        chosen[left[settled]] = True
        left = left[_untouched(i[left], j[left], settled)]
    starts = np.flatnonzero(np.diff(frame[left], prepend=-1))
    for part in np.split(left, starts[1:]) if len(left) else []:
        chosen[part[solve(i[part], j[part], weight[part])]] = True
    return chosen


def _settled(i: Ints, j: Ints, w: Array) -> Bools:
    """Pairs that outweigh the best rivals of row and column together (at most one per row and column)."""
    rival_i, rival_j = rival(i, w), rival(j, w)
    settled = w >= rival_i + rival_j
    # Two equal pairs may both pass on a row (w, w with no other rivals gives w >= w + 0): keep the first of them.
    tied = settled & ((rival_i == w) | (rival_j == w))
    if tied.any():
        settled &= ~tied
        first = np.flatnonzero(tied)[:1]
        settled[first] = True
    return settled


def rival(row: Ints, w: Array) -> Array:
    """The greatest weight among the *other* pairs of each pair's row (K,), 0 where there is none."""
    n = int(row.max()) + 1
    best = np.zeros(n)
    np.maximum.at(best, row, w)
    is_best = w == best[row]
    times = np.bincount(row[is_best], minlength=n)
    second = np.zeros(n)
    np.maximum.at(second, row[~is_best], w[~is_best])
    second = np.where(times > 1, best, second)
    return np.where(is_best, second[row], best[row])


def _untouched(i: Ints, j: Ints, settled: Bools) -> Bools:
    """Pairs whose row and column are both still free."""
    taken_i, taken_j = np.zeros(int(i.max()) + 1, bool), np.zeros(int(j.max()) + 1, bool)
    taken_i[i[settled]] = True
    taken_j[j[settled]] = True
    return ~(taken_i[i] | taken_j[j])


def solve(i: Ints, j: Ints, weight: Array) -> Ints:
    """Places of the pairs of a best matching among K pairs of one frame; absent pairs weigh 0."""
    from scipy.optimize import linear_sum_assignment

    if len(i) == 1:
        return np.zeros(1, np.int64)
    rows, a = np.unique(i, return_inverse=True)
    columns, b = np.unique(j, return_inverse=True)
    table = np.zeros((len(rows), len(columns)))
    place = np.full(table.shape, -1)
    table[a, b] = weight
    place[a, b] = np.arange(len(i))
    found = place[linear_sum_assignment(table, maximize=True)]
    return found[found >= 0]
