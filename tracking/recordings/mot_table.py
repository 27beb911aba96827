"""The rows of a MOTChallenge text, read strictly. A wrong line raises InputError that names it.

Lines have 6 to 10 columns, the first of which are frame (from 1), id, and the box's left, top, width, height in px.
Lines of 4 columns are frame, id and the ground position x, y in m. If the first line names the columns, they may have
another order.

Whether columns 3 to 6 of a text without names can be left, top, width and height in pixels.

Other programs write corners, shares of the picture, or leave the ids out, so that every column means the one before.
"""

from __future__ import annotations

import re
import warnings
from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import compress
from pathlib import Path
from typing import NoReturn

import numpy as np

from scenarios.errors import InputError, reject
from sim.arrays import repeated_ids
from sim.store.numeric_text import CORRECT, NAME_THEM, NumericTable, TextRows, is_number_text, read_rows
from sim.types import LENGTH_UNITS, Array, Bools, Ints
from tracking.recordings.options import BoxScale
from tracking.recordings.worded_cells import TIME_UNITS, in_seconds, instants, numbered

ENOUGH = 10  # rows that are needed to judge by how their columns vary

LOWEST = 3.0  # px: most boxes of people are higher, unless they are shares of the picture or metres

SWAPPED = 1 / 3  # People whose steps are shorter than this part of those read have ids in the column of frames
LEAST = 1e-6  # px or m: changes of steps below it are rounding

PERSON = (1.2, 6.0)  # height of a person's box divided by its width

STAY = 0.5  # least share of rows whose id is in the frame before or after, too, among tracks

SMOOTH = 0.3  # Corners: the difference of x2 and x1 varies by less than this part of what x2 does

BEYOND = 0.2  # share of boxes beyond the picture, above which they are those of larger pictures

MANY, PART = 100, 0.7  # so many boxes reach further than this part of both sides of the picture

NO_ID = "frame,left,top,width,height,score"


def reject_missing_ids(rows: NumericTable) -> None:
    """Raises InputError if column 2 is no id but the left edge of a box, and the ids are missing."""
    values = rows.values
    frame, id = values[:, 0], values[:, 1]
    if not len(values) or values.shape[1] < 6 or (id == -1).all():
        return
    # Column 6 then holds scores: at most 1, which is no height. Scores up to 100 show in other ways: the six columns
    # make boxes of people one column earlier only, and the ids do not last.
    score = (values[:, 5] >= 0) & (values[:, 5] <= 1) & (values[:, 4] > 1) & (values[:, 3] > 1)
    earlier = values.shape[1] == 6 and _aspect(values[:, 1:5]) and not _aspect(values[:, 2:6]) and not _lasts(frame, id)
    missing = score.all() or (len(values) >= ENOUGH and earlier)
    got = f"in {len(values)} lines what looks like {NO_ID} without an id"
    remedy = f"write {NO_ID} as the first line, if they are these, or -1 as the id"
    reject(missing, rows.file, got, "frame,id,left,top,width,height,…", remedy, "columns")


def _aspect(box: Array) -> bool:
    low, high = PERSON
    return bool(low <= np.median(box[:, 3] / np.maximum(box[:, 2], 1e-9)) <= high)


def _lasts(frame: Array, id: Array) -> bool:
    if len(np.unique(frame)) < 2 or (np.diff(id) > 0).all():
        return True
    number = np.unique(frame, return_inverse=True)[1]
    order = np.lexsort((number, id))
    follows = (np.diff(id[order]) == 0) & (np.diff(number[order]) == 1)
    near = np.append(follows, False) | np.append(False, follows)
    return bool(near.mean() >= STAY)


def reject_swapped(rows: NumericTable) -> None:
    """Raises InputError if rows frame, id, x, y, … seem to begin with the id: people would then make shorter steps.

    The steps must change less, too: at a low rate people walk further in a frame than they are apart.
    """
    known = rows.values[rows.values[:, 1] >= 0]
    as_read, swapped = (_usual_steps(known[:, [*columns, 2, 3]]) for columns in ((1, 0), (0, 1)))
    got = f"steps of {as_read[0]:.3g}, but of {swapped[0]:.3g} if frame and id change places"
    remedy = "exchange columns 1 and 2, or name the columns in the first line"
    reject((swapped + LEAST < SWAPPED * as_read).all(), rows.file, got, "the frame first", remedy, "columns")


