"""Ranks runs that were scored on the same sequences: means, paired differences, and ranges of ranks.

Two runs are parted if the paired interval of their difference does not hold 0. The intervals of all pairs hold together
with 95 %: Student's, at the level 5 % / number of pairs (Bonferroni). With two runs it is the usual paired interval. On
a single recording the intervals come from weights of its frames (tracking.ranking). A run's rank range goes
from 1 + the number of runs that are surely better, to the number of runs that are not surely worse. Runs that nothing
parts share their ranks.

Also here: 95 % intervals of all scores of a single recording, by weights of blocks of its frames.

`tracking.scoring.evaluation` gives the scores under weights, `tracking.stats` draws weights and makes intervals.
This module says how long a block is, and on which scale the error of each score is nearly symmetric.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from sim.types import Array, Bools, Ints, Truth
from tracking.scoring.annotated_frames import annotated_frames
from tracking.scoring.catalogue import ALL, CATALOGUE, Score
from tracking.scoring.rows import numbered
from tracking.stats import DRAWS, LEVEL, Scale, block_intervals, compared, joint_level, mean_interval, sign_of


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


def scale_of(score: Score) -> Scale:
    """Returns the `Scale` on which the error of a score is nearly symmetric, as `tracking.stats` names it."""
    if score.unit == "count":
        return "count"
    if score.unit == "1":
        return "share" if score.low == 0 else "below one"
    return "length" if score.low == 0 else "plain"


SCALES = tuple(map(scale_of, ALL))  # The scale of every score, in the order of the catalogue.


def recording_rankings(
    truth: Truth, scores: Sequence[Callable[[Array], Array]], draws: int = DRAWS
) -> dict[str, Ranking]:
    """Returns the ranking of R runs of one recording by each score of the catalogue, by key. scores: for each run a
    function from weights (D, length) of frames to scores (D, K). draws: number of weights drawn."""
    runs, keys = len(scores), len(ALL)
    pairs = list(combinations(range(runs), 2))

    def columns(weights: Array) -> Array:
        own = [score(weights) for score in scores]
        return np.hstack([*own, *(own[i] - own[j] for i, j in pairs)])

    plain: Scale = "plain"
    scales = [*SCALES * runs, *[plain] * (len(pairs) * keys)]
    levels = np.repeat([*[LEVEL] * runs, *[joint_level(len(pairs))] * len(pairs)], keys)
    ends = block_intervals(columns, truth.length, truth.fps, presence_in(truth), draws, scales, levels)
    own, less = (np.array(ends).reshape(3, -1, keys)[:, part] for part in (slice(runs), slice(runs, None)))
    found = {}
    for k, (key, entry) in enumerate(CATALOGUE.items()):
        of_pairs = np.zeros((3, runs, runs))
        for n, (i, j) in enumerate(pairs):
            mean, low, high = less[:, n, k]
            of_pairs[:, i, j], of_pairs[:, j, i] = (mean, low, high), (-mean, -high, -low)
        mean, low, high = own[:, :, k]
        less_mean, less_low, less_high = of_pairs
        pair_ends, sign = (less_mean, less_low, less_high), sign_of(less_low, less_high)
        found[key] = ordered((mean, low, high), pair_ends, sign, entry.better == "higher", 1)
    return found


def presence_in(truth: Truth) -> float:
    """Returns the mean time of presence (`presence`), in frames of the recording even if labels are sparse."""
    return presence(truth.id) * truth.length / max(int(annotated_frames(truth).frames.sum()), 1)


def presence(id: Ints) -> float:
    """Returns the mean number of frames in which a person is present, 1 without people; id (R,): one per row. The mean
    is over rows (sum n² / sum n for people with n rows), so that long presences count more."""
    if not len(id):
        return 1.0
    frames = np.bincount(numbered(id)[1])
    return float(np.square(frames).sum() / frames.sum())
