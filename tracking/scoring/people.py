"""The people of the truth and of a tracker in the scored frames, as rows of arrays, and how similar two of them are.

`true_people` and `tracked_people` build the rows of one side. `ComparedSides` holds both sides, `people_pairs` compares
them: by IoU of boxes, or by distance of positions on the ground or in the image.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from sim.types import Array, Bools, Ints, Tracks, Truth
from tracking.scoring.rows import FrameRows
from tracking.scoring.similarity import REACH, Pairs, box_pairs, point_pairs

Surface = Literal["ground", "image"]  # Where groups are compared: on the ground in m, or in the image in px.
# How two people are compared: IoU of boxes, or distance of positions on the ground or in the image.
Similarity = Literal["boxes", "ground", "image"]


class IncomparableError(ValueError):
    """Raised if the truth or the tracks have people but lack the boxes or positions that are to be compared."""


@dataclass(frozen=True, slots=True, eq=False)
class PersonRows:
    """R rows, one per person and frame, sorted by frame."""

    rows: FrameRows  # frame number and id of each row
    group: Ints  # (R,): group id, -1 alone
    # pos (R, 2), vel (R, 2): x, y of position and velocity in the plane of this side's data, m and m/s or px and px/s.
    # nan unknown.
    pos: Array | None
    vel: Array | None
    box: Array | None  # (R, 4): left, top, width, height in px.

    def keep(self, mask: Bools | slice) -> PersonRows:
        """Returns the rows that a bool mask (R,) or a slice selects, with all their columns."""
        pos, vel, box = (None if a is None else a[mask] for a in (self.pos, self.vel, self.box))
        return PersonRows(self.rows.keep(mask), self.group[mask], pos, vel, box)

    def positions_on(self, surface: Surface, plane: str) -> Array | None:
        """Returns the positions (R, 2) on a surface, in m on the "ground" or px in the "image"; None if unknown there.
        plane: the plane of `pos`. In the image the centre of the box is preferred to `pos`."""
        if surface == "image" and self.box is not None:
            return self.box[:, :2] + self.box[:, 2:] / 2
        own = "image" if plane == "image" else "ground"
        return self.pos if own == surface else None


def true_people(truth: Truth, frames: Bools) -> PersonRows:
    """Returns the truth's people in the frames f where frames[f] is true, sorted by frame."""
    every = PersonRows(FrameRows(truth.frame, truth.id), truth.group, truth.pos, truth.vel, truth.box)
    return every.keep(frames[truth.frame])


def tracked_people(tracks: Sequence[Tracks]) -> PersonRows:
    """Returns one tracker's people as rows; `tracks` are sorted by frame. `box` of the result is None if in any frame
    with people the boxes are missing."""
    count = [len(t.id) for t in tracks]
    frame = np.repeat(np.array([t.index for t in tracks], np.int64), count)
    none = np.zeros(0, np.int64)
    id, group = (np.concatenate([none, *(getattr(t, name) for t in tracks)]) for name in ("id", "group"))
    pos, vel = (
        np.concatenate([np.zeros((0, 2)), *(getattr(t, name)[:, :2] for t in tracks)]) for name in ("pos", "vel")
    )
    boxes = [t.box for t in tracks if len(t.id)]
    boxed = [b for b in boxes if b is not None]
    box = np.concatenate([np.zeros((0, 4)), *boxed]) if len(boxed) == len(boxes) else None
    return PersonRows(FrameRows(frame, id), group, pos, vel, box)


@dataclass(frozen=True, eq=False)
class ComparedSides:
    """The truth's and one tracker's data in the scored frames."""

    truth: Truth  # all of it
    # one `Tracks` per scored frame, labelled or not (an event may be reported in an unlabelled one), sorted by frame
    tracks: Sequence[Tracks]
    inside: Bools  # (length + 1,): bool by frame number: scored
    frames: Bools  # (length + 1,): scored, and with labelled groups
    # true, est: the R true and S tracked people in the scored frames
    true: PersonRows
    est: PersonRows
    mapping: Ints  # (S,): row of `true` that each row of `est` is mapped to, -1 none
    plane: str  # of the tracks' positions: "ground", "space" or "image"
    left_out: int = 0  # number of tracked people that the labels leave out of `est`

    @property
    def surface(self) -> Surface:
        """Where groups are compared: "image" if the tracks are in the image, else "ground"."""
        return "image" if self.plane == "image" else "ground"

    @property
    def scale(self) -> float:
        """Units of the surface per metre: the truth's px_per_m in the image (nan if unknown), 1 on the ground."""
        return self.truth.px_per_m if self.surface == "image" else 1.0

    @property
    def groups_only(self) -> bool:
        """True if the tracker follows groups as wholes (`Tracks.unit` is "group") in some scored frame."""
        return any(t.unit == "group" for t in self.tracks)


def people_pairs(sides: ComparedSides, similarity: Similarity) -> Pairs:
    """Returns the candidate pairs of a true and a tracked person of one frame, with their similarity. Raises
    IncomparableError if the boxes, positions or image scale that the similarity needs are missing."""
    true, est = sides.true, sides.est
    if similarity == "boxes":
        if true.box is None or est.box is None:
            raise IncomparableError("no boxes to compare: score on the ground")
        return box_pairs(true.rows, est.rows, true.box, est.box)
    scale = sides.truth.px_per_m if similarity == "image" else 1.0
    if not 0 < scale < np.inf:
        if len(true.rows) and len(est.rows):
            raise IncomparableError(f"no image scale to compare positions by, px_per_m is {scale:g}: state it")
        scale = 1.0
    true_pos, est_pos = _positions(true, similarity, "ground"), _positions(est, similarity, sides.plane)
    return point_pairs(true.rows, est.rows, true_pos, est_pos, REACH * scale)


def _positions(people: PersonRows, surface: Surface, plane: str) -> Array:
    positions = people.positions_on(surface, plane)
    if positions is None and len(people.rows):
        where = "on the ground" if surface == "ground" else "in the image"
        raise IncomparableError(f"no positions {where} to compare: choose another similarity")
    return np.zeros((0, 2)) if positions is None else positions
