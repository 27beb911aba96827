"""Texts whose first line names their columns, read as rows of a MOTChallenge text."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import NoReturn

import numpy as np

from scenarios.errors import InputError
from sim.io.files.numeric_text import NumericTable, is_number_text, read_numbers, read_text

NAMES = {
    "frame": ("frame", "frame_id", "frameid", "frame_number", "frame_index"),
    "id": ("id", "track_id", "trackid", "person_id", "ped_id", "target_id"),
    "score": ("score", "conf", "confidence"),
    "class": ("class", "class_id", "category_id"),
    "left": ("left", "bb_left", "xmin", "x1"),
    "top": ("top", "bb_top", "ymin", "y1"),
    "right": ("right", "xmax", "x2"),
    "bottom": ("bottom", "ymax", "y2"),
    "width": ("width", "w", "bb_width"),
    "height": ("height", "h", "bb_height"),
    "cx": ("cx", "xc", "x_center", "center_x"),
    "cy": ("cy", "yc", "y_center", "center_y"),
    "x": ("x",),
    "y": ("y",),
}
"""Meaning of a column, and the names it may have."""

EXPECTED = "frame and a box (x,y,w,h, left,top,width,height, x1,y1,x2,y2 or cx,cy,w,h), or frame,id,x,y in m"


def column_names(path: Path) -> list[str] | None:
    """Return the names in the first line that is not empty, in lower case; None if no cell of it is a name."""
    line = next((line for line in read_text(path).splitlines() if line.strip()), "")
    cells = [cell.strip().strip('"').lower() for cell in line.split("," if "," in line else None)]
    return cells if cells and not line.startswith("#") and not any(map(is_number_text, cells)) and cells[0] else None


def read_named(path: Path, names: list[str]) -> NumericTable:
    """Read a text with named columns as rows of 8 columns of a MOTChallenge text, or of 4: frame, id, x, y in m.

    Ids are -1 if no column is an id. Scores are 1 and classes -1 if the text has none. Columns of other names are not
    used. Raises InputError if names are missing or double, and as `read_numbers`.
    """
    rows = read_numbers(path, (len(names), len(names)), header=True)
    found: dict[str, int] = {}
    for k, name in enumerate(names):
        meaning = next((key for key, some in NAMES.items() if name in some), None)
        if meaning in found:
            _refuse(path, names)
        if meaning is not None:
            found[meaning] = k
    if not len(rows.line):
        return replace(rows, values=np.zeros((0, 6)))

    def column(name: str, default: float = -1.0) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
        return rows.values[:, found[name]] if name in found else np.full(len(rows.line), default)

    have, frame, id = found.keys(), column("frame"), column("id")
    if have >= {"frame", "id", "x", "y"} and not have & {"width", "height", "left", "cx"}:
        return replace(rows, values=np.stack([frame, id, column("x"), column("y")], axis=1))
    w, h = column("width"), column("height")
    if have >= {"frame", "left", "top", "width", "height"}:
        left, top = column("left"), column("top")
    elif have >= {"frame", "left", "top", "right", "bottom"}:
        left, top = column("left"), column("top")
        w, h = column("right") - left, column("bottom") - top
    elif have >= {"frame", "cx", "cy", "width", "height"}:
        left, top = column("cx") - w / 2, column("cy") - h / 2
    elif have >= {"frame", "x", "y", "width", "height"}:
        left, top = column("x"), column("y")
    else:
        _refuse(path, names)
    return replace(rows, values=np.stack([frame, id, left, top, w, h, column("score", 1.0), column("class")], axis=1))


def _refuse(path: Path, names: list[str]) -> NoReturn:
    raise InputError(
        file=path, place="line 1", got=f"columns {','.join(names)}", expected=EXPECTED,
        remedy="rename the columns",
    )  # fmt: skip
