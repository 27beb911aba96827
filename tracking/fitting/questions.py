"""Which pairs of people to ask somebody about, so that few answers tell most about the belief at a place.

A question is a pair and a stretch of time in which the two are near each other. Most questions are chosen one after
another by D-optimality for `place_belief`: with slopes x, the prior's precision M, and w = p (1 - p), the next one
has the greatest w x' M⁻¹ x, and M grows by w x x'. So unsure pairs come first, and each tells something new. Nobody
and no part of the recording is asked about again before the others. Some sure pairs are added as a check.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import zip_longest

import numpy as np

from sim.types import Array, Bools, Ints
from tracking.fitting.place_belief import PRECISION, features
from tracking.grouping.explained_pairs import ExplainedPairs

COUNT = 20  # Questions.
CHECKS = 6  # Of these, about pairs that are sure: one half together, the other not.
SURE = 3.0  # Log-odds from which on a pair is sure.
PAUSE = 2.0  # s: a stretch goes on over shorter pauses in which the two are not near each other, or not seen.
LONGEST = 12.0  # s: of a longer stretch the part around the step in which the two are nearest.
SHORT = 2.0  # s: shorter stretches are asked about only if there are not enough others.
QUARTERS = 4  # Parts of the recording, between which the questions are divided.


@dataclass(frozen=True, slots=True)
class Question:
    """Do persons a and b belong together from the first to the last of these frames (from 1, inclusive)?"""

    a: int
    b: int
    first: int
    last: int


@dataclass(frozen=True, slots=True, eq=False)
class Stretches:
    """K stretches, one of each pair: rows begin (K,) to end (K,), exclusive, of `ExplainedPairs`."""

    begin: Ints
    end: Ints

    def means(self, rows: Array) -> Array:
        """Returns the means (K, …) of an array (R, …) over the stretches."""
        total = np.concatenate([np.zeros((1, *rows.shape[1:])), rows.cumsum(axis=0)])
        length = (self.end - self.begin).reshape(-1, *[1] * (rows.ndim - 1))
        return np.asarray((total[self.end] - total[self.begin]) / length)

    def take(self, kept: Ints | Bools) -> Stretches:
        """Returns some of the stretches."""
        return Stretches(self.begin[kept], self.end[kept])


def choose_questions(pairs: ExplainedPairs, count: int = COUNT, allowed: Bools | None = None) -> list[Question]:
    """Returns at most `count` questions, the most telling first, with a sure pair after each two or three others.

    allowed (number of pairs,): False for pairs that must not be asked about; None: all may be. The choice follows from
    the evidence alone.
    """
    found = shown_stretches(pairs)
    if allowed is not None:
        found = found.take(allowed[pairs.pair[found.begin]])
    long = (pairs.step[found.end - 1] - pairs.step[found.begin] + 1) * pairs.seconds >= SHORT
    if long.sum() >= count:
        found = found.take(long)
    log_odds = found.means(pairs.log_odds)
    unsure = np.flatnonzero(np.abs(log_odds) < SURE)
    telling = [int(unsure[k]) for k in _telling(pairs, found.take(unsure), count - CHECKS)]
    checks = _checks(log_odds, count - len(telling))
    parts = zip(*(np.array_split(np.array(part, np.int64), CHECKS) for part in (telling, checks)), strict=True)
    order = [k for two in parts for k in np.concatenate(two).tolist()]
    return [question_of(pairs, int(found.begin[k]), int(found.end[k])) for k in order]


def shown_stretches(pairs: ExplainedPairs) -> Stretches:
    """Returns of each pair the longest stretch in which the two are near each other, cut to 12 s."""
    bridge = max(1, round(PAUSE / pairs.seconds))
    new = (np.diff(pairs.pair) != 0) | (np.diff(pairs.step) > bridge)
    begin = np.flatnonzero(np.append(True, new)[: len(pairs.pair)])
    end = np.append(begin[1:], len(pairs.pair))[: len(begin)]
    order = np.lexsort((begin, begin - end, pairs.pair[begin]))
    longest = order[np.append(True, np.diff(pairs.pair[begin[order]]) != 0)[: len(order)]]
    cut = [_cut(pairs, int(begin[k]), int(end[k])) for k in longest]
    return Stretches(*np.array(cut, np.int64).reshape(-1, 2).T)


def _cut(pairs: ExplainedPairs, begin: int, end: int) -> tuple[int, int]:
    steps = int(LONGEST / pairs.seconds)
    step = pairs.step[begin:end]
    nearest = int(step[np.argmin(pairs.values[begin:end, 0])])
    low = int(np.clip(nearest - steps // 2, step[0], max(step[0], step[-1] - steps + 1)))
    inside = np.searchsorted(step, [low, low + steps])
    return begin + int(inside[0]), begin + int(inside[1])


def _telling(pairs: ExplainedPairs, found: Stretches, count: int) -> list[int]:
    """Returns the numbers of the most telling stretches, in the order in which they are chosen."""
    x, p = found.means(features(pairs)), 1 / (1 + np.exp(-found.means(pairs.log_odds)))
    w, precision = p * (1 - p), PRECISION.copy()
    who = np.column_stack([pairs.a[found.begin], pairs.b[found.begin]])
    quarter = pairs.step[found.begin] * pairs.size * QUARTERS // max(pairs.length, 1)
    free, times, parts = np.ones(len(x), bool), dict[int, int](), np.zeros(QUARTERS)
    chosen = list[int]()
    while free.any() and len(chosen) < count:
        known = np.array([max(times.get(a, 0), times.get(b, 0)) for a, b in who.tolist()])
        fullest = np.array([parts[q] for q in quarter])
        gain = w * np.einsum("ki,ij,kj->k", x, np.linalg.inv(precision), x)
        # least asked about people first, then least asked about quarters, then the gain
        best = int(np.lexsort((-gain, fullest, known, ~free))[0])
        chosen.append(best)
        free[best] = False
        parts[quarter[best]] += 1
        for person in who[best].tolist():
            times[person] = times.get(person, 0) + 1
        precision += w[best] * np.outer(x[best], x[best])
    return chosen


def _checks(log_odds: Array, count: int) -> list[int]:
    """Returns at most `count` sure stretches, together and not in turn, as many of both as there are; of each kind
    those at even distances in the order of their log-odds."""
    sides = [np.flatnonzero(sign * log_odds >= SURE) for sign in (1, -1)]
    most = min(-(-count // 2), len(sides[0]))
    fewer = min(count - most, len(sides[1]))
    picks = []
    for side, share in zip(sides, (min(count - fewer, len(sides[0])), fewer), strict=True):
        order = side[np.argsort(np.abs(log_odds[side]), kind="stable")]
        picks.append(order[np.linspace(0, len(side) - 1, share).round().astype(np.int64)].tolist())
    return [k for two in zip_longest(*picks) for k in two if k is not None]


def question_of(pairs: ExplainedPairs, begin: int, end: int) -> Question:
    """Returns the question about the stretch of rows begin to end, exclusive."""
    first, last = (int(pairs.step[row]) * pairs.size for row in (begin, end - 1))
    return Question(int(pairs.a[begin]), int(pairs.b[begin]), first + 1, min(last + pairs.size, pairs.length))
