"""Tracked people that the labels leave out of the scores: on distractors, in ignored regions, or too low.

These are the rules of MOTChallenge and KITTI, equal to the preprocessing of TrackEval's MotChallenge2DBox and
Kitti2DBox. A truth states in `Unscored` what they need: MOTChallenge has distractors alone.

In each frame the boxes of tracks are matched with those of all labelled rows, people or not, except regions. The
matching is one to one, at an IoU of 0.5 or more and with the greatest total IoU. A tracked box that is matched to a
distractor is left out. So a track is kept where it fits a person better, and a second track on one distractor counts as
false. A tracked box that is matched to nothing is left out if more than half of it lies in one region, or if it is no
higher than `min_height`.
"""

from __future__ import annotations

import numpy as np

from sim.geometry.boxes import box_intersections
from sim.types import Bools, Truth
from tracking.scoring.matching import mapped_people
from tracking.scoring.people import PersonRows
from tracking.scoring.rows import FrameRows
from tracking.scoring.similarity import EPS, box_pairs, same_frame

INSIDE = 0.5  # a box is in a region if a larger share of its area is


def left_out(truth: Truth, tracked: PersonRows) -> Bools:
    """Returns which of the R tracked people are left out, (R,); none if the tracks have no boxes."""
    unscored, box = truth.unscored, tracked.box
    out = np.zeros(len(tracked.rows), bool)
    if unscored is None or box is None:
        return out
    assert truth.box is not None, "labels with unscored boxes have boxes of people"
    region = np.zeros(len(unscored.frame), bool) if unscored.region is None else unscored.region
    if not (unscored.distractor.any() or region.any() or unscored.min_height > 0):
        return out
    frame = np.concatenate([truth.frame, unscored.frame[~region]])
    order = np.argsort(frame, kind="stable")
    labelled = np.concatenate([truth.box, unscored.box[~region]])[order]
    distractor = np.concatenate([np.zeros(len(truth.frame), bool), unscored.distractor[~region]])[order]
    matched = mapped_people(box_pairs(FrameRows(frame[order], order), tracked.rows, labelled, box))
    if unscored.min_height > 0:
        out = box[:, 3] <= unscored.min_height + EPS
    for i, j in same_frame(unscored.frame[region], tracked.rows.frame):
        inner = box_intersections(unscored.box[region][i], box[j])
        out[j[inner / (box[j, 2] * box[j, 3]) > INSIDE + EPS]] = True
    return np.where(matched < 0, out, np.append(distractor, False)[matched])
