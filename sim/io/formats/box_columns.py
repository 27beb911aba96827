"""Whether columns 3 to 6 of a text without names can be left, top, width and height in pixels.

Other programs write corners, shares of the picture, or leave the ids out, so that every column means the one before.
"""

from __future__ import annotations

import numpy as np

from scenarios.errors import InputError
from scenarios.limits import PICTURE_SIDE
from sim.io.files.numeric_text import NumericTable, is_number_text
from sim.types import Array, Ints

BoxScale = tuple[float, float]  # factors of x and y that make the boxes of a text pixels of the pictures

ENOUGH = 10  # rows that are needed to judge by how their columns vary

MOST_SHARE = 2.0  # greatest left and top of boxes in shares of the picture; people may be partly outside

PERSON = (1.2, 6.0)  # height of a person's box divided by its width

STAY = 0.5  # least share of rows whose id is in the frame before or after, too, among tracks

SMOOTH = 0.3  # Corners: the difference of x2 and x1 varies by less than this part of what x2 does

BEYOND = 0.2  # share of boxes beyond the picture, above which they are those of larger pictures

MANY, PART = 100, 0.7  # so many boxes reach further than this part of both sides of the picture

NO_ID = "frame,left,top,width,height,score"


def reject_missing_ids(rows: NumericTable, frame: Ints, id: Ints) -> None:
    """Raises InputError if column 2 is no id but the left edge of a box, and the ids are missing."""
    values = rows.values
    if not len(values) or values.shape[1] < 6 or (id == -1).all():
        return
    # Column 6 then holds scores: at most 1, which is no height. Scores up to 100 show in other ways: the six columns
    # make boxes of people one column earlier only, and the ids do not last.
    score = (values[:, 5] >= 0) & (values[:, 5] <= 1) & (values[:, 4] > 1) & (values[:, 3] > 1)
    earlier = values.shape[1] == 6 and _aspect(values[:, 1:5]) and not _aspect(values[:, 2:6]) and not _lasts(frame, id)
    if score.all() or (len(values) >= ENOUGH and earlier):
        raise InputError(
            file=rows.file, place="columns", got=f"in {len(values)} lines what looks like {NO_ID} without an id",
            expected="frame,id,left,top,width,height,…", remedy=f"write {NO_ID} as the first line, if they are these, "
            "or -1 as the id",
        )  # fmt: skip


def _aspect(box: Array) -> bool:
    low, high = PERSON
    return bool(low <= np.median(box[:, 3] / np.maximum(box[:, 2], 1e-9)) <= high)


def _lasts(frame: Ints, id: Ints) -> bool:
    if len(np.unique(frame)) < 2 or (np.diff(id) > 0).all():
        return True
    number = np.unique(frame, return_inverse=True)[1]
    order = np.lexsort((number, id))
    follows = (np.diff(id[order]) == 0) & (np.diff(number[order]) == 1)
    near = np.append(follows, False) | np.append(False, follows)
    return bool(near.mean() >= STAY)


def require_pixels(rows: NumericTable, box: Array) -> None:
    """Raises InputError if no box (B, 4) is larger than a pixel, as boxes in shares of the picture are."""
    if len(box) and (np.abs(box[:, :2]) <= MOST_SHARE).all() and (box[:, 2:] <= 1).all():
        raise InputError(
            file=rows.file, place="boxes", got=f"numbers up to {box.max():.3g} in all {len(box)} boxes",
            expected="pixels", remedy="if they are shares of the picture, add --box-scale WIDTH,HEIGHT, its size in px "
            "(not for labels); if x, y are centres, as YOLO's, name the columns frame,id,cx,cy,w,h,… in the first line",
        )  # fmt: skip


def corner_doubt(box: Array) -> str:
    """Returns what speaks for corners x1,y1,x2,y2 in boxes (B, 4) read as left, top, width, height; "": nothing."""
    x1, y1, x2, y2 = box.T
    if len(box) < ENOUGH or not ((x2 > x1) & (y2 > y1)).all():
        return ""
    # A width that varies along with the left edge is a right edge.
    if not np.std(x2 - x1) < SMOOTH * np.std(x2):
        return ""
    return (
        f"all {len(box)} boxes look like x1,y1,x2,y2, but are read as left,top,width,height; "
        "if they are corners, name the columns in the first line: frame,id,x1,y1,x2,y2,…"
    )


def size_doubt(box: Array, size: tuple[int, int]) -> str:
    """Returns what speaks for boxes (B, 4) px of pictures of another size (width, height); "": nothing."""
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


def parse_box_scale(text: str) -> BoxScale:
    """Returns the factors of x and y that a text such as "2" or "1920,1080" names."""
    cells = text.split(",")
    factors = [float(cell) if is_number_text(cell) else float("nan") for cell in cells]
    if len(cells) > 2 or not all(0 < f <= PICTURE_SIDE for f in factors):
        raise InputError(
            place="--box-scale", got=repr(text), expected=f"X or X,Y, above 0, at most {PICTURE_SIDE}",
            remedy="give pixels of the picture per unit of the boxes",
        )  # fmt: skip
    return factors[0], factors[-1]
