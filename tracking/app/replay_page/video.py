"""The pictures of a sequence as a video for its replay page: inside the page, or a file beside it."""

from __future__ import annotations

import base64
import os
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np

from scenarios.errors import InputError
from sim.pictures.video_files import rate_of, write_video
from sim.store.atomic import staged_path
from sim.store.own_files import GENERATOR, address, refuse_foreign_file
from sim.types import Frame, Image, Sequence

VideoPlacement = Literal["auto", "inside", "beside", "none"]
LARGE = 12_000_000  # bytes: with "auto", a video of this size or more is written beside the page.

QUALITY = 23  # x264's constant rate factor.

GREY = 128


@dataclass(frozen=True)
class PageVideo:
    """A video with one picture per frame."""

    address: str  # relative to the page, "" if the video is inside it
    content: str  # the bytes in base64 if inside, else ""
    fps: float
    lost: tuple[int, ...] = ()  # frames (from 1) without a picture, which show the picture before

    def facts(self) -> dict[str, Any]:
        """Returns the video's entry in the page's data."""
        return {"src": self.address, "fps": self.fps, "lost": self.lost}


def page_video(
    sequence: Sequence, page: Path, placement: VideoPlacement = "auto", step: Callable[[str], None] = lambda _: None
) -> PageVideo | None:
    """Makes the video for the page FILE.html and returns it; None without pictures, or if placement is "none". A video
    beside the page is written as FILE.view.mp4; "auto" puts it inside the page if it is small."""
    if placement == "none" or not sequence.has_images:
        return None
    beside = page.with_suffix(".view.mp4")  # FILE.mp4 may be an overlay, or the source itself
    refuse_source(sequence, beside)
    rate = float(rate_of(sequence.fps))
    with staged_path(beside) as partial:
        lost = _encode(sequence, partial, step)
        if placement == "inside" or (placement == "auto" and partial.stat().st_size < LARGE):
            return PageVideo("", base64.b64encode(partial.read_bytes()).decode(), rate, lost)
        refuse_foreign_file(beside)
        os.replace(partial, beside)
    return PageVideo(address(Path(beside.name)), "", rate, lost)


def refuse_source(sequence: Sequence, path: Path) -> None:
    """Raises InputError if `path` is the existing file that the sequence is read from; else returns nothing."""
    source = sequence.source.get("path")
    if source is not None and path.exists() and path.samefile(source):
        raise InputError(file=path, place="--out", got="the source itself", expected="another file", remedy="rename it")


def _encode(sequence: Sequence, path: Path, step: Callable[[str], None]) -> tuple[int, ...]:
    """Writes the pictures as MP4 at `path` and returns the frames (from 1) without a picture."""
    assert sequence.image_size is not None, "pictures have a size"
    width, height = sequence.image_size
    lost = []
    with write_video(path, (width + width % 2, height + height % 2), sequence.fps, QUALITY, GENERATOR) as video:
        for frame, picture in shown_pictures(sequence):
            lost += [frame.index] if frame.image is None else []
            video.add(even_size(picture))
            step(sequence.name)
    return tuple(lost)


def shown_pictures(sequence: Sequence) -> Iterator[tuple[Frame, Image]]:
    """Yields each frame with its picture; a frame without a picture gets the previous one, or a grey one at first."""
    assert sequence.image_size is not None, "pictures have a size"
    last: Image = np.full((*sequence.image_size[::-1], 3), GREY, np.uint8)
    for frame in sequence:
        last = last if frame.image is None else frame.image
        yield frame, last


def even_size(picture: Image) -> Image:
    """Returns the picture (H, W, 3) with its last row or column repeated where H or W is odd."""
    odd = [(0, picture.shape[axis] % 2) for axis in (0, 1)]
    return np.pad(picture, (*odd, (0, 0)), mode="edge") if any(more for _, more in odd) else picture
