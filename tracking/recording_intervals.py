"""95 % intervals of all scores of a single recording, by weights of blocks of its frames.

`tracking.scoring.frame_weights` gives the scores under weights, `tracking.stats` draws weights and makes intervals.
This module says how long a block is, and on which scale the error of each score is nearly symmetric.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from sim.types import Array, Ints, Truth
from tracking.scoring.annotated_frames import annotated_frames
from tracking.scoring.catalogue import ALL
from tracking.scoring.catalogue_entries import Score
from tracking.scoring.rows import numbered
from tracking.stats import DRAWS, Scale, block_intervals


def scale_of(score: Score) -> Scale:
    """Returns the scale of a score of the catalogue: "share" (0 to 1), "below one" (any value up to 1), "count",
    "length" (0 or more), or "plain".
    """
    if score.unit == "count":
        return "count"
    if score.unit == "1":
        return "share" if score.low == 0 else "below one"
    return "length" if score.low == 0 else "plain"


SCALES = tuple(map(scale_of, ALL))
"""The scale of every score, in the order of the catalogue."""


def recording_intervals(
    truth: Truth, score: Callable[[Array], Array], draws: int = DRAWS
) -> tuple[Array, Array, Array]:
    """Returns the scores (K,) of one recording, and the low and the high ends (K,) of their 95 % intervals.

    truth: of the recording. score: from weights (D, length) of its frames to all scores (D, K), nan where unknown, as
    `weighted_scorer` gives it. draws: number of draws of weights.
    """
    return block_intervals(score, truth.length, truth.fps, _presence(truth), draws, SCALES)


def recording_differences(
    truth: Truth, first: Callable[[Array], Array], second: Callable[[Array], Array], draws: int = DRAWS
) -> tuple[Array, Array, Array]:
    """Returns the differences (K,) of the scores of two runs of one recording, first minus second, and the low and the
    high ends (K,) of their 95 % intervals.

    first, second: as `score` in `recording_intervals`. Both get the same weights in each draw.
    """

    def difference(weights: Array) -> Array:
        return first(weights) - second(weights)

    return block_intervals(difference, truth.length, truth.fps, _presence(truth), draws)


def _presence(truth: Truth) -> float:
    """Returns the mean number of frames for which a person is present, also in frames between sparse labels."""
    return presence(truth.id) * truth.length / max(annotated_frames(truth).count, 1)


def presence(id: Ints) -> float:
    """Returns the mean number of frames for which a person is present, 1 without people.

    id (R,): ids of people in frames, one row per person and frame. The mean is over these rows, so that a person counts
    by the frames of its presence. For so long an error may last: a person who was confused with another stays so until
    it leaves.
    """
    if not len(id):
        return 1.0
    frames = np.bincount(numbered(id)[1])
    return float(np.square(frames).sum() / frames.sum())
