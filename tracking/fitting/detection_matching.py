"""Which detection is of which labelled person: what every part of a detector's profile is measured on.

Detections and people of a frame are matched one to one by the greatest sum of overlaps (intersection over union, with
the whole box or with its visible part, whichever is more) of at least GATE. A detector whose boxes are all too wide or
too high would lose matches by that alone, so its usual error is taken off before a second, final matching.
"""

from __future__ import annotations

from collections.abc import Sequence as SequenceOf
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from scenarios.errors import InputError
from scenarios.schema.sensor import BoxNoise
from sim.detector.box_noise import box_errors, perturb_boxes
from sim.io.formats import mot_text
from sim.scene.box_visibility import image_size_of_boxes, with_visibility
from sim.types import Array, Bools, Camera, Detections, Ints, Sequence, Truth
from tracking.filters.assignment import optimal

GATE = 0.3
IGNORED = 0.5  # overlap with a row that MOTChallenge leaves out of scoring
DISTRACTORS = (2, 7, 8, 12)  # of MOTChallenge: people on vehicles, static people, distractors, reflections


@dataclass(frozen=True)
class MatchedRecording:
    """A recording: truth with visibilities, R rows, and M detections in the order of their frames.

    frame, score (M,), box (M, 4); pos (M, 2) where detections are points on the ground, else None. match (R,): the
    detection of each person, -1 missed; owner (M,): the row of each detection, -1 false alarm.
    """

    truth: Truth
    size: tuple[int, int]
    camera: Camera | None
    frame: Ints
    box: Array
    score: Array
    pos: Array | None
    match: Ints
    owner: Ints

    @property
    def hit(self) -> Bools:
        """(R,) who was detected."""
        return np.asarray(self.match >= 0)

    @property
    def false(self) -> Bools:
        """(M,) which detections are of nobody."""
        return np.asarray(self.owner < 0)

    def rows(self, index: int) -> slice:
        """Detections of frame `index`."""
        low, high = np.searchsorted(self.frame, (index, index + 1))
        return slice(int(low), int(high))


def match_sequence(sequence: Sequence) -> MatchedRecording:
    """A recording's labels against its detections; InputError where one of them, or their boxes, are missing."""
    file, truth = sequence.source.get("path", sequence.name), sequence.truth
    missing = (
        ("no labelled people", truth is None or not len(truth.id)),
        ("labels without boxes", truth is not None and truth.box is None),
        ("no detections (det/det.txt)", not sequence.has_detections),
    )
    for got, wrong in missing:
        if wrong:
            expected = "labelled boxes and a detector's boxes of the same recording"
            raise InputError(file=file, got=got, expected=expected, remedy="give a recording with gt and det")
    found = [f.detections for f in sequence.without_pictures() if f.detections is not None]
    if any(d.box is None for d in found if len(d.pos)) or not any(len(d.pos) for d in found):
        got = "detections without boxes" if any(len(d.pos) for d in found) else "no detection in any frame"
        raise InputError(file=file, got=got, expected="a detector's boxes", remedy="give its boxes in det/det.txt")
    assert truth is not None
    return match(truth, found, sequence.image_size, sequence.camera, _left_out(sequence))


