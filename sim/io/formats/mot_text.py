"""Strict reader for MOTChallenge text: gt.txt and det.txt.

Lines have 6 to 10 columns, the first of which are frame (from 1), id, and the box's left, top, width, height in px.
Column 7 is a confidence or flag. 8 or 9 columns go on with class and visibility (from MOT16 on), 10 columns with the
ground position x, y, z in m, unknown where z is -1 (MOT15). Lines of 4 columns are no MOTChallenge text: they are
frame, id and the ground position x, y in m. A wrong line raises InputError that names it.
"""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from sim.arrays import repeated_ids
from sim.io.formats.box_columns import BoxScale, corner_doubt, require_pixels
from sim.io.formats.mot_people import ground_positions, labelled_people, of_class, require_metres, unscored_rows
from sim.io.formats.mot_table import MotTable, read_table
from sim.io.formats.velocity import differentiate
from sim.scene.boxes import scale_of_all_boxes
from sim.types import Array, Bools, Detections, Ints, Plane, Truth

FEW = 0.02  # share of scores outside [0, 1] up to which they count as outliers of scores in [0, 1]


def unit_scores(score: Array) -> tuple[Array, str]:
    """Returns the finite scores (N,) in [0, 1], and how they were mapped, "" if they were not.

    A few outliers are clipped. Other scores s become 1 / (1 + exp(-(s - c) / d)), c the lower quartile and d such that
    the median becomes about 0.75.
    """
    outside = (score < 0) | (score > 1)
    count = int(outside.sum())
    if not count:
        return score, ""
    if (score == score[0]).all():
        return np.ones_like(score), ""
    if count <= max(FEW * len(score), 1):
        return np.clip(score, 0, 1), f"{count} of {len(score)} scores outside 0 to 1 are clipped"
    quarter, median = np.quantile(score, (0.25, 0.5))
    # A det.txt holds what its detector takes for people, so that most boxes must be able to start a track.
    # Rounded, so that a few more scores seldom move them.
    c, d = float(f"{quarter:.2g}"), float(f"{(median - quarter) / np.log(3) or 1.0:.1g}")
    mapped = 1 / (1 + np.exp(-np.clip((score - c) / d, -500, 500)))
    span = f"scores from {score.min():g} to {score.max():g}"
    return mapped, f"{span} are mapped into 0 to 1 by 1 / (1 + exp(-(score - {c:g}) / {d:g}))"


# remedy if most rows have the id of another row of their frame
NO_ID = "check that column 2 is the id: name the columns in the first line, as frame,left,top,width,height,score"


def reject_duplicate_ids(table: MotTable, keep: Bools) -> None:
    """Raises InputError if an id from 0 stands twice in a frame. keep (N,): the rows that count."""
    counted = np.flatnonzero(keep & (table.id >= 0))
    again = np.zeros(len(table.frame), bool)
    again[counted] = repeated_ids(table.frame[counted], table.id[counted])
    table.rows.reject(again, "each id once in a frame", "remove one of the two lines", NO_ID)


@dataclass(frozen=True)
class DetectionTable:
    """The content of a det.txt, N rows sorted by frame, those of a frame in the order of the file."""

    frame: Ints  # (N,) from 1
    id: Ints  # (N,) as in the file, usually -1
    plane: Plane  # "ground" (pos in m) or "image" (pos in px)
    pos: Array  # (N, 2) x, y on the ground, or the box's centre
    box: Array | None  # (N, 4) left, top, width, height in px, None if any row has none
    score: Array  # (N,) in [0, 1]

    def at(self, index: int, fps: float) -> Detections:
        """Returns the detections of frame `index` (from 1) at the time (index - 1) / fps s."""
        low, high = np.searchsorted(self.frame, (index, index + 1))
        box = None if self.box is None else self.box[low:high]
        return Detections(index, (index - 1) / fps, self.plane, self.pos[low:high], None, box, self.score[low:high])


def read_detections(
    path: Path, length: int | None, person_class: int | None = None, box_scale: BoxScale | None = None
) -> DetectionTable:
    """Reads a det.txt: points on the ground (m) if every row has one, else the boxes' centres (px)."""
    table = read_table(path, length=length, boxless=True, box_scale=box_scale)
    _check_boxes(table)
    ground = ground_positions(table)
    boxless = _reject_placeless(table, ground)
    score, told = unit_scores(table.rest[:, 0] if table.rest.shape[1] else np.ones(len(table.frame)))
    if told:
        warnings.warn(f"{path}: {told}", stacklevel=2)
    plane: Plane = "image" if ground is None or np.isnan(ground).any() else "ground"
    pos = ground[:, :2] if plane == "ground" and ground is not None else table.box[:, :2] + table.box[:, 2:] / 2
    order = np.argsort(table.frame, kind="stable")
    order = order[of_class(table, np.ones(len(order), bool), person_class)[order]]
    box = None if boxless.any() else table.box[order]
    return DetectionTable(table.frame[order], table.id[order], plane, pos[order], box, score[order])


def _check_boxes(table: MotTable) -> None:
    require_pixels(table.rows, table.boxes())
    doubt = corner_doubt(table.boxes())
    if doubt:
        warnings.warn(f"{table.rows.file}: {doubt}", stacklevel=3)


def _reject_placeless(table: MotTable, ground: Array | None) -> Bools:
    boxless = table.without_box()
    if ground is None or np.isnan(ground).any():
        table.rows.reject(boxless, "a box, or x, y, z in every line", "give each line a box or a ground position")
    return boxless


def ground_cells(xyz: Sequence[float]) -> str:
    """Returns the last three cells "x,y,z" of a MOT line for a position in m."""
    # z = -1 would mean unknown.
    x, y, z = (f"{v:.3f}" for v in xyz)
    return f"{x},{y},{z if z != '-1.000' else '-1.001'}"


def read_truth(
    path: Path, name: str, fps: float, length: int | None = None, px_per_m: float = float("nan"),
    person_class: int | None = None, box_scale: BoxScale | None = None,
) -> Truth:  # fmt: skip
    """Reads a gt.txt as truth of people without group labels, as MOTChallenge's own scoring counts them.

    length: None: up to the last frame kept. px_per_m: nan: the boxes' median height / 1.7 m. Boxes are None if a row
    has none, positions (nan in rows without) and velocities if no row has one.
    """
    table = read_table(path, length=length, boxless=True, box_scale=box_scale)
    _check_boxes(table)
    require_metres(table, fps)
    ground = ground_positions(table)
    boxed = not _reject_placeless(table, ground).any()
    # Rows that do not count must be valid all the same.
    keep = labelled_people(table, person_class)
    reject_duplicate_ids(table, keep)
    order = np.flatnonzero(keep)
    order = order[np.lexsort((table.id[order], table.frame[order]))]
    frame, id, box = table.frame[order], table.id[order], table.box[order]
    visibility = np.ones(len(order))
    # MOT16 and later: flag, class, visibility.
    if table.rest.shape[1] == 3:
        v = table.rest[:, 2]
        table.rows.reject((v > 1) | ((v < 0) & (v != -1)), "visibility from 0 to 1, or -1", "correct the last column")
        visibility = np.where(v[order] < 0, 1.0, v[order])
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
        labelled=np.zeros(frames, bool), unscored=unscored_rows(table, keep, name, person_class) if boxed else None,
    )  # fmt: skip
