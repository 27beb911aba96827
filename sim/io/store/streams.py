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
EXACT = ("disparity", "ids")
"""Streams of 16-bit numbers, always PNG."""

STEPS = 256  # stored disparity steps per px, as in KITTI
LARGEST = 65535  # largest stored code
PERSON, STATIC = 2000, 3000  # class × 1000: MOTS has class 2 for pedestrians, and none for walls and pillars
PEOPLE = 999  # highest person id that class × 1000 + id can hold

Codes = NDArray[np.uint16]


def check_streams(streams: Iterable[str], images: str) -> tuple[str, ...]:
    """Return the streams in the order left, right, disparity, ids, background, each once.

    "background" is added if "left" or "right" is among them. streams: names, () for none. images: file type. Raises
    InputError if a stream is unknown, or `images` is not "jpg", "png" or "mp4", also without streams.
    """
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
    """Return `images`, the file type, if it affects any of the streams; else None.

    It affects none if there are no streams, or only disparity and ids, which are always PNG.
    """
    return images if set(streams) - set(EXACT) else None


def suffix(stream: str, images: str) -> str:
    """Return the file type of a stream, without dot: "png" for disparity and ids, else `images`."""
    return "png" if stream in EXACT else images


def file_name(stream: str, images: str, index: int) -> str:
    """Return the name of a picture's file relative to the sequence folder: "img1/000001.jpg" or "left.mp4", for
    instance.

    stream: "left", "right", "disparity", "ids" or "background", else KeyError unless it is a video. images: file type,
    "jpg", "png" or "mp4"; disparity and ids are always PNG. index: the frame, from 1; for "background" the picture's
    number, from 1. An mp4 holds all pictures of a stream, so `index` is then ignored.
    """
    kind = suffix(stream, images)
    return f"{stream}.mp4" if kind == "mp4" else f"{FOLDERS[stream]}/{index:06d}.{kind}"


def is_picture(name: str) -> bool:
    """Return True if a file of a sequence folder holds pictures: a video, or a file in the folder of a stream.

    name: relative to the sequence folder, with "/" between its parts.
    """
    return name.endswith(".mp4") or name.partition("/")[0] in FOLDERS.values()


def encode_ids(ids: Ints) -> Codes:
    """Return ids (H, W) as uint16 in the style of MOTS: 2000 + id for people, 3000 for walls and pillars, 0 elsewhere.

    ids: person id (from 1), negative for walls and pillars, 0 elsewhere. Raises WorkError if a person's id is above
    999.
    """
    if ids.max(initial=0) > PEOPLE:
        raise WorkError(
            place="--streams ids", got=f"person {int(ids.max())}", expected=f"{PEOPLE} people at most",
            remedy="leave the stream out",
        )  # fmt: skip
    return np.where(ids > 0, ids + PERSON, np.where(ids < 0, STATIC, 0)).astype(np.uint16)


def decode_ids(codes: Codes) -> Ints:
    """Return the ids (H, W) int64 of MOTS codes (H, W) uint16, the inverse of encode_ids.

    Code 3000 gives -2 (walls and pillars), any other above 2000 gives code - 2000 (person id), the rest 0.
    """
    wide = codes.astype(np.int64)
    return np.where(wide == STATIC, -2, np.where(wide > PERSON, wide - PERSON, 0))


def encode_disparity(disparity: Array, camera: Camera | None = None) -> Codes:
    """Return disparities (H, W) px as uint16 as in KITTI: round(256 d), at least 1, 0 where d is nan or infinite.

    d is the disparity of a pixel; negative ones and 0 become 1. camera: of the pair, for the error; None: unknown.
    Raises WorkError if a disparity is 256 px or more.
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
    """Return the disparities (H, W) px of stored codes: code / 256, nan where the code is 0 (unknown)."""
    return np.where(codes > 0, codes / STEPS, np.nan)
