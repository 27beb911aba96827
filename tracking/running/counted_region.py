"""The region of the image that counts: what is outside it, such as a car park or a screen, reaches no tracker.

Outside the region pictures are black, in the frames and in the background sample alike, so there is never foreground.
Detections count if their foot is in the region: the middle of the box's lower edge, from straight above its centre.
A person who stands at the region's border is cut off there in pictures. Tracks are reported wherever they are.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from scenarios.errors import InputError, reject
from sim.pictures.picture_folder import SUFFIXES, read_picture
from sim.types import Array, Bools, Detections, Frame, Image, Sequence

# A picture (H, W) or (H, W, 3), not zero in the region; corners (K, 2) of a polygon, px; the path of a picture; or text
# "X1,Y1,X2,Y2,X3,Y3,…".
Mask = ArrayLike | str | Path
PLACE, POLYGON = "--mask", "a picture, or corners X1,Y1,X2,Y2,X3,Y3,… in px"


def counted_region(mask: Mask, size: tuple[int, int] | None) -> Bools:
    """Returns the region (H, W) that counts in pictures of `size` (width, height) px.

    Raises InputError if the mask cannot be read, has another size or no pixel, or if the size is unknown.
    """
    remedy = "leave --mask out, or give a recording with pictures"
    if size is None:
        raise InputError(place=PLACE, got="a sequence whose size in px is unknown", expected="pictures", remedy=remedy)
    file = Path(mask) if isinstance(mask, str | Path) and Path(mask).suffix.lower() in SUFFIXES else None
    found: NDArray[Any]
    if file is not None:
        picture = read_picture(file)
        if picture is None:
            got = "no picture that can be read" if file.is_file() else "no such file"
            raise InputError(file=file, place=PLACE, got=got, expected=POLYGON, remedy="check the path")
        found = picture
    else:
        found = _corners(mask) if isinstance(mask, str | Path) else np.asarray(mask)
    if found.ndim == 2 and found.shape[1] == 2 and found.shape != size[::-1]:
        inside = _polygon(found, size)
    else:
        inside = np.asarray(found != 0 if found.ndim == 2 else (found != 0).any(-1))
        got, expected = "×".join(map(str, found.shape[1::-1])) + " px", "{}×{} px, as the pictures".format(*size)
        reject(inside.shape != size[::-1], file or "", got, expected, "give a mask of the pictures' size", PLACE)
    reject(not inside.any(), file or "", "no pixel that counts", "a part of the picture", "not zero counts", PLACE)
    return inside


def _corners(text: str | Path) -> Array:
    try:
        found = np.array([float(word) for word in str(text).split(",")])
    except ValueError:
        found = np.zeros(0)
    if len(found) < 6 or len(found) % 2 or not np.isfinite(found).all():
        remedy = "for instance 0,120,320,120,320,240,0,240"
        raise InputError(place=PLACE, got=str(text), expected=POLYGON, remedy=remedy)
    return found.reshape(-1, 2)


def _polygon(corners: NDArray[Any], size: tuple[int, int]) -> Bools:
    from tracking.export.places import inside

    u, v = np.meshgrid(np.arange(size[0]) + 0.5, np.arange(size[1]) + 0.5)
    return np.asarray(inside(np.column_stack([u.ravel(), v.ravel()]), corners.astype(float)).reshape(size[::-1]))


def with_masked_pictures(sequence: Sequence, region: Bools) -> Sequence:
    """Returns the sequence with pictures, also of the background sample, that are black outside the region (H, W)."""

    def frames() -> Iterator[Frame]:
        for frame in sequence.frames():
            image, right = (inside_region(picture, region) for picture in (frame.image, frame.right))
            yield replace(frame, image=image, right=right)

    sample = sequence.load_background
    load = None if sample is None else partial(_masked_sample, sample, region)
    return replace(sequence, frames=frames, load_background=load)


def _masked_sample(load: Callable[[], Image], region: Bools) -> Image:
    return np.asarray(load() * region[..., None], np.uint8)


def inside_region(picture: Image | None, region: Bools) -> Image | None:
    """Returns a picture (H, W, 3), or none, black outside the region (H, W)."""
    return None if picture is None else np.asarray(picture * region[..., None], np.uint8)


def detections_inside(found: Detections, region: Bools, above: bool) -> Detections:
    """Returns the detections whose foot is in the region (H, W); above: True if the camera looks straight down.

    Raises InputError if their places in the image are unknown.
    """
    if found.box is None and found.plane != "image":
        got, remedy = "points on the ground without boxes", "leave --mask out, or give boxes"
        raise InputError(place=PLACE, got=got, expected="pictures, or boxes in them", remedy=remedy)
    at = found.pos if found.box is None else found.box[:, :2] + found.box[:, 2:] * [0.5, 0.5 if above else 1.0]
    high, wide = region.shape
    column, row = np.floor(np.nan_to_num(at, nan=-1.0)).astype(np.int64).T
    row = np.where(row == high, high - 1, row)  # the lower edge of the image belongs to its last row
    seen = (column >= 0) & (column < wide) & (row >= 0) & (row < high)
    keep = seen & region[np.clip(row, 0, high - 1), np.clip(column, 0, wide - 1)]
    rows = ("pos", "vel", "box", "score")
    return found.replace(**{k: v[keep] for k in rows if (v := getattr(found, k)) is not None and len(v) == len(keep)})
