"""One-to-one matching with the greatest total weight, in every frame of a sequence at once.

`match` returns any best matching of each frame. `match_as_table` returns the one that scipy finds for the frame's whole
table, as TrackEval does. `mapped_people` maps tracked people to true people.

A pair (i, j) is *settled* without a solver if its weight is at least the sum of two rivals: the best other pair of i
and the best other pair of j. Such a pair is in some best matching, because it can replace at most these two. Settled
pairs that share no row and no column are in one best matching together. A few passes over arrays therefore match most
of a sequence, and scipy's `linear_sum_assignment` gets the rest, frame by frame.

If the weight clearly exceeds the sum of both rivals, the pair is in *every* best matching. `match_as_table` settles
only these pairs. It passes every frame with a pair left over to scipy as a whole, so that ties are broken as in
TrackEval.
"""

from __future__ import annotations

import numpy as np

from sim.types import Array, Bools, Ints
from tracking.scoring.candidate_pairs import EPS, FOUND, Pairs

CLEARLY = 1 + 1e-9  # factor by which a weight must exceed its rivals to be greater despite rounding
WORTH = 0.2  # share of pairs that a pass must remove for another pass to be quicker than the solver


def match(frame: Ints, i: Ints, j: Ints, weight: Array) -> Bools:
    """Returns which of K pairs are matched, (K,) bool: one to one, with the greatest sum of weights in each frame.

    frame (K,), i (K,): sorted ascending; frame number and row index of one side. j (K,): row index of the other side. A
    row index belongs to one frame only. weight (K,): above 0. Each i and each j is matched at most once. Which of
    several best matchings is returned is unspecified. K = 0 gives an empty array.
    """
    chosen, left = _settle(i, j, weight, strict=False)
    chosen[left[_solved(frame[left], i[left], j[left], weight[left])]] = True
    return chosen


def match_as_table(pairs: Pairs, weight: Array) -> Bools:
    """Returns which of the K pairs are matched, (K,) bool: the greatest sum of weights in each frame, ties broken as
    TrackEval does.

    pairs: candidate pairs. weight (K,): above 0, one per pair, used in place of its similarity. Of several best
    matchings of a frame the result is the one that scipy finds in the table of all the frame's rows, cells without a
    pair being 0.
    """
    chosen, left = _settle(pairs.i, pairs.j, weight, strict=True)
    frame = pairs.frame
    tangled = np.unique(frame[left])
    starts, ends = (np.searchsorted(frame, tangled, side=side).tolist() for side in ("left", "right"))
    for start, end in zip(starts, ends, strict=True):
        chosen[start:end] = solve_frame(pairs, start, end, weight[start:end])
    return chosen


def solve_frame(pairs: Pairs, start: int, end: int, weight: Array) -> Bools:
    """Returns which of the pairs start … end - 1 scipy's linear_sum_assignment matches, (end - start,) bool.

    These must be all pairs of one frame, at least one. weight (end - start,): their weights; the greatest sum is
    sought. The table has all rows of the frame on both sides, and cells without a pair weigh 0.
    """
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
    """Returns a bool mask (K,) of the pairs that are matched without a solver, and the indices of the pairs that a
    solver must still decide.

    i, j (K,): row indices of both sides; weight (K,): above 0. A settled pair weighs at least as much as the best rival
    of i and of j together; with `strict` clearly more, so that it is in every best matching. Pairs in neither result
    are not matched.
    """
    chosen = np.zeros(len(i), bool)
    left = np.arange(len(i))
    while len(left):
        settled = _settled(i[left], j[left], weight[left], strict)
        chosen[left[settled]] = True
        free = left[~_touched(i[left], j[left], settled)]
        worth = len(left) - len(free) >= WORTH * len(left)
        left = free
        if not worth:
            break
    return chosen, left