def match(
    truth: Truth,
    found: SequenceOf[Detections],
    size: tuple[int, int] | None,
    camera: Camera | None = None,
    left_out: tuple[Ints, Array] | None = None,
) -> MatchedRecording:
    """Truth with boxes against detections with boxes, frame by frame; left_out: frames and boxes of what does not
    count, so that a detection there is no false alarm."""
    assert truth.box is not None
    box = np.concatenate([np.zeros((0, 4)), *(d.box for d in found if d.box is not None)])
    frame = np.concatenate([np.zeros(0, np.int64), *(np.full(len(d.pos), d.index) for d in found)])
    score = np.concatenate([np.zeros(0), *(d.score for d in found)])
    on_ground = truth.pos is not None and any(d.plane == "ground" for d in found if len(d.pos))
    pos = np.concatenate([np.zeros((0, 2)), *(d.pos for d in found)]) if on_ground else None
    size = size if size is not None else image_size_of_boxes(box, truth.box)
    true, truth = truth.box, with_visibility(truth, size)
    pairs = _pairs(truth, frame, box)
    if len(pairs[0]):
        usual = np.median(box_errors(box[pairs[1]], true[pairs[0]]), axis=0)
        pairs = _pairs(truth, frame, box, usual)
    owner, partner = np.full(len(box), -1, np.int64), np.full(len(truth.id), -1, np.int64)
    owner[pairs[1]], partner[pairs[0]] = pairs
    keep = np.ones(len(box), bool) if left_out is None else (owner >= 0) | ~_covered(frame, box, *left_out)
    number = np.cumsum(keep) - 1
    partner = np.where(partner >= 0, number[np.maximum(partner, 0)], -1) if len(box) else partner
    pos = None if pos is None else pos[keep]
    return MatchedRecording(truth, size, camera, frame[keep], box[keep], score[keep], pos, partner, owner[keep])


def _pairs(truth: Truth, frame: Ints, box: Array, usual: Array | None = None) -> tuple[Ints, Ints]:
    """Rows of the truth and of the detections that belong together; usual: errors (4,) that all boxes have."""
    assert truth.box is not None
    whole = truth.box
    part = whole if truth.visible_box is None else np.where(np.isfinite(truth.visible_box), truth.visible_box, whole)
    if usual is not None:
        bias = BoxNoise(**dict(zip(("across", "foot", "top", "width"), ((float(e), 0.0) for e in usual), strict=True)))
        whole, part = (perturb_boxes(b, np.ones(len(b)), bias, np.zeros((len(b), 4))) for b in (whole, part))
    rows, columns = [np.zeros(0, np.int64)], [np.zeros(0, np.int64)]
    for index in range(1, truth.length + 1):
        r = truth.rows(index)
        low, high = np.searchsorted(frame, (index, index + 1))
        if r.stop > r.start and high > low:
            cost = 1.0 - np.maximum(overlaps(whole[r], box[low:high]), overlaps(part[r], box[low:high]))
            i, j = optimal(cost, 1.0 - GATE)
            rows.append(i + r.start)
            columns.append(j + low)
    return np.concatenate(rows), np.concatenate(columns)


def overlaps(a: Array, b: Array) -> Array:
    """(N, M) intersection over union of boxes (N, 4), (M, 4) ltwh; 0 where a box is unknown."""
    inner = intersections(a, b)
    area = (a[:, 2] * a[:, 3])[:, None] + (b[:, 2] * b[:, 3])[None]
    return np.nan_to_num(inner / (area - inner))


def intersections(a: Array, b: Array) -> Array:
    """(N, M) areas that boxes (N, 4), (M, 4) ltwh have in common, px²."""
    low = np.maximum(a[:, None, :2], b[None, :, :2])
    high = np.minimum(a[:, None, :2] + a[:, None, 2:], b[None, :, :2] + b[None, :, 2:])
    return np.asarray(np.prod(np.clip(high - low, 0.0, None), axis=2))


def _covered(frame: Ints, box: Array, out_frame: Ints, out_box: Array) -> Bools:
    """Which detections lie on a box that does not count."""
    covered = np.zeros(len(box), bool)
    for index in np.unique(out_frame):
        here, there = np.flatnonzero(frame == index), out_frame == index
        if len(here):
            covered[here] = (overlaps(box[here], out_box[there]) >= IGNORED).any(axis=1)
    return covered


def _left_out(sequence: Sequence) -> tuple[Ints, Array] | None:
    """Frames and boxes of gt.txt that MOTChallenge's own scoring leaves out."""
    path = Path(str(sequence.source.get("path", ""))) / "gt" / "gt.txt"
    if sequence.source.get("kind") != "mot" or not path.is_file():
        return None
    table = mot_text.read_table(path)
    if not table.rest.shape[1]:
        return None
    out = (table.id >= 0) & (table.rest[:, 0] == 0)
    if table.rest.shape[1] in (2, 3):
        out |= np.isin(table.rest[:, 1], DISTRACTORS)
    return table.frame[out], table.box[out]
