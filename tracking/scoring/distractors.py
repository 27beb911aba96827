"""Leaves tracked people on distractors out of the scores, as MOTChallenge does.

In each frame the boxes of tracks are matched with those of all labelled rows, people or not. The matching is one to
one, at an IoU of 0.5 or more and with the greatest total IoU. A tracked box that is matched to a distractor is left
out. So a track is kept where it fits a person better, and a second track on one distractor counts as false.
"""

from __future__ import annotations

import numpy as np

from sim.types import Truth, Unscored
from tracking.scoring.candidate_pairs import box_pairs
from tracking.scoring.matching import mapped_people
from tracking.scoring.people_and_groups import PersonRows
from tracking.scoring.rows import FrameRows


def without_distractors(truth: Truth, unscored: Unscored, tracked: PersonRows) -> PersonRows:
    """Returns the tracked people without those on distractors; all of them if they have no boxes."""
    if tracked.box is None:
        return tracked
    assert truth.box is not None
    frame = np.concatenate([truth.frame, unscored.frame])
    order = np.argsort(frame, kind="stable")
    box = np.concatenate([truth.box, unscored.box])[order]
    distractor = np.concatenate([np.zeros(len(truth.frame), bool), unscored.distractor])[order]
    matched = mapped_people(box_pairs(FrameRows(frame[order], order), tracked.rows, box, tracked.box))
    return tracked.keep(~((matched >= 0) & distractor[matched]))
