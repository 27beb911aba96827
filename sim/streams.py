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


def check_streams(streams: Iterable[str], images: str) -> tuple[str, ...]:
    """Returns the streams in the order of STREAMS; "background" comes with left and right."""
    wanted = set(streams)
    unknown = sorted(wanted - set(STREAMS))
    if unknown:
        expected = f"none, or some of {', '.join(STREAMS)}"
        raise InputError(place="--streams", got=", ".join(unknown), expected=expected, remedy="correct --streams")
    if images not in IMAGES:
        raise InputError(place="--images", got=images, expected=" or ".join(IMAGES), remedy="correct --images")
    if wanted & {"left", "right"}:
        wanted.add("background")
    return tuple(name for name in STREAMS if name in wanted)


def coding(streams: Iterable[str], images: str) -> str | None:
    """Returns `images`, the file type, if it affects any of the streams; else None."""
    return images if set(streams) - set(EXACT) else None


def suffix(stream: str, images: str) -> str:
    """Returns the file type of a stream, without dot."""
    return "png" if stream in EXACT else images


def file_name(stream: str, images: str, index: int) -> str:
    """Returns the name of a picture's file in the sequence folder: "img1/000001.jpg", or "left.mp4" for all.

    index: the frame, or the number of the background picture, from 1.
    """
    kind = suffix(stream, images)
    return f"{stream}.mp4" if kind == "mp4" else f"{FOLDERS[stream]}/{index:06d}.{kind}"


def is_picture(name: str) -> bool:
    """Returns True if a file of a sequence folder holds pictures. name: relative to the folder."""
    return name.endswith(".mp4") or name.partition("/")[0] in FOLDERS.values()


def encode_ids(ids: Ints) -> Codes:
    """Returns ids (H, W) as uint16 in the style of MOTS: 2000 + id for people, 3000 for walls and pillars, else 0."""
    if ids.max(initial=0) > PEOPLE:
        raise WorkError(
            place="--streams ids", got=f"person {int(ids.max())}", expected=f"{PEOPLE} people at most",
            remedy="leave the stream out",
        )  # fmt: skip
    return np.where(ids > 0, ids + PERSON, np.where(ids < 0, STATIC, 0)).astype(np.uint16)


def decode_ids(codes: Codes) -> Ints:
    """Returns the ids (H, W) of MOTS codes; -2 for walls and pillars."""
    wide = codes.astype(np.int64)
    return np.where(wide == STATIC, -2, np.where(wide > PERSON, wide - PERSON, 0))


def encode_disparity(disparity: Array, camera: Camera | None = None) -> Codes:
    """Returns disparities (H, W) px as uint16 as in KITTI: round(256 d), at least 1; 0 for unknown."""
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
    """Returns the disparities (H, W) px of codes, nan for unknown."""
    return np.where(codes > 0, codes / STEPS, np.nan)