def _usual_steps(rows: Array) -> Array:
    """Returns the median step from row to row of one id, and the median change of it, (2,), in rows id, frame, x, y;
    nan for few steps."""
    rows = rows[np.lexsort(rows[:, 1::-1].T)]
    every = [np.hypot(*np.diff(rows[:, 2:], n, axis=0).T)[rows[n:, 0] == rows[:-n, 0]] for n in (1, 2)]
    return np.array([np.median(found) if len(found) >= ENOUGH else np.nan for found in every])


def require_pixels(rows: NumericTable, box: Array) -> None:
    """Raises InputError if most boxes (B, 4) are too low for people in pixels: shares of the picture, or metres."""
    if len(box) and np.median(box[:, 3]) <= LOWEST:
        raise InputError(
            file=rows.file, place="boxes", got=f"heights of {np.median(box[:, 3]):.3g}", expected="pixels",
            remedy="if they are shares of the picture, add --box-scale WIDTH,HEIGHT, its size in px (not for labels); "
            "if x, y are centres, as YOLO's, name the columns frame,id,cx,cy,w,h,… in the first line; if they are "
            "metres, leave the size out: frame,id,x,y",
        )  # fmt: skip


def corner_doubt(box: Array) -> str:
    """Returns a warning if boxes (B, 4), read as left, top, width, height, seem to be corners x1,y1,x2,y2; else ""."""
    x1, y1, x2, y2 = box.T
    # A width that varies along with the left edge is a right edge.
    if len(box) < ENOUGH or not ((x2 > x1) & (y2 > y1)).all() or not np.std(x2 - x1) < SMOOTH * np.std(x2):
        return ""
    return (
        f"all {len(box)} boxes look like x1,y1,x2,y2, but are read as left,top,width,height; "
        "if they are corners, name the columns in the first line: frame,id,x1,y1,x2,y2,…"
    )


def size_doubt(box: Array, size: tuple[int, int]) -> str:
    """Returns a warning if boxes (B, 4) px seem not to belong to pictures of this size (width, height); else ""."""
    if not len(box):
        return ""
    beyond = (box[:, :2] >= size).any(axis=1).mean()
    right, bottom = (box[:, :2] + box[:, 2:]).max(axis=0)
    words = f"pictures of {size[0]} × {size[1]}; if the boxes are those of pictures of another size, add --box-scale"
    if beyond > BEYOND:
        return f"{beyond:.0%} of the boxes lie beyond the {words}"
    if len(box) >= MANY and right <= PART * size[0] and bottom <= PART * size[1]:
        return f"all {len(box)} boxes lie in the upper left {right:.0f} × {bottom:.0f} px of the {words}"
    return ""


Column = np.ndarray[tuple[int], np.dtype[np.float64]]

# meaning of a column, and the names it may have
NAMES = {
    "frame": ("frame", "frame_id", "frameid", "frame_number", "frame_num", "fr", "frame_index", "frame_idx"),
    "time": tuple(
        name + unit for name in ("t", "time", "timestamp", "datetime", "timestep_time")
        for unit in ("", *(f"_{unit}" for unit in TIME_UNITS))
    ),
    "id": ("id", "track_id", "trackid", "track", "tracker_id", "person_id", "ped_id", "target_id", "object_id",
           "agent_id"),
    "score": ("score", "conf", "confidence"),
    "class": ("class", "class_id", "cls", "category", "category_id", "object_category"),
    "left": ("left", "bb_left", "box_left_px", "xmin", "x_min", "x1"),
    "top": ("top", "bb_top", "box_top_px", "ymin", "y_min", "y1"),
    "right": ("right", "xmax", "x_max", "x2"),
    "bottom": ("bottom", "ymax", "y_max", "y2"),
    "width": ("width", "w", "bb_width", "box_width_px"),
    "height": ("height", "h", "bb_height", "box_height_px"),
    "cx": ("cx", "xc", "x_center", "center_x", "xcenter"),
    "cy": ("cy", "yc", "y_center", "center_y", "ycenter"),
    "group": ("group", "group_id", "groupid"),
    "lost": ("lost",),
    "x": ("x", "pos_x", "person_x", "x_px", *(f"x_{unit}" for unit in LENGTH_UNITS)),
    "y": ("y", "pos_y", "person_y", "y_px", *(f"y_{unit}" for unit in LENGTH_UNITS)),
}  # fmt: skip

