"""Texts whose first line names their columns, read as rows of a MOTChallenge text."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Set
from dataclasses import replace
from pathlib import Path
from typing import NoReturn

import numpy as np

from scenarios.errors import InputError
from sim.io.files.numeric_text import NumericTable, is_number_text, read_numbers, read_text

Column = np.ndarray[tuple[int], np.dtype[np.float64]]

# units that may end the names of positions, as x_cm,y_cm, in m
UNITS = {"m": 1.0, "cm": 0.01, "mm": 0.001, "ft": 0.3048}

# meaning of a column, and the names it may have
NAMES = {
    "frame": ("frame", "frame_id", "frameid", "frame_number", "frame_index"),
    "id": ("id", "track_id", "trackid", "person_id", "ped_id", "target_id"),
    "score": ("score", "conf", "confidence"),
    "class": ("class", "class_id", "cls", "category", "category_id", "object_category"),
    "left": ("left", "bb_left", "xmin", "x1"),
    "top": ("top", "bb_top", "ymin", "y1"),
    "right": ("right", "xmax", "x2"),
    "bottom": ("bottom", "ymax", "y2"),
    "width": ("width", "w", "bb_width"),
    "height": ("height", "h", "bb_height"),
    "cx": ("cx", "xc", "x_center", "center_x"),
    "cy": ("cy", "yc", "y_center", "center_y"),
    "x": ("x", *(f"x_{unit}" for unit in UNITS)),
    "y": ("y", *(f"y_{unit}" for unit in UNITS)),
}

EXPECTED = (
    "frame and a box (x,y,w,h, left,top,width,height, x1,y1,x2,y2 or cx,cy,w,h), or frame,id,x,y in m (x_cm,y_cm in cm)"
)


def column_names(path: Path) -> list[str] | None:
    """Returns the names in the first line of a text, in lower case; None if a cell of it is a number."""
    line = next((line for line in read_text(path).splitlines() if line.strip()), "")
    cells = [cell.strip().strip('"').lower() for cell in line.split("," if "," in line else None)]
    return cells if cells and not line.startswith("#") and not any(map(is_number_text, cells)) and cells[0] else None


def read_named(path: Path, names: list[str]) -> NumericTable:
    """Reads a text with named columns as 8 columns of a MOTChallenge text, or as 4: frame, id, x, y in m."""
    rows = read_numbers(path, (len(names), len(names)), header=True, layout="those that line 1 names")
    found: dict[str, int] = {}
    for k, name in enumerate(names):
        meaning = next((key for key, some in NAMES.items() if name in some), None)
        if meaning in found:
            _refuse(path, names)
        if meaning is not None:
            found[meaning] = k
    if not len(rows.line):
        return replace(rows, values=np.zeros((0, 6)))

    def column(name: str, default: float = -1.0) -> Column:
        return rows.values[:, found[name]] if name in found else np.full(len(rows.line), default)

    have, id = found.keys(), column("id")
    if "frame" not in have:
        _refuse(path, names)
    frame = column("frame")
    if have >= {"id", "x", "y"} and not have & {"width", "height", "left", "cx"}:
        x, y = (column(axis) * UNITS.get(names[found[axis]].partition("_")[2], 1.0) for axis in ("x", "y"))
        columns = [frame, id, x, y]
    else:
        left, top, w, h = _box(column, have) or _refuse(path, names)
        columns = [frame, id, left, top, w, h, column("score", 1.0), column("class")]
    unused = [name for k, name in enumerate(names) if k not in found.values()]
    if unused:
        warnings.warn(f"{path}: line 1: columns that are not used: {', '.join(unused)}", stacklevel=4)
    if frame.min() == 0:
        columns[0] = frame + 1
        warnings.warn(f"{path}: frames are counted from 0; they are read as frames from 1", stacklevel=4)
    return replace(rows, values=np.stack(columns, axis=1))


def _box(column: Callable[[str], Column], have: Set[str]) -> tuple[Column, Column, Column, Column] | None:
    w, h = column("width"), column("height")
    if have >= {"left", "top", "width", "height"}:
        return column("left"), column("top"), w, h
    if have >= {"left", "top", "right", "bottom"}:
        return column("left"), column("top"), column("right") - column("left"), column("bottom") - column("top")
    if have >= {"cx", "cy", "width", "height"}:
        return column("cx") - w / 2, column("cy") - h / 2, w, h
    return (column("x"), column("y"), w, h) if have >= {"x", "y", "width", "height"} else None


def _refuse(path: Path, names: list[str]) -> NoReturn:
    raise InputError(
        file=path, place="line 1", got=f"columns {','.join(names)}", expected=EXPECTED,
        remedy="rename the columns",
    )  # fmt: skip
