"""Ranks runs that were scored on the same sequences: means, paired differences, and ranges of ranks.

Two runs are parted if the paired interval of their difference does not hold 0. The intervals of all pairs hold together
with 95 %: Student's, at the level 5 % / number of pairs (Bonferroni). With two runs it is the usual paired interval. On
a single recording the intervals come from weights of its frames (tracking.recording_ranking). A run's rank range goes
from 1 + the number of runs that are surely better, to the number of runs that are not surely worse. Runs that nothing
parts share their ranks.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sim.types import Array, Bools, Ints
from tracking.stats import compared, mean_interval


@dataclass(frozen=True, eq=False)
class Ranking:
    """R runs in order of their means over sequences, best first; runs of equal mean in the order given."""

    order: Ints  # (R,) index of each run as given
    mean: Array  # (R,), with its own 95 % interval
    low: Array
    high: Array
    first: Ints  # (R,) range of ranks, from 1
    last: Ints
    less: Array  # (R, R) mean of run i minus run j over the same sequences, with the joint interval
    less_low: Array
    less_high: Array
    better: Bools  # (R, R) run i is surely better than run j
    sequences: int  # where all scores are known; only these count. 1 for a single recording


def rank(values: Array, upwards: bool = True) -> Ranking:
    """Returns the ranking of R runs by their scores on S sequences, values (R, S). Sequences where a value is not
    finite are left out. upwards: True if greater values are better."""
    scores = values[:, np.isfinite(values).all(axis=0)]
    runs, count = scores.shape
    less = (scores[:, None] - scores[None]).reshape(runs * runs, count)
    *ends, sign = compared(less.T, runs * (runs - 1) // 2)
    mean, low, high = (end.reshape(runs, runs) for end in ends)
    return ordered(mean_interval(scores.T), (mean, low, high), sign.reshape(runs, runs), upwards, count)


def ordered(
    own: tuple[Array, Array, Array], pairs: tuple[Array, Array, Array], sign: Ints, upwards: bool, count: int
) -> Ranking:
    """Returns the ranking of R runs by their means.

    own: mean, low and high of each run, (R,) each. pairs: mean, low and high of run i minus run j, (R, R) each. sign
    (R, R): sure sign of run i minus run j. upwards: True if greater means are better. count: number of sequences.
    """
    mean, own_low, own_high = own
    less, low, high = pairs
    runs = len(mean)
    better = sign == (1 if upwards else -1)
    order = np.argsort(-mean if upwards else mean, kind="stable")
    first, last = 1 + better.sum(axis=0), runs - better.sum(axis=1)
    both = np.ix_(order, order)
    alone = mean[order], own_low[order], own_high[order]
    ranks = first[order], last[order]
    return Ranking(order, *alone, *ranks, less[both], low[both], high[both], better[both], count)
