"""Ranks runs of a single recording by all scores, with 95 % intervals from weights of blocks of its frames.

`tracking.scoring.evaluation` gives the scores under weights, `tracking.stats` draws weights and makes intervals.
This module says how long a block is, and on which scale the error of each score is nearly symmetric.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import combinations

import numpy as np

from sim.types import Array, Ints, Truth
from tracking.ranking import Ranking, ordered
from tracking.scoring.annotated_frames import annotated_frames
from tracking.scoring.catalogue import ALL, CATALOGUE, Score
from tracking.scoring.rows import numbered
from tracking.stats import DRAWS, LEVEL, Scale, block_intervals, joint_level, sign_of


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
