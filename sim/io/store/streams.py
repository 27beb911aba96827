"""The picture streams of a stored sequence: their names, file types, file names, and 16-bit coding."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from scenarios.errors import InputError, WorkError
from sim.types import Array, Ints

STREAMS = ("left", "right", "disparity", "ids", "background")
IMAGES = ("jpg", "png", "mp4")
FOLDERS = {"left": "img1", "right": "img1_right", "disparity": "disparity", "ids": "ids", "background": "background"}
EXACT = ("disparity", "ids")
"""Streams of 16-bit numbers, always PNG."""

STEPS = 64  # stored disparity steps per px
PERSON, STATIC = 2000, 3000  # class × 1000: MOTS has class 2 for pedestrians, and none for walls and pillars
PEOPLE = 999  # highest person id that class × 1000 + id can hold

Codes = NDArray[np.uint16]


def check_streams(streams: Iterable[str], images: str) -> tuple[str, ...]:
    """Return the streams in the order of STREAMS, with "background" added if "left" or "right" is among them.

    Raises InputError if a stream or the file type `images` is unknown.
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
    """Return `images` if it affects any stream; None without streams or with 16-bit ones (always PNG) only."""
    return images if set(streams) - set(EXACT) else None


def suffix(stream: str, images: str) -> str:
    """Return the file type of a stream: `images`, or "png" for the 16-bit streams."""
    return "png" if stream in EXACT else images


def file_name(stream: str, images: str, index: int) -> str:
    """Return the name of a picture's file inside the sequence folder, as img1/000001.jpg or left.mp4.

    index: the frame; for "background" the picture's number, from 1.
    """
    kind = suffix(stream, images)
    return f"{stream}.mp4" if kind == "mp4" else f"{FOLDERS[stream]}/{index:06d}.{kind}"


def is_picture(name: str) -> bool:
    """Return True if a file of a sequence folder, given by its relative name, holds pictures."""
    return name.endswith(".mp4") or name.partition("/")[0] in FOLDERS.values()


def encode_ids(ids: Ints) -> Codes:
    """Return ids (H, W) as uint16 in the style of MOTS: 2000 + id for people, 3000 for walls and pillars, 0 elsewhere.

    ids: as in PixelTruth. Raises WorkError for an id above 999.
    """
    if ids.max(initial=0) > PEOPLE:
        raise WorkError(
            place="--streams ids", got=f"person {int(ids.max())}", expected=f"{PEOPLE} people at most",
            remedy="leave the stream out",
        )  # fmt: skip
    return np.where(ids > 0, ids + PERSON, np.where(ids < 0, STATIC, 0)).astype(np.uint16)


def decode_ids(codes: Codes) -> Ints:
    """Return the inverse of encode_ids, (H, W) int64: person id, -2 for walls and pillars, 0 elsewhere."""
    wide = codes.astype(np.int64)
    return np.where(wide == STATIC, -2, np.where(wide > PERSON, wide - PERSON, 0))


def encode_disparity(disparity: Array) -> Codes:
    """Return disparities (H, W) px as uint16: round(64 d) between 1 and 65535, 0 where unknown (nan)."""
    known = np.isfinite(disparity)
    steps = np.clip(np.rint(np.where(known, disparity, 0.0) * STEPS), 1, 65535)
    return np.where(known, steps, 0).astype(np.uint16)


def decode_disparity(codes: Codes) -> Array:
    """Return the inverse of encode_disparity, (H, W) px, nan where unknown."""
    return np.where(codes > 0, codes / STEPS, np.nan)
