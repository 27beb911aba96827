"""A sequence's pictures as a video for its replay page: inside the page, or a file beside it."""

from __future__ import annotations

import base64
import os
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal
from urllib.parse import quote

import numpy as np

from scenarios.errors import InputError
from sim.io.files.atomic import staged_path
from sim.io.pictures.video_encoding import rate_of, write_video
from sim.types import Image, Sequence

Video = Literal["auto", "inside", "beside", "none"]
LARGE = 12_000_000
"""bytes: a video from this size on stands beside the page, unless it is to be inside."""

QUALITY = 23
GREY = 128


@dataclass(frozen=True)
class Film:
    """A video with one picture for each frame. source: its address for the page, "" where it is inside (base64).

    lost: frames that have no picture; the one before stands still.
    """

    source: str
    inside: str
    fps: float
    lost: tuple[int, ...] = ()

    def facts(self) -> dict[str, Any]:
        """What the page is told."""
        return {"src": self.source, "fps": self.fps, "lost": self.lost}


def film(
    sequence: Sequence, page: Path, video: Video = "auto", step: Callable[[str], None] = lambda _: None
) -> Film | None:
    """The pictures of a sequence as a video for a page, FILE.view.mp4 beside FILE.html where it is not to be inside.

    FILE.mp4 may be an overlay, or the source itself. None where there are no pictures, or none are wanted. step: called
    after each.
    """
    if video == "none" or not sequence.has_images:
        return None
    beside = page.with_suffix(".view.mp4")
    refuse_source(sequence, beside)
    rate = float(rate_of(sequence.fps))
    with staged_path(beside) as partial:
        lost = encode(sequence, partial, step)
        if video == "inside" or (video == "auto" and partial.stat().st_size < LARGE):
            return Film("", base64.b64encode(partial.read_bytes()).decode(), rate, lost)
        os.replace(partial, beside)
    return Film(quote(beside.name), "", rate, lost)


def refuse_source(sequence: Sequence, path: Path) -> None:
    """InputError where a path is the very file that the sequence is read from."""
    source = sequence.source.get("path")
    if source is not None and path.exists() and path.samefile(source):
        raise InputError(file=path, place="--out", got="the source itself", expected="another file", remedy="rename it")


def encode(sequence: Sequence, path: Path, step: Callable[[str], None]) -> tuple[int, ...]:
    """Write the pictures to an MP4; the frames that have none."""
    assert sequence.image_size is not None, "pictures have a size"
    width, height = sequence.image_size
    last: Image = np.full((height, width, 3), GREY, np.uint8)
    lost = []
    with write_video(path, (width + width % 2, height + height % 2), sequence.fps, QUALITY) as film:
        for frame in sequence:
            if frame.image is None:
                lost.append(frame.index)
            else:
                last = frame.image
            film.add(even(last))
            step(sequence.name)
    return tuple(lost)


def even(picture: Image) -> Image:
    """With a row or column repeated where H.264 wants an even number."""
    odd = [(0, picture.shape[axis] % 2) for axis in (0, 1)]
    return np.pad(picture, (*odd, (0, 0)), mode="edge") if any(more for _, more in odd) else picture
