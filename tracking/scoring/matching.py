"""One-to-one matching with the greatest total weight, in every frame of a sequence at once.

`match` returns any best matching of each frame. `match_as_table` returns the one that scipy finds for the frame's whole
table, as TrackEval does. `mapped_people` maps tracked people to true people.

A pair (i, j) is *settled* without a solver if its weight is at least the sum of two rivals: the best other pair of i
and the best other pair of j. Such a pair is in some best matching, because it can replace at most these two. Settled
pairs that share no row and no column are in one best matching together. A few passes over arrays therefore match most
of a sequence, and scipy's `linear_sum_assignment` gets the rest, frame by frame.

If the weight clearly exceeds the sum of both rivals, the pair is in *every* best matching. `match_as_table` settles
only these pairs. The pairs that are left over in a frame have one best matching in nearly all frames. It is found in
the small table of their rows and columns. Where several matchings are best, scipy gets the frame's whole table, so that
ties are broken as in TrackEval.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise

import numpy as np

from sim.types import Array, Bools, Ints
from tracking.scoring.rows import numbered
from tracking.scoring.similarity import EPS, FOUND, Pairs

CLEARLY = 1 + 1e-9  # factor by which a weight must exceed its rivals to be greater despite rounding
WORTH = 0.2  # share of pairs that a pass must remove for another pass to be quicker than the solver


def match(frame: Ints, i: Ints, j: Ints, weight: Array) -> Bools:
    """Returns which of K pairs are matched, (K,) bool: one to one, with the greatest sum of weights in each frame.

    frame (K,): frame number of each pair, ascending. i, j (K,): the pair's row index on each side, i ascending; a row
    occurs in one frame only. weight (K,): above 0.
    """
    chosen, left = _settle(i, j, weight, strict=False)
    for part, row, column, shape in _tables(frame, i, j, left):
        chosen[part] = _solve(row, column, shape, weight[part])
    return chosen


def match_as_table(pairs: Pairs, weight: Array) -> Bools:
    """Returns which of the pairs are matched, (K,) bool: as `match`, but with ties broken as TrackEval does. weight
    (K,): above 0."""
    chosen, left = _settle(pairs.i, pairs.j, weight, strict=True)
    for part, row, column, shape in _tables(pairs.frame, pairs.i, pairs.j, left):
        found = _only_matching(row, column, shape, weight[part])
        if found is None:
            whole = slice(*np.searchsorted(pairs.frame, (pairs.frame[part[0]], pairs.frame[part[0]] + 1)))
            chosen[whole] = solve_frame(pairs, whole, weight[whole])
        else:
            chosen[part] = found
    return chosen


def _tables(frame: Ints, i: Ints, j: Ints, left: Ints) -> Iterator[tuple[Ints, Ints, Ints, tuple[int, int]]]:
    """Yields of each frame the indices of its pairs that are left, and their rows and columns in a table of this shape
    that has no others."""
    # Rows are sorted by frame: among those of the pairs that are left, those of a frame are neighbours.
    row, column = numbered(i[left])[1], numbered(j[left])[1]
    cuts = np.flatnonzero(np.diff(frame[left], prepend=-1, append=-1))
    low, high = (of.reduceat(column, cuts[:-1]).tolist() for of in (np.minimum, np.maximum))
    for (first, end), least, most in zip(pairwise(cuts.tolist()), low, high, strict=True):
        a = row[first:end] - row[first]
        yield left[first:end], a, column[first:end] - least, (int(a[-1]) + 1, most - least + 1)


def solve_rest(i: Ints, j: Ints, weight: Array) -> Bools | None:
    """Returns which of P pairs are in their only best matching, (P,) bool; None if several are best. i, j (P,): rows of
    both sides, weight (P,)."""
    (rows, a), (columns, b) = numbered(i), numbered(j)
    return _only_matching(a, b, (len(rows), len(columns)), weight)


def _only_matching(row: Ints, column: Ints, shape: tuple[int, int], weight: Array) -> Bools | None:
    found = _solve(row, column, shape, weight)
    # A best matching whose pairs all lose a little is still found only if every other one is worse.
    little = (CLEARLY - 1) * float(weight.max())
    again = _solve(row, column, shape, weight - little * found)
    return found if np.array_equal(found, again) else None


def solve_frame(pairs: Pairs, whole: slice, weight: Array) -> Bools:
    """Returns which of the P pairs of one frame scipy's linear_sum_assignment matches, (P,) bool. whole: the indices of
    all pairs of the frame. weight (P,): of these pairs."""
    i, j = pairs.i[whole], pairs.j[whole]
    frame = pairs.true.frame[i[0]]
    (top, bottom), (first, last) = (np.searchsorted(r.frame, (frame, frame + 1)) for r in (pairs.true, pairs.est))
    return _solve(i - top, j - first, (bottom - top, last - first), weight)


def _solve(row: Ints, column: Ints, shape: tuple[int, int], weight: Array) -> Bools:
    from scipy.optimize import linear_sum_assignment

    cost, partner = np.zeros(shape), np.full(shape[0], -1)
    cost[row, column] = -weight
    rows, columns = linear_sum_assignment(cost)
    partner[rows] = columns
    return np.asarray(partner[row] == column)


def _settle(i: Ints, j: Ints, weight: Array, strict: bool) -> tuple[Bools, Ints]:
    """Returns which pairs are matched without a solver, (K,), and the indices of those that a solver must decide."""
    chosen = np.zeros(len(i), bool)
    left = np.arange(len(i))
    while len(left):
        settled = _settled(i[left], j[left], weight[left], strict)
        chosen[left[settled]] = True
        free = left[~_touched(i[left], j[left], settled)]
        # another pass must be quicker than the solver
        worth = len(left) - len(free) >= WORTH * len(left)
        left = free
        if not worth:
            break
    return chosen, left


def _settled(i: Ints, j: Ints, w: Array, strict: bool) -> Bools:
    """Returns which of K pairs one pass settles, (K,); no two of them share i or j."""
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
    """Returns the greatest and the second greatest weight of each row 0 … max(row), 0 where there are too few pairs."""
    n = int(row.max()) + 1
    best, second = np.zeros(n), np.zeros(n)
    np.maximum.at(best, row, w)
    leads = w == best[row]
    np.maximum.at(second, row[~leads], w[~leads])
    return best, np.where(np.bincount(row[leads], minlength=n) > 1, best, second)


def _touched(i: Ints, j: Ints, chosen: Bools) -> Bools:
    if len(i) == 0:
        return chosen
    taken_i, taken_j = np.zeros(int(i.max()) + 1, bool), np.zeros(int(j.max()) + 1, bool)
    taken_i[i[chosen]] = True
    taken_j[j[chosen]] = True
    return np.asarray(taken_i[i] | taken_j[j])


def mapped_people(pairs: Pairs, least: float = FOUND) -> Ints:
    """Returns for each row of pairs.est the index of the row of pairs.true that it is matched with, -1 none, (S,).

    Matching is one to one in each frame, among pairs of similarity `least` or more, with the greatest total similarity.
    """
    near = pairs.keep(pairs.s >= least - EPS)
    chosen = match(near.true.frame[near.i], near.i, near.j, near.s)
    mapped = np.full(len(pairs.est), -1, np.int64)
    mapped[near.j[chosen]] = near.i[chosen]
    return mapped