# columns of which a text has a box, the first four that it has all of
CORNERS = ("x", "y", "right", "bottom")
BOXES = (
    ("left", "top", "width", "height"), ("left", "top", "right", "bottom"), ("cx", "cy", "width", "height"),
    ("x", "y", "width", "height"), CORNERS,
)  # fmt: skip
PLACES = (("x", "y"), ("cx", "cy"))  # columns of which a text without a box has a position

MEANINGS = {name: meaning for meaning, names in NAMES.items() for name in names}

# The columns of annotations of Stanford Drone, which have no line of names, but a label in quotes at the end.
STANFORD = "track_id xmin ymin xmax ymax frame lost occluded generated label"

# further names of a column of classes in words, if PEOPLE are among these: it may hold anything else
WORD_NAMES = ("label", "name", "class_name", "type", "agent_type", "object_type", "object_class")

PEOPLE = ("person", "pedestrian")  # words for the class of people

FramesAt = Callable[[Column, Column], Ints]  # frames (N,) from 1 of times (N,), s, and ids (N,); 0: of no frame

NUMBER_THEM = "write numbers of frames in a column frame: (time - time of frame 1) × frames per second + 1, times in s"

SECONDS = "if the frames are times, name their column t in the first line; else number frames 1, 2, 3, …"

EMPTY = 100  # A text with people in fewer than one of so many frames may have times for frames.

EXPECTED = (
    "a row per person and frame, with frame (or t, but not in a folder) and a box (x,y,w,h, "
    "left,top,width,height, x1,y1,x2,y2 or cx,cy,w,h), or frame,id,x,y in m (x_cm,y_cm in cm; x_px,y_px with "
    "--px-per-m)"
)


def column_names(text: TextRows) -> list[str] | None:
    """Returns the column names in a text's first row, in lower case; None if it has a number, and so no names.

    Units are parts of names: `x [m]` and `x/m` are `x_m`.
    """
    row = [re.sub("[µμ]s", "us", cell) for cell in next(text.cells(), [])]
    cells = [cell if is_number_text(cell) else re.sub(r"\W+", "_", cell).strip("_").lower() for cell in row]
    return cells if any(cells) and not any(map(is_number_text, cells)) else None


def read_named(
    text: TextRows, names: list[str], frames_at: FramesAt | None, px_per_m: float | None = None
) -> tuple[NumericTable, Ints | None]:
    """Reads a text with named columns as 8 or 10 columns of a MOTChallenge text, or as 4 or 5 of positions.

    Columns of positions are frame, id, x, y in m, and the class if there is one. frames_at: a function that gives the
    frames (0: none) of times (s), for a file with a column of times in place of frames; rows without frame are left
    out. None: times are not read. px_per_m: pixels per metre of x_px, y_px; None: unknown. Returns the rows, and the
    labels of a column `group`, (N,), -1 for alone; None without that column.
    """
    text = _with_somebody(text, names)
    word_column, words = _words_for_classes(text, names)
    found = _meanings(text, names, times=frames_at is not None, classes=not words)
    rows, column, is_instant = _columns(text, names, found)
    if words:
        classes, code = np.unique(words, return_inverse=True)
        rows, column["class"] = replace(rows, classes=tuple(classes.tolist())), code.astype(float)
    lost = column.get("lost", np.zeros(0)) != 0
    if lost.any():
        said = f"{lost.sum()} of {len(lost)} rows are lost people, whom nobody saw, and are left out"
        warnings.warn(f"{rows.file}: column lost: {said}", stacklevel=4)
        rows, column = _kept(rows, column, ~lost)
    if "time" in column and frames_at is not None:
        seconds, id = column.pop("time"), column.get("id", np.zeros(len(rows.line)))
        seconds = seconds if is_instant else in_seconds(text.file, names[found["time"]], seconds, id)
        column["frame"] = frames_at(seconds, id).astype(float)
        _reject_jitter(rows, column["frame"], seconds, column.get("id", np.full_like(seconds, -1)))
        rows, column = _kept(rows, column, column["frame"] > 0)
    units = {axis: names[found[axis]].partition("_")[2] for axis in "xy" if axis in column}
    columns, used = _in_order(text, column, units, px_per_m)
    if columns is None:
        _refuse(text, names)
    read = {k for meaning, k in found.items() if meaning in used} | {word_column}
    unused = [name for k, name in enumerate(names) if name and k not in read]
    if unused:
        warnings.warn(f"{text.file}: line {text.line[0]}: columns that are not used: {', '.join(unused)}", stacklevel=4)
    if column["frame"].min(initial=1) == 0:
        columns[0] = columns[0] + 1
        warnings.warn(f"{text.file}: frames are counted from 0; they are read as frames from 1", stacklevel=4)
    rows = replace(rows, values=np.stack(columns, axis=1))
    return rows, replace(rows, values=column["group"][:, None]).integers(0, "group") if "group" in column else None