def _settled(i: Ints, j: Ints, w: Array, strict: bool) -> Bools:
    """Returns which of K pairs one pass settles, (K,) bool; no two settled pairs share i or j.

    i, j (K,): row indices of both sides; w (K,): weights above 0. The weight of a settled pair is at least the sum of
    the best other weight of its i and the best other weight of its j. With `strict` it exceeds (1 + 1e-9) times this
    sum. Without, of several such pairs of one i or one j only the first is settled.
    """
    best_i, rival_i = _leaders(i, w)
    best_j, rival_j = _leaders(j, w)
    candidate = np.flatnonzero((w >= best_i[i]) & (w >= best_j[j]))
    rivals = rival_i[i[candidate]] + rival_j[j[candidate]]
    candidate = candidate[w[candidate] > CLEARLY * rivals if strict else w[candidate] >= rivals]
    settled = np.zeros(len(w), bool)
    settled[candidate] = True
    # Several equal pairs of one row, each alone in its column, all pass the test: keep the first. Columns likewise.
    for row, end in () if strict else ((i, len(best_i)), (j, len(best_j))):
        first = np.full(end, len(w))
        np.minimum.at(first, row[candidate], candidate)
        settled[candidate[first[row[candidate]] < candidate]] = False
    return settled


def _leaders(row: Ints, w: Array) -> tuple[Array, Array]:
    """Returns the greatest and the second greatest weight of each row index 0 … max(row), 0 where there are too few
    pairs.

    row (K,), not empty: row index of each pair; w (K,): its weight, above 0. If two pairs share the greatest weight,
    both results equal it.
    """
    n = int(row.max()) + 1
    best, second = np.zeros(n), np.zeros(n)
    np.maximum.at(best, row, w)
    leads = w == best[row]
    np.maximum.at(second, row[~leads], w[~leads])
    return best, np.where(np.bincount(row[leads], minlength=n) > 1, best, second)


def _touched(i: Ints, j: Ints, chosen: Bools) -> Bools:
    """Returns which of K pairs are chosen, or share i or j with a chosen pair, (K,) bool; chosen (K,): bool."""
    if len(i) == 0:
        return chosen
    taken_i, taken_j = np.zeros(int(i.max()) + 1, bool), np.zeros(int(j.max()) + 1, bool)
    taken_i[i[chosen]] = True
    taken_j[j[chosen]] = True
    return np.asarray(taken_i[i] | taken_j[j])


def _solved(frame: Ints, i: Ints, j: Ints, w: Array) -> Ints:
    """Returns the indices (in 0 … K - 1) of the pairs that scipy matches, with the greatest sum of weights w in each
    frame.

    frame (K,): sorted; i, j (K,): row indices of both sides; w (K,): weights above 0. Each frame is one table of the
    rows that occur in its pairs; cells without a pair weigh 0. Empty without pairs.
    """
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
    """Returns for each of K pairs the index of its row within its frame (K,), and the number of distinct rows of each
    frame (F,).

    row (K,): row index of each pair, each row in one frame only, lower rows in earlier frames. which (K,): number 0 …
    frames - 1 of the pair's frame; frames: F.
    """
    home = np.full(int(row.max()) + 1, -1)
    home[row] = which
    seen = home >= 0
    count = np.bincount(home[seen], minlength=frames)
    number = np.cumsum(seen) - 1
    return number[row] - (np.cumsum(count) - count)[which], count


def mapped_people(pairs: Pairs, least: float = FOUND) -> Ints:
    """Returns for each of the S rows of pairs.est the row of pairs.true that it is mapped to, -1 none: (S,) int64.

    The mapping is the one-to-one matching of each frame with the greatest total similarity, using only pairs of
    similarity `least` (default 0.5) or more.
    """
    near = pairs.keep(pairs.s >= least - EPS)
    chosen = match(near.true.frame[near.i], near.i, near.j, near.s)
    mapped = np.full(len(pairs.est), -1, np.int64)
    mapped[near.j[chosen]] = near.i[chosen]
    return mapped
