"""Matches a recording's detections to its labelled people: the data that a detector's profile is fitted to.

In each frame detections and people are matched one to one, with the greatest sum of overlaps of at least 0.3. An
overlap is the IoU (intersection over union) with the whole box or with the box of the visible part, whichever is
greater. A detector whose boxes are all too wide or too high would lose matches by this alone. So the median error of a
first matching is applied to the labelled boxes, and the matching is repeated.
"""

from __future__ import annotations

import warnings
from collections.abc import Sequence as SequenceOf
from dataclasses import dataclass

import numpy as np

from scenarios.errors import InputError
from scenarios.schema.sensor import BoxNoise
from sim.detector.box_noise import box_errors, perturb_boxes
from sim.geometry.boxes import box_iou
from sim.scene.visibility import image_size_of_boxes, with_visibility
from sim.store.truth_files import scores_or_ones
from sim.types import Array, Bools, Camera, Detections, Ints, Sequence, Truth, Unscored
from tracking.scoring.annotated_frames import annotated_frames
from tracking.scoring.matching import match
from tracking.scoring.misreading import shifted_boxes
from tracking.scoring.rows import FrameRows
from tracking.scoring.similarity import compare, same_frame

GATE = 0.3  # least overlap of a match
IGNORED = 0.5  # least overlap of an unmatched detection with an unscored box for the detection to be dropped


@dataclass(frozen=True)
class MatchedRecording:
    """A recording with R labelled rows and M detections, both sorted by frame, matched to each other."""

    truth: Truth  # the labels, with boxes and visibilities (visible shares, 0 to 1)
    size: tuple[int, int]  # image width and height in px
    camera: Camera | None  # of the recording, None if unknown
    frame: Ints  # (M,): frame number of each detection, from 1
    box: Array  # (M, 4): left, top, width, height of each detection in px
    score: Array  # (M,): the detector's score of each detection; 1 without scores
    pos: Array | None  # (M, 2): the detections' positions x, y on the ground in m; None if they or the labels have none
    match: Ints  # (R,): index of the detection of each labelled row, -1 missed
    owner: Ints  # (M,): index of the labelled row of each detection, -1 false alarm

    @property
    def hit(self) -> Bools:
        """Which labelled rows are detected, (R,) bool."""
        return np.asarray(self.match >= 0)

    @property
    def false(self) -> Bools:
        """Which detections are false alarms, belonging to no labelled row, (M,) bool."""
        return np.asarray(self.owner < 0)


def match_sequence(sequence: Sequence) -> MatchedRecording:
    """Returns the labels and detections of a recording, matched one to one in each frame.

    If labels are sparse, only the annotated frames are kept, renumbered from 1. Raises InputError if there are no
    labelled people or no detections, or if either lack boxes.
    """
    file, truth = sequence.source.get("path", sequence.name), sequence.truth
    expected, remedy = "labelled boxes and a detector's boxes of the same recording", "give a recording with gt and det"
    found = [f.detections for f in sequence.without_pictures() if f.detections is not None]
    faults = {
        "no labelled people": truth is None or not len(truth.id),
        "labels without boxes": truth is not None and truth.box is None,
        "no detections (det/det.txt)": not sequence.has_detections,
        "no detection in any frame": not any(len(d.pos) for d in found),
        "detections without boxes": any(d.box is None for d in found if len(d.pos)),
    }
    for got, wrong in faults.items():
        if wrong:
            raise InputError(file=file, got=got, expected=expected, remedy=remedy)
    assert truth is not None
    made = match_detections(*_annotated(truth, found), sequence.image_size, sequence.camera)
    row = made.owner[~made.false]  # its frame is that of the recording, also where annotated frames are renumbered
    shifted = shifted_boxes(truth, truth.frame[row], made.box[~made.false])
    if shifted:
        warnings.warn(f"{file}: {shifted}", stacklevel=2)
    return made