def _reject_jitter(rows: NumericTable, frame: Column, seconds: Column, id: Column) -> None:
    """Raises InputError if two times (N,), s, of one id (N,; -1: none) have the same frame (N,; 0: none)."""
    known = np.flatnonzero((id >= 0) & (frame > 0))
    order = known[np.lexsort((seconds[known], frame[known], id[known]))]
    row, before = order[1:], order[:-1]
    same = (frame[row] == frame[before]) & (id[row] == id[before]) & (seconds[row] != seconds[before])
    if same.any():
        k, expected = row[same.argmax()], "times that vary by less than half a frame"
        got = f"a second time of id {id[k]:.12g} in frame {frame[k]:.0f}"
        remedy = "number the times in order, 1, 2, 3, …, in a column frame, and give --fps"
        raise InputError(file=rows.file, place=f"line {rows.line[k]}", got=got, expected=expected, remedy=remedy)


def _with_somebody(text: TextRows, names: list[str]) -> TextRows:
    """Returns the text without rows that have nothing but a time in the columns that are read; warns of them."""
    mark = text.separator
    use = [k for k, name in enumerate(names) if MEANINGS.get(name, "time") not in ("time", "frame")]
    if mark is None or not use:
        return text
    cells = (line.split(mark) if 2 * mark in line else [] for line in text.text)
    empty = np.array([len(row) == len(names) and not any(row[k].strip('" ') for k in use) for row in cells])
    if not empty.any() or empty[1:].all():
        return text
    read = ", ".join(names[k] for k in use)
    warnings.warn(f"{text.file}: {empty.sum()} rows have nobody in columns {read}", stacklevel=5)
    return TextRows(text.file, tuple(compress(text.text, ~empty)), text.line[~empty])


def _meanings(text: TextRows, names: list[str], times: bool, classes: bool) -> dict[str, int]:
    """Returns the column of each meaning. times, classes: whether columns of times and of classes are read."""
    found: dict[str, int] = {}
    for k, name in enumerate(names):
        meaning = MEANINGS.get(name)
        if meaning == "time" and (not times or not set(NAMES["frame"]).isdisjoint(names)):
            continue
        if meaning in found:
            _refuse(text, names, f"{names[found[meaning]]} and {name} mean the same: give one of them another name")
        if meaning is not None and (classes or meaning != "class"):
            found[meaning] = k
    if found.keys().isdisjoint(("frame", "time")):
        _refuse(text, names, NAME_THEM if set(NAMES["time"]).isdisjoint(names) else NUMBER_THEM)
    return found


