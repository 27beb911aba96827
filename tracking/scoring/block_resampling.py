"""A recording put together from some of its own frames, for intervals by moving blocks (tracking.stats)."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import chain

import numpy as np

from sim.types import Array, Ints, Tracks, Truth
from tracking.grouping.grouped_tracks import with_groups
from tracking.scoring.catalogue import ALL, CATALOGUE, CORE
from tracking.scoring.evaluation import Similarity, evaluate
from tracking.scoring.groups import GroupMatch

TIMELESS = np.array([score.family not in (CORE, "events") for score in ALL])
"""Scores that frames in another order still have; events, and the core beside them, need time as it was."""


def scorer(
    truth: Truth, tracks: Sequence[Tracks], similarity: Similarity | None, group_match: GroupMatch
) -> Callable[[Ints], Array]:
    """A function of places of frames from 0, some more than once: scores (K,) in the catalogue's order of the recording
    made of these frames; nan for those that need time as it was. Groups are derived before, once."""
    answers = {t.index: t for t in with_groups(tracks, truth.fps, truth.px_per_m)}

    def score(places: Ints) -> Array:
        order = (places + 1).tolist()
        told = [answers[old].replace(index=new) for new, old in enumerate(order, 1) if old in answers]
        found = evaluate(drawn(truth, order), told, similarity=similarity, group_match=group_match)
        return np.where(TIMELESS, [found[key] for key in CATALOGUE], np.nan)

    return score


def drawn(truth: Truth, order: Sequence[int]) -> Truth:
    """The truth of these frames in this order, numbered anew; what time would be needed for is not labelled."""
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
