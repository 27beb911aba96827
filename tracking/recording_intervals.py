"""95 % intervals of all scores of a single recording, by weights of blocks of its frames.

`tracking.scoring.frame_weights` gives the scores under weights, `tracking.stats` draws weights and makes intervals.
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
from tracking.stats import DRAWS, LEVEL, Scale, block_intervals, joint_level


def scale_of(score: Score) -> Scale:
    """Returns on which scale the error of a score is nearly symmetric."""
    if score.unit == "count":
        return "count"
    if score.unit == "1":
        return "share" if score.low == 0 else "below one"
    return "length" if score.low == 0 else "plain"


SCALES = tuple(map(scale_of, ALL))  # The scale of every score, in the order of the catalogue.


def recording_differences(
    truth: Truth, first: Callable[[Array], Array], second: Callable[[Array], Array], draws: int = DRAWS
) -> tuple[Array, Array, Array]:
    """Returns the differences (K,) of two runs of one recording, first - second, and their 95 % intervals."""

    def difference(weights: Array) -> Array:
        return first(weights) - second(weights)

    return block_intervals(difference, truth.length, truth.fps, _presence(truth), draws)


def recording_rankings(
    truth: Truth, scores: Sequence[Callable[[Array], Array]], draws: int = DRAWS
) -> dict[str, Ranking]:
    """Returns the ranking of R runs of one recording by each score of the catalogue."""
    runs, keys = len(scores), len(ALL)
    pairs = list(combinations(range(runs), 2))

    def columns(weights: Array) -> Array:
        own = [score(weights) for score in scores]
        return np.hstack([*own, *(own[i] - own[j] for i, j in pairs)])

    plain: Scale = "plain"
    scales = [*SCALES * runs, *[plain] * (len(pairs) * keys)]
    levels = np.repeat([*[LEVEL] * runs, *[joint_level(len(pairs))] * len(pairs)], keys)
    ends = block_intervals(columns, truth.length, truth.fps, _presence(truth), draws, scales, levels)
    own, less = (np.array(ends).reshape(3, -1, keys)[:, part] for part in (slice(runs), slice(runs, None)))
    found = {}
    for k, (key, entry) in enumerate(CATALOGUE.items()):
        of_pairs = np.zeros((3, runs, runs))
        for n, (i, j) in enumerate(pairs):
            mean, low, high = less[:, n, k]
            of_pairs[:, i, j], of_pairs[:, j, i] = (mean, low, high), (-mean, -high, -low)
        mean, low, high = own[:, :, k]
        found[key] = ordered((mean, low, high), tuple(of_pairs), entry.better == "higher", 1)  # type: ignore[arg-type]
    return found


def _presence(truth: Truth) -> float:
    return presence(truth.id) * truth.length / max(annotated_frames(truth).count, 1)


def presence(id: Ints) -> float:
    """Returns the mean number of frames for which a person is present, 1 without people."""
    if not len(id):
        return 1.0
    frames = np.bincount(numbered(id)[1])
    return float(np.square(frames).sum() / frames.sum())