def _columns(text: TextRows, names: list[str], found: dict[str, int]) -> tuple[NumericTable, dict[str, Column], bool]:
    """Returns the rows, their columns by meaning, and True if times are dates, in s. Words of ids are numbered."""
    layout, worded = "those that the first line names", dict[str, list[str]]()

    def read() -> NumericTable:
        use = [k for meaning, k in found.items() if meaning not in worded]
        return text.numbers((len(names),), first=1, layout=layout, use=use)

    try:
        rows = read()
    except InputError:
        cells = {m: text.words(found[m], first=1) for m in ("id", "group", "time") if m in found}
        worded |= {m: each for m, each in cells.items() if not all(map(is_number_text, set(each)))}
        if not worded:
            raise
        rows = read()
    numeric = [meaning for meaning in found if meaning not in worded]
    column: dict[str, Column] = dict(zip(numeric, rows.values.T, strict=False))
    for meaning in [meaning for meaning in ("id", "group") if meaning in worded]:  # warnings come in this order
        column[meaning], known = numbered(rows, worded[meaning], meaning)
        rows = replace(rows, names=known) if meaning == "id" else rows
    if "time" in worded:
        column["time"] = instants(rows, worded["time"])
    return rows, column, "time" in worded


def _kept(rows: NumericTable, column: dict[str, Column], keep: Bools) -> tuple[NumericTable, dict[str, Column]]:
    return replace(rows, line=rows.line[keep]), {name: values[keep] for name, values in column.items()}


def _words_for_classes(text: TextRows, names: list[str]) -> tuple[int, list[str]]:
    """Returns the column that holds classes in words, and its cells; -1 and [] without one."""
    for k, name in enumerate(names):
        known = name in (*NAMES["class"], *WORD_NAMES)
        words = [word.lower() for word in text.words(k, first=1)] if known else []
        if not all(map(is_number_text, words)) and (name in NAMES["class"] or not set(PEOPLE).isdisjoint(words)):
            return k, words
    return -1, []


def _in_order(
    text: TextRows, column: dict[str, Column], units: dict[str, str], px_per_m: float | None
) -> tuple[list[Column] | None, set[str]]:
    """Returns the columns of a MOTChallenge text, or of positions in m, and the meanings of the columns that are used.

    None without a box and a position. units: of x and y, as their names say.
    """
    frame, have = column["frame"], {*column}
    used = have & {"frame", "id", "group", "lost"} | {"time"}
    none = np.full_like(frame, -1.0)
    column = {"id": none, "class": none, "score": np.ones_like(frame)} | column
    form = next((form for form in BOXES if have >= {*form} and (form != CORNERS or _are_corners(column))), None)
    place = next((place for place in PLACES if have >= {"id", *place}), None)
    if form is None and place is not None:
        ground = [column[axis] * _metres(text, units.get(axis, ""), px_per_m) for axis in place]
        kinds = [column["class"]] if "class" in have else []
        return [frame, column["id"], *ground, *kinds], used | {*place, "class"}
    if form is None:
        return None, used
    left, top, w, h = (column[name] for name in form)
    if "right" in form:
        w, h = w - left, h - top
    if "cx" in form:
        left, top = left - w / 2, top - h / 2
    known = len(units) == 2 and {*units.values()} <= LENGTH_UNITS.keys()
    metres = form == BOXES[0] and "id" in have and "class" not in have and known
    ground = [column[axis] * LENGTH_UNITS[units[axis]] for axis in "xy"] if metres else []
    last = [*ground, np.zeros_like(frame)] if metres else [column["class"]]
    used |= {"score", "class", *form, *("xy" if metres else "")}
    return [frame, column["id"], left, top, w, h, column["score"], *last], used


def _are_corners(column: dict[str, Column]) -> bool:
    """Returns True if x, y, x2, y2 can be corners of people's boxes, and no two positions."""
    width, height = column["right"] - column["x"], column["bottom"] - column["y"]
    return bool((width > 0).all() and (height > 0).all() and np.median(height) > LOWEST)


def _metres(text: TextRows, unit: str, px_per_m: float | None) -> float:
    if unit != "px":
        return LENGTH_UNITS.get(unit, 1.0)
    if px_per_m is None:
        place, got, expected = "columns x_px, y_px", "pixels, without a scale", "metres, or a scale"
        remedy = "add --px-per-m, the pixels per metre"
        raise InputError(file=text.file, place=place, got=got, expected=expected, remedy=remedy)
    return 1 / px_per_m


def _refuse(text: TextRows, names: list[str], remedy: str = NAME_THEM) -> NoReturn:
    got = f"columns {','.join(names)}"
    raise InputError(file=text.file, place=f"line {text.line[0]}", got=got, expected=EXPECTED, remedy=remedy)