def _annotated(truth: Truth, found: list[Detections]) -> tuple[Truth, list[Detections]]:
    annotated = annotated_frames(truth)
    if annotated.step == 1:
        return truth, found
    known = np.flatnonzero(annotated.frames)
    turn = np.searchsorted(known, np.arange(truth.length + 1)) + 1
    beside = truth.unscored
    if beside is not None:
        kept = annotated.frames[beside.frame]
        beside = Unscored(turn[beside.frame[kept]], beside.box[kept], beside.distractor[kept])
        truth = truth.replace(unscored=beside)
    truth = truth.replace(frame=turn[truth.frame], fps=truth.fps / float(np.diff(known).mean()), length=len(known))
    return truth, [d.replace(index=int(turn[d.index])) for d in found if annotated.frames[d.index]]


def match_detections(
    truth: Truth, found: SequenceOf[Detections], size: tuple[int, int] | None, camera: Camera | None = None
) -> MatchedRecording:
    """Returns labels and detections, one per frame, matched one to one; both must have boxes.

    size: width and height of the picture, px; None takes the extent of all boxes. An unmatched detection is dropped if
    its IoU with an unscored label is 0.5 or more.
    """
    assert truth.box is not None
    box = np.concatenate([np.zeros((0, 4)), *(d.box for d in found if d.box is not None)])
    frame = np.concatenate([np.zeros(0, np.int64), *(np.full(len(d.pos), d.index) for d in found)])
    score = np.concatenate([np.zeros(0), *(scores_or_ones(d.score, len(d.pos)) for d in found)])
    on_ground = truth.pos is not None and any(d.plane == "ground" for d in found if len(d.pos))
    pos = np.concatenate([np.zeros((0, 2)), *(d.pos for d in found)]) if on_ground else None
    size = size if size is not None else image_size_of_boxes(box, truth.box)
    true, truth = truth.box, with_visibility(truth, size)
    pairs = _pairs(truth, frame, box)
    if len(pairs[0]):
        # a detector whose boxes are all too wide would lose matches by this alone
        usual = np.median(box_errors(box[pairs[1]], true[pairs[0]]), axis=0)
        pairs = _pairs(truth, frame, box, usual)
    owner, partner = np.full(len(box), -1, np.int64), np.full(len(truth.id), -1, np.int64)
    owner[pairs[1]], partner[pairs[0]] = pairs
    keep, truth = (owner >= 0) | ~_covered(frame, box, truth.unscored), truth.replace(unscored=None)
    number = np.cumsum(keep) - 1
    partner = np.where(partner >= 0, number[np.maximum(partner, 0)], -1) if len(box) else partner
    pos = None if pos is None else pos[keep]
    return MatchedRecording(truth, size, camera, frame[keep], box[keep], score[keep], pos, partner, owner[keep])


def _pairs(truth: Truth, frame: Ints, box: Array, usual: Array | None = None) -> tuple[Ints, Ints]:
    """Returns the matched labelled rows and detections (K,); usual (4,): errors applied to the labelled boxes first."""
    assert truth.box is not None
    whole = truth.box
    part = whole if truth.visible_box is None else np.where(np.isfinite(truth.visible_box), truth.visible_box, whole)
    if usual is not None:
        bias = BoxNoise(**dict(zip(("across", "foot", "top", "width"), ((float(e), 0.0) for e in usual), strict=True)))
        whole, part = (perturb_boxes(b, np.ones(len(b)), bias, np.zeros((len(b), 4))) for b in (whole, part))

    def overlap(i: Ints, j: Ints) -> tuple[Ints, Array]:
        iou = np.maximum(box_iou(whole[i], box[j]), box_iou(part[i], box[j]))
        near = np.flatnonzero(iou > GATE)
        return near, iou[near]

    pairs = compare(FrameRows(truth.frame, truth.id), FrameRows(frame, np.arange(len(frame))), overlap)
    chosen = match(pairs.frame, pairs.i, pairs.j, pairs.s - GATE)
    return pairs.i[chosen], pairs.j[chosen]


def _covered(frame: Ints, box: Array, unscored: Unscored | None) -> Bools:
    """Returns which detections overlap an unscored box of their frame by an IoU of 0.5 or more, (M,)."""
    covered = np.zeros(len(box), bool)
    if unscored is not None:
        for i, j in same_frame(unscored.frame, frame):
            covered[j[box_iou(unscored.box[i], box[j]) >= IGNORED]] = True
    return covered
