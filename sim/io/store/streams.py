"""Which pictures a stored sequence has, as what, and where."""

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

STEPS = 64  # of disparity per px
PERSON, STANDING = 2000, 3000  # class × 1000: pedestrians are class 2 in MOTS, which has none for walls and pillars
PEOPLE = 999  # that class × 1000 + id leaves room for

Codes = NDArray[np.uint16]


def check_streams(streams: Iterable[str], images: str) -> tuple[str, ...]:
    """The streams in their order, the background with those that need one; InputError for a word that is none."""
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
    """How pictures are coded; None where no stream leaves a choice."""
    return images if set(streams) - set(EXACT) else None


def suffix(stream: str, images: str) -> str:
    """jpg, png or mp4."""
    return "png" if stream in EXACT else images


def file_name(stream: str, images: str, index: int) -> str:
    """Where the picture of a frame (background: of its number, from 1) lies in the sequence's folder."""
    kind = suffix(stream, images)
    return f"{stream}.mp4" if kind == "mp4" else f"{FOLDERS[stream]}/{index:06d}.{kind}"


def is_picture(name: str) -> bool:
    """Whether a file of a sequence holds pictures."""
    return name.endswith(".mp4") or name.partition("/")[0] in FOLDERS.values()


def encode_ids(ids: Ints) -> Codes:
    """(H, W) uint16 as in MOTS: 2000 + person, 0 the ground; 3000 walls and pillars (-2)."""
    if ids.max(initial=0) > PEOPLE:
        raise WorkError(
            place="--streams ids", got=f"person {int(ids.max())}", expected=f"{PEOPLE} people at most",
            remedy="leave the stream out",
        )  # fmt: skip
    return np.where(ids > 0, ids + PERSON, np.where(ids < 0, STANDING, 0)).astype(np.uint16)


def decode_ids(codes: Codes) -> Ints:
    """(H, W) int64 person, 0 or -2."""
    wide = codes.astype(np.int64)
    return np.where(wide == STANDING, -2, np.where(wide > PERSON, wide - PERSON, 0))


def encode_disparity(disparity: Array) -> Codes:
    """(H, W) uint16: 64 d, rounded; 0 unknown."""
    known = np.isfinite(disparity)
    steps = np.clip(np.rint(np.where(known, disparity, 0.0) * STEPS), 1, 65535)
    return np.where(known, steps, 0).astype(np.uint16)


def decode_disparity(codes: Codes) -> Array:
    """(H, W) px, nan where unknown."""
    return np.where(codes > 0, codes / STEPS, np.nan)
