"""Scores of a single recording made of frames chosen from it, in any order and with repetitions.

`tracking.stats` draws blocks of consecutive frames with replacement, lets this module score each draw, and turns the
scores of all draws into confidence intervals. Scores of events need the original order and are nan. So are core scores,
which leave out frames near merges and splits.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import chain

import numpy as np

from sim.types import Array, Ints, Tracks, Truth
from tracking.grouping.grouped_tracks import with_groups
from tracking.scoring.catalogue import ALL, CATALOGUE, CORE
from tracking.scoring.evaluation import Similarity, evaluate
from tracking.scoring.group_scores import GroupMatch

TIMELESS = np.array([score.family not in (CORE, "events") for score in ALL])
"""Which scores are defined for frames in any order: one bool per entry of `CATALOGUE`, in its order. False for scores
of events and for core scores.
"""


def resampled_scorer(
    truth: Truth, tracks: Sequence[Tracks], similarity: Similarity | None, group_match: GroupMatch
) -> Callable[[Ints], Array]:
    """Returns a function that scores a recording made of chosen frames.

    The argument of that function is an array of frame indices, 0 to truth.length - 1 (frame number - 1), in any order,
    repetitions allowed. Its result is an array (K,) of all scores in the order of `CATALOGUE`. Scores of events and
    core scores are nan, because they need the original order. So is every score that `evaluate` cannot compute.

    tracks: one tracker's `Tracks` of the original recording, one per frame from frame 1, in order. Groups that the
    tracker leaves out are derived once, from the original order. similarity: "boxes", "ground", "image" or None (boxes
    if both sides have them); group_match: "hull" or "members". A chosen frame without tracks counts as empty.

    Raises InputError if tracks of people are in the image, not yet marked as derived, and `truth.px_per_m` is 0 or
    less. The returned function raises IncomparableError if boxes or positions to compare are missing, and ValueError if
    an id occurs twice in one frame.
    """
    original = {t.index: t for t in with_groups(tracks, truth.fps, truth.px_per_m)}

    def score(indices: Ints) -> Array:
        order = (indices + 1).tolist()
        drawn = [original[old].replace(index=new) for new, old in enumerate(order, 1) if old in original]
        found = evaluate(resampled_truth(truth, order), drawn, similarity=similarity, group_match=group_match)
        return np.where(TIMELESS, [found[key] for key in CATALOGUE], np.nan)

    return score


def resampled_truth(truth: Truth, order: Sequence[int]) -> Truth:
    """Returns the truth of the chosen frames in the chosen order, renumbered from 1.

    order: frame numbers from 1 to the truth's length, in any order, repetitions allowed; empty gives a truth of 0
    frames. Rows, groups and `labelled` are those of the chosen frames. Left out are events, near, orders, visible_box,
    truncation, z, heading and height. IndexError may be raised for a number above the truth's length.
    """
    rows = [truth.rows(old) for old in order]
    count = [r.stop - r.start for r in rows]
    place = np.fromiter(chain.from_iterable(range(r.start, r.stop) for r in rows), np.int64)
    pos, vel, box = (None if a is None else a[place] for a in (truth.pos, truth.vel, truth.box))
    at = np.array(order, np.int64) - 1
    ground, image = (None if g is None else tuple(g[k] for k in at) for g in (truth.groups, truth.groups_px))
    return Truth(
        truth.name, truth.fps, len(order), truth.px_per_m, np.repeat(np.arange(1, len(order) + 1), count),
        truth.id[place], truth.group[place], pos, vel, box, truth.visibility[place], groups=ground, groups_px=image,
        labelled=None if truth.labelled is None else truth.labelled[at],
    )  # fmt: skip
