"""One-to-one matching of greatest total weight in every frame of a sequence at once.

A pair (i, j) that weighs at least as much as the best other pair of i and the best other pair of j together is in some
best matching: put it into any matching, drop the at most two pairs it replaces, and the total has not fallen. Several
such pairs that share no row and no column are in one best matching together, since exchanging one in leaves the others
alone. So whole sequences are settled in a few passes over arrays; what is left (tangles) goes to scipy, frame by frame.

A pair that weighs more than those two is in every best matching. Scores that depend on which of several best matchings
is taken settle only such pairs and leave frames with a tangle to scipy whole: there it chooses among equals as it does
for TrackEval.
"""

from __future__ import annotations

import numpy as np

from sim.types import Array, Bools, Ints
from tracking.scoring.similarity import Pairs

CLEARLY = 1 + 1e-9  # times as much is more, whatever the rounding
WORTH = 0.2  # share of pairs that a pass must take off for another one: below, the solver is quicker


def match(frame: Ints, i: Ints, j: Ints, weight: Array) -> Bools:
    """Which of the K pairs are matched (K,): no i and no j twice, and the greatest sum of weight in each frame.

    frame, i sorted; i, j: rows, each of one frame; weight > 0. Which of several best matchings comes out is not said.
    """
    chosen, left = _settle(i, j, weight, strict=False)
    chosen[left[_solved(frame[left], i[left], j[left], weight[left])]] = True
    return chosen


def match_as_table(pairs: Pairs, weight: Array) -> Bools:
    """The same for all pairs; of several best matchings the one that scipy finds in the table of the frame's rows."""
    chosen, left = _settle(pairs.i, pairs.j, weight, strict=True)
    frame = pairs.frame
    tangled = np.unique(frame[left])
    starts, ends = (np.searchsorted(frame, tangled, side=side).tolist() for side in ("left", "right"))
    for start, end in zip(starts, ends, strict=True):
        chosen[start:end] = solve_frame(pairs, start, end, weight[start:end])
    return chosen


def solve_frame(pairs: Pairs, start: int, end: int, weight: Array) -> Bools:
    """The matching that scipy finds in one frame, whose pairs are start … end - 1: which of them it has."""
    from scipy.optimize import linear_sum_assignment

    i, j = pairs.i[start:end], pairs.j[start:end]
    frame = pairs.true.frame[i[0]]
    (top, bottom), (first, last) = (np.searchsorted(r.frame, (frame, frame + 1)) for r in (pairs.true, pairs.est))
    cost = np.zeros((bottom - top, last - first))
    cost[i - top, j - first] = -weight
    rows, columns = linear_sum_assignment(cost)
    partner = np.full(len(cost), -1)
    partner[rows] = columns
    return np.asarray(partner[i - top] == j - first)


def _settle(i: Ints, j: Ints, weight: Array, strict: bool) -> tuple[Bools, Ints]:
    """Pairs (K,) that are in a best matching (strict: in every one), and places of those that the rest is chosen of."""
    chosen = np.zeros(len(i), bool)
    left = np.arange(len(i))
    while len(left):
        settled = _settled(i[left], j[left], weight[left], strict)
        chosen[left[settled]] = True
        free = left[~touched(i[left], j[left], settled)]
        worth = len(left) - len(free) >= WORTH * len(left)
        left = free
        if not worth:
            break
    return chosen, left


def _settled(i: Ints, j: Ints, w: Array, strict: bool) -> Bools:
    """Pairs, no two in one row or column, that weigh as much as the best rivals of their row and their column together
    (strict: clearly more)."""
    best_i, rival_i = _leaders(i, w)
    best_j, rival_j = _leaders(j, w)
    candidate = np.flatnonzero((w >= best_i[i]) & (w >= best_j[j]))
    rivals = rival_i[i[candidate]] + rival_j[j[candidate]]
    candidate = candidate[w[candidate] > CLEARLY * rivals if strict else w[candidate] >= rivals]
    settled = np.zeros(len(w), bool)
    settled[candidate] = True
    # Equal pairs of one row, alone in their columns (or the other way round), all pass: the first of them stays.
    for row, end in () if strict else ((i, len(best_i)), (j, len(best_j))):
        first = np.full(end, len(w))
        np.minimum.at(first, row[candidate], candidate)
        settled[candidate[first[row[candidate]] < candidate]] = False
    return settled


def _leaders(row: Ints, w: Array) -> tuple[Array, Array]:
    """Greatest weight of each row, and the greatest but for one pair that has it; 0 where there is none."""
    n = int(row.max()) + 1
    best, second = np.zeros(n), np.zeros(n)
    np.maximum.at(best, row, w)
    leads = w == best[row]
    np.maximum.at(second, row[~leads], w[~leads])
    return best, np.where(np.bincount(row[leads], minlength=n) > 1, best, second)


def touched(i: Ints, j: Ints, chosen: Bools) -> Bools:
    """Pairs that have their row or their column in common with a chosen pair, or are chosen."""
    if len(i) == 0:
        return chosen
    taken_i, taken_j = np.zeros(int(i.max()) + 1, bool), np.zeros(int(j.max()) + 1, bool)
    taken_i[i[chosen]] = True
    taken_j[j[chosen]] = True
    return np.asarray(taken_i[i] | taken_j[j])


def _solved(frame: Ints, i: Ints, j: Ints, w: Array) -> Ints:
    """Places of the pairs of a best matching, by scipy on one table per frame; absent pairs weigh 0."""
    from scipy.optimize import linear_sum_assignment

    if len(w) == 0:
        return np.zeros(0, np.int64)
    starts = np.flatnonzero(np.diff(frame, prepend=frame[0] - 1))
    which = np.repeat(np.arange(len(starts)), np.diff(starts, append=len(w)))
    row, rows = _local(i, which, len(starts))
    column, columns = _local(j, which, len(starts))
    size = rows * columns
    offset = np.cumsum(size) - size
    cell = offset[which] + row * columns[which] + column
    cost, place = np.zeros(int(size.sum())), np.full(int(size.sum()), -1)
    cost[cell] = -w
    place[cell] = np.arange(len(w))
    found = []
    for first, n, m in zip(offset.tolist(), rows.tolist(), columns.tolist(), strict=True):
        a, b = linear_sum_assignment(cost[first : first + n * m].reshape(n, m))
        found.append(first + a * m + b)
    places: Ints = place[np.concatenate(found)]
    return places[places >= 0]


def _local(row: Ints, which: Ints, frames: int) -> tuple[Ints, Ints]:
    """Number of each pair's row among the rows of its frame (K,), and how many rows each frame has."""
    home = np.full(int(row.max()) + 1, -1)
    home[row] = which
    seen = home >= 0
    count = np.bincount(home[seen], minlength=frames)
    number = np.cumsum(seen) - 1
    return number[row] - (np.cumsum(count) - count)[which], count
