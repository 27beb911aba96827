"""Strict reader for MOTChallenge text: gt.txt and det.txt.

Lines have 6 to 10 columns, the first of which are frame (from 1), id, and the box's left, top, width, height in px.
Column 7 is a confidence or flag. 8 or 9 columns go on with class and visibility (from MOT16 on), 10 columns with the
ground position x, y, z in m, unknown where z is -1 (MOT15). Lines of 4 columns are no MOTChallenge text: they are
frame, id and the ground position x, y in m. A wrong line raises InputError that names it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from scenarios.limits import COORDINATE, DETECTIONS, FRAMES
from sim.arrays import repeated_ids
from sim.io.files.numeric_text import NumericTable, crowded, read_numbers
from sim.io.formats.velocity import differentiate
from sim.scene.box_scale import scale_of_all_boxes
from sim.types import Array, Bools, Detections, Ints, Plane, Truth

PEDESTRIAN = 1

GROUND_COLUMNS = 4
"""Columns of a text of ground positions alone: frame, id, x, y."""


@dataclass(frozen=True)
class MotTable:
    """A MOTChallenge text file, N rows in the order of the file.

    rows: the numbers as read, with their lines for errors. frame (N,): from 1. id (N,): of the person or track, usually
    -1 for detections. box (N, 4): left, top, width, height in px, all -1 for no box. rest (N, 0 to 4): the columns
    after the box: confidence or flag; then class and visibility, or x, y, z in m.
    """

    rows: NumericTable
    frame: Ints
    id: Ints
    box: Array
    rest: Array

    def without_box(self) -> Bools:
        """Return flags (N,), True for rows whose box is -1,-1,-1,-1, which means that the row has no box. Raises
        nothing."""
        return np.asarray((self.box == -1).all(axis=1))

    def ground(self) -> Array | None:
        """Return the ground positions x, y, z in m, (N, 3), nan where unknown (z = -1).

        Returns None if the file has fewer than 10 columns, or if the position is unknown in all rows. That is the case
        if z = -1 in all, or if all have the same position though a frame has several rows: zeros stand for unknown.
        """
        if self.rest.shape[1] < 4:
            return None
        known = self.rest[:, 3] != -1
        if len(known) > len(np.unique(self.frame)) and (self.rest[:, 1:4] == self.rest[0, 1:4]).all():
            return None
        return np.where(known[:, None], self.rest[:, 1:4], np.nan) if known.any() else None


def read_table(path: Path, *, length: int | None = None, boxless: bool = False) -> MotTable:
    """Read the MOTChallenge text file `path` of 6 to 10 columns: frame, id, left, top, width, height, and up to four
    more; or of 4 columns: frame, id, x, y in m, which are read as rows without box, of confidence 1 and z = 0.

    length: the last frame allowed; None: 1,000,000. boxless: True allows -1,-1,-1,-1 for "no box". A file without
    lines gives a table without rows. Rows stay in the order of the file. Raises InputError if the file is unreadable,
    and, with the line, if a cell is no finite number, the number of columns is wrong, a frame is outside 1 to `length`,
    a frame or id is no integer, a number is beyond 1e6, a frame has more than 5000 lines, or a box has no area.
    """
    rows = read_numbers(path, (6, 10), also=GROUND_COLUMNS)
    frame, id, count = rows.integers(0, "frame"), rows.integers(1, "id"), len(rows.line)
    box, rest = rows.values[:, 2:6], rows.values[:, 6:]
    if rows.values.shape[1] == GROUND_COLUMNS:
        box, rest = np.full((count, 4), -1.0), np.c_[np.ones(count), rows.values[:, 2:], np.zeros(count)]
    table = MotTable(rows, frame, id, box, rest)
    last = FRAMES if length is None else length
    rows.reject((frame < 1) | (frame > last), f"frames from 1 to {last}", "correct the frame, or seqLength")
    rows.reject(crowded(frame), f"at most {DETECTIONS} lines of one frame", "check that this is the right file")
    far = (np.abs(rows.values[:, 2:]) > COORDINATE).any(axis=1)
    rows.reject(far, f"numbers within {COORDINATE:g}", "remove or correct the line")
    flat = (table.box[:, 2:] <= 0).any(axis=1)
    if boxless:
        flat &= ~table.without_box()
    rows.reject(flat, "boxes with width and height above 0", "remove or correct the line")
    return table


def reject_duplicate_ids(table: MotTable, keep: Bools) -> None:
    """Raise InputError, with the line, if an id stands twice in a frame; do nothing otherwise.

    keep (N,): True for the rows of the table that count. Negative ids are not checked.
    """
    counted = np.flatnonzero(keep & (table.id >= 0))
    again = np.zeros(len(table.frame), bool)
    again[counted] = repeated_ids(table.frame[counted], table.id[counted])
    table.rows.reject(again, "each id once in a frame", "remove one of the two lines")


@dataclass(frozen=True)
class DetectionTable:
    """The content of a det.txt, N rows sorted by frame, those of a frame in the order of the file.

    frame (N,): from 1. id (N,): as in the file, usually -1. plane: "ground" (pos in m) or "image" (pos in px). pos (N,
    2): x, y on the ground, or the box's centre. box (N, 4): left, top, width, height in px, None if any row has none.
    score (N,): in [0, 1].
    """

    frame: Ints
    id: Ints
    plane: Plane
    pos: Array
    box: Array | None
    score: Array

    def at(self, index: int, fps: float) -> Detections:
        """Return the detections of frame `index` (from 1), none if the file has no row of it; their time is (index - 1)
        / fps s.
        """
        low, high = np.searchsorted(self.frame, (index, index + 1))
        box = None if self.box is None else self.box[low:high]
        return Detections(index, (index - 1) / fps, self.plane, self.pos[low:high], None, box, self.score[low:high])


def read_detections(path: Path, length: int | None) -> DetectionTable:
    """Read a det.txt: points on the ground (m) if every row has one, else the centres of the boxes in the image (px).

    path: the file. length: the last frame allowed; None: 1,000,000. The boxes are None if any row lacks one. Scores are
    1 if the file has none; if one is outside [0, 1], all are scaled so that the lowest is 0 and the highest 1 (all 1 if
    equal). A file without lines gives no rows.

    Raises InputError as read_table, and for a row without box (-1,-1,-1,-1) if any row lacks a ground point.
    """
    table = read_table(path, length=length, boxless=True)
    ground, boxless = table.ground(), _reject_placeless(table)
    score = unit_scores(table.rest[:, 0] if table.rest.shape[1] else np.ones(len(table.frame)))
    plane: Plane = "image" if ground is None or np.isnan(ground).any() else "ground"
    pos = ground[:, :2] if plane == "ground" and ground is not None else table.box[:, :2] + table.box[:, 2:] / 2
    order = np.argsort(table.frame, kind="stable")
    box = None if boxless.any() else table.box[order]
    return DetectionTable(table.frame[order], table.id[order], plane, pos[order], box, score[order])


def _reject_placeless(table: MotTable) -> Bools:
    """Return flags (N,), True for rows without box. Raise InputError for the first of them if any row lacks a ground
    position."""
    ground, boxless = table.ground(), table.without_box()
    if ground is None or np.isnan(ground).any():
        table.rows.reject(boxless, "a box, or x, y, z in every line", "give each line a box or a ground position")
    return boxless


def ground_cells(xyz: Sequence[float]) -> str:
    """Return the last three cells "x,y,z" of a MOT line, in m with 3 decimals, for a position xyz of 3 finite numbers.

    z = -1 would mean unknown, so a z that rounds to -1.000 is written -1.001.
    """
    x, y, z = (f"{v:.3f}" for v in xyz)
    return f"{x},{y},{z if z != '-1.000' else '-1.001'}"


def unit_scores(score: Array) -> Array:
    """Return the scores (N,), finite, brought into [0, 1].

    `score` itself is returned if all its values lie in [0, 1] or there are none. Otherwise the lowest becomes 0, the
    highest 1, and the others are scaled linearly; if all are equal they become 1.
    """
    if len(score) == 0 or (score.min() >= 0 and score.max() <= 1):
        return score
    span = score.max() - score.min()
    return (score - score.min()) / span if span > 0 else np.ones_like(score)


def read_truth(path: Path, name: str, fps: float, length: int | None = None, px_per_m: float = float("nan")) -> Truth:
    """Read a gt.txt as truth of people, without group labels: everybody is alone (-1), and no frame counts as labelled.

    Rows with flag 0 or (in 8 or 9 columns) a class other than 1 are left out, as in MOTChallenge's own scoring; so are
    negative ids. They must be valid all the same. The rest is sorted by (frame, id). name, fps (frames/s): of the
    sequence. length: number of frames; None: up to the last frame kept. px_per_m: image scale; nan: the median height
    of the boxes / 1.7 m, nan without boxes. Boxes are None if a row has none (-1,-1,-1,-1). Positions and velocities
    are None without ground positions, nan in rows where they are unknown; velocities are differences over 0.5 s.
    Visibility is 1 where the file has none or -1.

    Raises InputError as read_table (unreadable file, invalid line, frame beyond `length`), for a row without box if any
    row lacks a ground position, for an id twice in a frame, and for a visibility outside [0, 1] other than -1.
    """
    table = read_table(path, length=length, boxless=True)
    boxed = not _reject_placeless(table).any()
    keep = table.id >= 0
    nine = table.rest.shape[1] in (2, 3)
    if table.rest.shape[1]:
        keep &= table.rest[:, 0] != 0
    if nine:
        keep &= table.rest[:, 1] == PEDESTRIAN
    reject_duplicate_ids(table, keep)
    order = np.flatnonzero(keep)
    order = order[np.lexsort((table.id[order], table.frame[order]))]
    frame, id, box = table.frame[order], table.id[order], table.box[order]
    visibility = np.ones(len(order))
    if table.rest.shape[1] == 3:
        v = table.rest[:, 2]
        table.rows.reject((v > 1) | ((v < 0) & (v != -1)), "visibility from 0 to 1, or -1", "correct the last column")
        visibility = np.where(v[order] < 0, 1.0, v[order])
    ground = table.ground()
    place = None if ground is None else ground[order]
    if not np.isfinite(px_per_m) and boxed:
        px_per_m = scale_of_all_boxes(box[:, 3])
    frames = length if length is not None else int(frame.max(initial=0))
    return Truth(
        name=name, fps=fps, length=frames, px_per_m=px_per_m, frame=frame, id=id,
        group=np.full(len(order), -1, np.int64),
        pos=None if place is None else place[:, :2],
        vel=None if place is None else differentiate(frame, id, place[:, :2], fps),
        box=box if boxed else None, visibility=visibility,
        z=None if place is None else place[:, 2],
        labelled=np.zeros(frames, bool),
    )  # fmt: skip