GROUND_COLUMNS = 4  # columns of a text of ground positions alone: frame, id, x, y; a fifth is the class

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
    group: Ints | None = None  # (N,) labels of a column `group`, -1 for alone

    @property
    def on_ground(self) -> bool:
        """True if the text has ground positions and no boxes: 4 columns, or 5 with the class."""
        return bool(self.rows.values.shape[1] <= GROUND_COLUMNS + 1)

    def scores(self) -> Array:
        """Returns column 7 (N,), a confidence or flag; ones if there is no such column."""
        return self.rest[:, 0] if self.rest.shape[1] else np.ones(len(self.frame))

    def boxes(self) -> Array:
        """Returns the boxes of the rows that have one, (B, 4)."""
        return self.box[~self.without_box()]

    def without_box(self) -> Bools:
        """Returns flags (N,): True for rows whose box is -1,-1,-1,-1."""
        return np.asarray((self.box == -1).all(axis=1))


def read_table(
    path: Path, *, length: int | None = None, box_scale: BoxScale | None = None, frames_at: FramesAt | None = None,
    px_per_m: float | None = None,
) -> MotTable:  # fmt: skip
    """Returns the MotTable of a MOTChallenge text of 6 to 10 columns, or of 4: frame, id, x, y in m.

    length: the last frame allowed. box_scale: factors that make the boxes pixels. frames_at, px_per_m: as `read_named`
    takes them. Rows stay in the order of the file.
    """
    text = read_rows(path, heading=True)
    first = next(text.cells(), [])
    if len(first) == len(STANFORD.split()) and first[-1].startswith('"') and is_number_text(first[0]):
        text = TextRows(path, (STANFORD, *text.text), np.insert(text.line, 0, 0))
    named, group = column_names(text), None
    if named is not None:
        rows, group = read_named(text, named, frames_at, px_per_m)
    else:
        rows = text.numbers((GROUND_COLUMNS, *range(6, 11)), layout=LAYOUT)
        reject_missing_ids(rows)
        reject_swapped(rows)
    return table_of_rows(rows, length, box_scale, group)


def table_of_rows(
    rows: NumericTable, length: int | None = None, box_scale: BoxScale | None = None, group: Ints | None = None,
    boxless: bool = True,
) -> MotTable:  # fmt: skip
    """Returns the MotTable of rows in the columns of a MOTChallenge text. Arguments as for `read_table`.

    boxless: True allows -1,-1,-1,-1 for "no box".
    """
    frame, id, count = rows.integers(0, "frame", SECONDS), rows.integers(1, "id"), len(rows.line)
    box, rest = rows.values[:, 2:6], rows.values[:, 6:]
    if rows.values.shape[1] <= GROUND_COLUMNS + 1:
        # A text of positions: no box, confidence 1, z = 0.
        box, rest = np.full((count, 4), -1.0), np.c_[np.ones(count), rows.values[:, 2:4], np.zeros(count)]
    if group is not None:
        rows.reject(group < -1, "groups from 0, or -1 for alone", "correct the group")
        alone = not repeated_ids(frame[group >= 0], group[group >= 0]).any()
        if count and (alone or not group.any()):
            who = "no two people of a frame are in one group" if alone else "all are one group"
            warnings.warn(f"{rows.file}: column group: {who}. Leave an unused column out", stacklevel=4)
    table = MotTable(rows, frame, id, box, rest, group)
    rows.require_bounds(frame, length)
    last, seen = int(frame.max(initial=0)), len(np.unique(frame))
    if last >= EMPTY * max(seen, ENOUGH):
        said = f"people are in {seen} of {last} frames, the last in {rows.unit} {rows.line[frame.argmax()]}"
        warnings.warn(f"{rows.file}: {said}: {SECONDS}", stacklevel=4)
    flat, boxed = (table.box[:, 2:] <= 0).any(axis=1), ~table.without_box()
    rows.reject(flat & boxed if boxless else flat, "boxes with width and height above 0", CORRECT)
    if box_scale is not None:
        table = replace(table, box=np.where(boxed[:, None], box * np.tile(box_scale, 2), box))
    return table
