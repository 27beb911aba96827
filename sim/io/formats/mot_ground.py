"""Decides whether columns 8 to 10 of a MOTChallenge text are ground positions in m: people in them must move as people.

Other programs write categories, occlusion flags, zeros or pixels there.
"""

from __future__ import annotations

import warnings

import numpy as np

from scenarios.errors import InputError
from scenarios.reading import is_present
from sim.io.formats.mot_table import GROUND_COLUMNS, MotTable
from sim.types import Array, Bools, Ints

# step in m from one frame to the next that nobody makes. The frame rate may be wrong, so speeds decide nothing.
LONGEST = 12.0

ENOUGH = 10  # rows or steps that are needed to judge by how many of them something is true

# share of rows at the position of another row of their frame, above which these are no positions of people
SHARED = 0.1

MOVED = 0.5  # A box that moves by more than this share of its height belongs to somebody who does not stand

# files beside a text, or in the folder above it, that vouch for positions in m
VOUCHERS = ("manifest.json", "camera.json", "run.json")


FAST = 12.0  # m/s that nobody keeps up. Half of the steps above it are centimetres, or a wrong frame rate.


def ground_positions(table: MotTable) -> Array | None:
    """Returns the ground positions x, y, z in m, (N, 3), nan where unknown (z = -1); None if there are none.

    Warns, and returns None, if people cannot move so and no file beside the text vouches for metres.
    """
    known, doubt = _known(table)
    if doubt:
        text = f"{table.rows.file}: columns 8 to 10 are not taken as metres: {doubt}; the boxes are used"
        warnings.warn(text, stacklevel=3)
    return None if known is None else np.where(known[:, None], table.rest[:, 1:4], np.nan)


def has_ground(table: MotTable) -> bool:
    """Returns True if `ground_positions` gives positions, without its warning."""
    return _known(table)[0] is not None


def _known(table: MotTable) -> tuple[Bools | None, str]:
    if table.rest.shape[1] < 4:
        return None, ""
    xyz, known = table.rest[:, 1:4], np.asarray(table.rest[:, 3] != -1)
    if not known.any():
        return None, ""
    if table.rows.values.shape[1] != GROUND_COLUMNS and not _vouched(table):
        alone = len(known) == len(np.unique(table.frame))
        same = len(known) > 1 and bool((xyz == xyz[0]).all())
        # All rows equal: a category, or a value that stands for "unknown".
        if same and (not alone or bool((xyz == np.round(xyz)).all())):
            return None, ""
        doubt = _doubt(table, known)
        if doubt:
            return None, doubt
    return known, ""


def require_metres(table: MotTable, fps: float) -> None:
    """Raises InputError if a text of positions alone cannot be in metres: it has no boxes to use instead."""
    if table.rows.values.shape[1] != GROUND_COLUMNS or _vouched(table):
        return
    first, second = _steps(table.frame, table.id)
    speed = _pace(table.rest[:, 1:3], table.frame, first, second) * fps
    if len(speed) >= ENOUGH and np.median(speed) > FAST:
        raise InputError(
            file=table.rows.file, place="columns x, y", got=f"half of the steps faster than {np.median(speed):.3g} m/s",
            expected="positions in m", remedy="if they are in cm or mm, name them x_cm,y_cm or x_mm,y_mm in the first "
            f"line, as frame,id,x_cm,y_cm; pixels need boxes; else correct --fps, here {fps:g}",
        )  # fmt: skip


def _vouched(table: MotTable) -> bool:
    file = table.rows.file
    return any(is_present(folder / name) for folder in (file.parent, file.parent.parent) for name in VOUCHERS)


def _doubt(table: MotTable, known: Bools) -> str:
    rows = np.flatnonzero(known)
    xy, frame, id = table.rest[rows, 1:3], table.frame[rows], table.id[rows]
    places, count = np.unique(np.c_[frame, xy], axis=0, return_counts=True)
    if count[count > 1].sum() > SHARED * len(rows):
        return "people of one frame have the same position"
    if len(rows) > 3 and (xy == np.round(xy)).all() and 2 * len(np.unique(xy, axis=0)) <= len(places):
        return "they hold few whole numbers, as categories or flags do"
    inside = ((xy >= table.box[rows, :2]) & (xy <= table.box[rows, :2] + table.box[rows, 2:])).all(axis=1)
    if len(rows) >= ENOUGH and inside.mean() > 0.5:
        return "most lie inside their own boxes, as pixels do"
    first, second = _steps(frame, id)
    if not len(first):
        return ""
    if _stand_while_boxes_move(table.box[rows], id, first, second, np.hypot(*(xy[second] - xy[first]).T)):
        return "they stay the same while the boxes move"
    pace = _pace(xy, frame, first, second)
    if len(pace) >= ENOUGH and np.quantile(pace, 0.75) > LONGEST:
        return f"a quarter of the steps are longer than {LONGEST:g} m per frame"
    return ""


def _steps(frame: Ints, id: Ints) -> tuple[Ints, Ints]:
    order = np.lexsort((frame, id))
    order = order[id[order] >= 0]
    pairs = np.flatnonzero(np.diff(id[order]) == 0)
    return order[pairs], order[pairs + 1]


def _pace(xy: Array, frame: Ints, first: Ints, second: Ints) -> Array:
    return np.asarray(np.hypot(*(xy[second] - xy[first]).T) / np.maximum(frame[second] - frame[first], 1))


def _stand_while_boxes_move(box: Array, id: Ints, first: Ints, second: Ints, step: Array) -> bool:
    people, who = np.unique(id[first], return_inverse=True)
    centre = box[:, :2] + box[:, 2:] / 2
    way = np.bincount(who, np.hypot(*(centre[second] - centre[first]).T))
    height = np.bincount(who, box[first, 3]) / np.bincount(who)
    moves = way > MOVED * height
    stands = np.bincount(who, step > 0, minlength=len(people)) == 0
    return bool(moves.any() and (moves & stands).sum() > moves.sum() / 2)
