"""The picture streams of a stored sequence: left, right, disparity, ids and background.

Says which names are valid, which file type each stream has ("jpg", "png" or "mp4"; disparity and ids are always PNG),
how files are named, and how disparities and ids are coded in 16 bits.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from scenarios.errors import InputError, WorkError
from sim.types import Array, Camera, Ints

STREAMS = ("left", "right", "disparity", "ids", "background")
IMAGES = ("jpg", "png", "mp4")
FOLDERS = {"left": "img1", "right": "img1_right", "disparity": "disparity", "ids": "ids", "background": "background"}
EXACT = ("disparity", "ids")  # streams of 16-bit numbers, always PNG

STEPS = 256  # stored disparity steps per px, as in KITTI
LARGEST = 65535  # largest stored code
PERSON, STATIC = 2000, 3000  # class × 1000: MOTS has class 2 for pedestrians, and none for walls and pillars
PEOPLE = 999  # highest person id that class × 1000 + id can hold

Codes = NDArray[np.uint16]


def check_streams(streams: Iterable[str], images: str, background: bool = True) -> tuple[str, ...]:
    """Returns the given streams in the order of STREAMS; "left" and "right" each add "background", if `background`.

    Raises InputError for an unknown stream, or if `images` is none of the file types "jpg", "png" and "mp4".
    """
    wanted = set(streams)
    unknown = sorted(wanted - set(STREAMS))
    if unknown:
        expected = f"none, or some of {', '.join(STREAMS)}"
        raise InputError(place="--streams", got=", ".join(unknown), expected=expected, remedy="correct --streams")
    if images not in IMAGES:
        raise InputError(place="--images", got=images, expected=" or ".join(IMAGES), remedy="correct --images")
    if background and wanted & {"left", "right"}:
        wanted.add("background")
    return tuple(name for name in STREAMS if name in wanted)


def coding(streams: Iterable[str], images: str) -> str | None:
    """Returns the file type `images`, or None if no stream uses it (disparity and ids are always PNG)."""
    return images if set(streams) - set(EXACT) else None


def suffix(stream: str, images: str) -> str:
    """Returns the file type of a stream, without dot: "png" for disparity and ids, `images` for the others."""
    return "png" if stream in EXACT else images


def file_name(stream: str, images: str, index: int) -> str:
    """Returns the name of a picture's file, relative to the sequence folder, such as "img1/000001.jpg".

    For mp4 one file holds all pictures of the stream, such as "left.mp4". index: number of the frame, or of the
    background picture, from 1.
    """
    kind = suffix(stream, images)
    return f"{stream}.mp4" if kind == "mp4" else f"{FOLDERS[stream]}/{index:06d}.{kind}"


def is_picture(name: str) -> bool:
    """Returns True if a file of a sequence folder holds pictures. name: relative to the folder."""
    return name.endswith(".mp4") or name.partition("/")[0] in FOLDERS.values()


def encode_ids(ids: Ints) -> Codes:
    """Returns ids (H, W) as uint16 as in MOTS: 2000 + id for people, 3000 for walls and pillars, 0 elsewhere.

    ids: as in `PixelTruth`. Raises WorkError for a person id above 999.
    """
    if ids.max(initial=0) > PEOPLE:
        raise WorkError(
            place="--streams ids", got=f"person {int(ids.max())}", expected=f"{PEOPLE} people at most",
            remedy="leave the stream out",
        )  # fmt: skip
    return np.where(ids > 0, ids + PERSON, np.where(ids < 0, STATIC, 0)).astype(np.uint16)


def decode_ids(codes: Codes) -> Ints:
    """Returns the ids (H, W) of the codes (H, W) of `encode_ids`: person ids, -2 for walls and pillars, else 0."""
    wide = codes.astype(np.int64)
    return np.where(wide == STATIC, -2, np.where(wide > PERSON, wide - PERSON, 0))


def encode_disparity(disparity: Array, camera: Camera | None = None) -> Codes:
    """Returns disparities d (H, W) px as uint16 as in KITTI: round(256 d), at least 1; 0 where d is not finite.

    camera: for the error message only. Raises WorkError if a disparity does not fit, that is, from 256 px on.
    """
    known = np.isfinite(disparity)
    steps = np.maximum(np.rint(np.where(known, disparity, 0.0) * STEPS), 1)
    if steps.max(initial=0) > LARGEST:
        rig = "" if camera is None else f" of a rig with focal_px {camera.focal_px[0]:g}, baseline {camera.baseline:g}"
        raise WorkError(
            place="--streams disparity", got=f"a disparity of {steps.max() / STEPS:.0f} px{rig}",
            expected="less than 256 px", remedy="make camera.baseline smaller, or leave the stream out",
        )  # fmt: skip
    return np.where(known, steps, 0).astype(np.uint16)


def decode_disparity(codes: Codes) -> Array:
    """Returns the disparities (H, W) px of the codes of `encode_disparity`; nan where the code is 0."""
    return np.where(codes > 0, codes / STEPS, np.nan)
