"""The rows of a MOTChallenge text, read strictly. A wrong line raises InputError that names it.

Lines have 6 to 10 columns, the first of which are frame (from 1), id, and the box's left, top, width, height in px.
Lines of 4 columns are frame, id and the ground position x, y in m.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from scenarios.limits import COORDINATE, DETECTIONS, FRAMES
from sim.io.files.numeric_text import NumericTable, crowded, read_numbers
from sim.io.formats.box_columns import BoxScale, reject_missing_ids
from sim.io.formats.named_columns import column_names, read_named
from sim.types import Array, Bools, Ints

GROUND_COLUMNS = 4  # columns of a text of ground positions alone: frame, id, x, y

# what the columns of a text without names must be, and what to do
LAYOUT = "frame,id,left,top,width,height,… or frame,id,x,y: name the columns in the first line, if they are others"


@dataclass(frozen=True)
class MotTable:
    """A MOTChallenge text file, N rows in the order of the file."""

    rows: NumericTable  # the numbers as read, with their lines for errors
    frame: Ints  # (N,) from 1
    id: Ints  # (N,) of the person or track, usually -1 for detections
    box: Array  # (N, 4) left, top, width, height in px, all -1 for no box
    rest: Array  # (N, 0 to 4) the columns after the box: confidence or flag; then class and visibility, or x, y, z in m

    def boxes(self) -> Array:
        """Returns the boxes of the rows that have one, (B, 4)."""
        return self.box[~self.without_box()]

    def without_box(self) -> Bools:
        """Returns flags (N,): True for rows whose box is -1,-1,-1,-1."""
        return np.asarray((self.box == -1).all(axis=1))


def read_table(
    path: Path, *, length: int | None = None, boxless: bool = False, box_scale: BoxScale | None = None
) -> MotTable:
    """Reads a MOTChallenge text of 6 to 10 columns, or of 4: frame, id, x, y in m.

    length: the last frame allowed. boxless: True allows -1,-1,-1,-1 for "no box". box_scale: factors that make the
    boxes pixels. Rows stay in the order of the file.
    """
    named = column_names(path)
    rows = read_numbers(path, (6, 10), also=GROUND_COLUMNS, layout=LAYOUT) if named is None else read_named(path, named)
    frame, id, count = rows.integers(0, "frame"), rows.integers(1, "id"), len(rows.line)
    box, rest = rows.values[:, 2:6], rows.values[:, 6:]
    if rows.values.shape[1] == GROUND_COLUMNS:
        # A text of positions: no box, confidence 1, z = 0.
        box, rest = np.full((count, 4), -1.0), np.c_[np.ones(count), rows.values[:, 2:], np.zeros(count)]
    table = MotTable(rows, frame, id, box, rest)
    last = FRAMES if length is None else length
    rows.reject(frame == 0, f"frames from 1 to {last}", "add 1 to all frames, if the file counts them from 0")
    remedy = "check that this text belongs to this recording, and its seqLength"
    rows.reject((frame < 1) | (frame > last), f"frames from 1 to {last}", "correct the frame, or seqLength", remedy)
    rows.reject(crowded(frame), f"at most {DETECTIONS} lines of one frame", "check that this is the right file")
    far = (np.abs(rows.values[:, 2:]) > COORDINATE).any(axis=1)
    rows.reject(far, f"numbers within {COORDINATE:g}", "remove or correct the line")
    if named is None:
        reject_missing_ids(rows, frame, id)
    flat, boxed = (table.box[:, 2:] <= 0).any(axis=1), ~table.without_box()
    rows.reject(flat & boxed if boxless else flat, "boxes with width and height above 0", "remove or correct the line")
    if box_scale is not None:
        table = replace(table, box=np.where(boxed[:, None], box * np.tile(box_scale, 2), box))
    return table
