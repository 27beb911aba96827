"""Pictures of a recording as files in a folder: which file is which frame, reading them, gaps, and equal sizes."""

from __future__ import annotations

import os.path
import warnings
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from scenarios.errors import InputError
from scenarios.regular_file import refuse_irregular
from sim.io.files.side_files import is_hidden
from sim.io.pictures.picture_header import is_bearable
from sim.io.pictures.picture_numbers import Labelled, Numbering, frames_of, numbering_of
from sim.types import Image

SUFFIXES = (".jpg", ".jpeg", ".png", ".bmp", ".tif", ".tiff")
Picture = TypeVar("Picture", bound=NDArray[Any])


def fill_gaps(pairs: Iterable[tuple[int, Image]], length: int | None, place: str) -> Iterator[Image | None]:
    """Yields the picture of each frame from 1 to `length`, None where the ascending `pairs` have none.

    length: None: up to the last pair. The first missing frame causes a warning about the recording `place`.
    """
    shown, warned = 0, False
    for number, picture in pairs:
        for lost in range(shown + 1, number):
            warned = warned or _warn_lost(place, lost)
            yield None
        shown = max(shown, number)
        yield picture
    for lost in range(shown + 1, (length or 0) + 1):
        warned = warned or _warn_lost(place, lost)
        yield None


def _warn_lost(place: str, frame: int) -> bool:
    text = f"{place}: frame {frame} has no readable picture; it and any others like it are lost frames"
    warnings.warn(text, stacklevel=3)
    return True


def size_of(picture: NDArray[Any]) -> tuple[int, int]:
    """Returns (width, height) in px of a picture of shape (H, W) or (H, W, 3)."""
    return picture.shape[1], picture.shape[0]


def require_size(picture: Picture, size: tuple[int, int], path: Path, place: str = "") -> Picture:
    """Returns the picture unchanged if its (width, height) is `size`, else raises InputError."""
    if size_of(picture) != size:
        got, expected = "{}×{} px".format(*size_of(picture)), "{}×{} px like the first".format(*size)
        raise InputError(file=path, place=place, got=got, expected=expected, remedy="give pictures of one size")
    return picture


def read_picture(path: Path) -> Image | None:
    """Returns a picture file as (H, W, 3) BGR uint8; None if it is missing, damaged, too large or of another kind."""
    import cv2

    try:
        body = path.read_bytes()
    except OSError:
        return None
    # Some decoders return half a picture of a truncated file, or print to stderr.
    if not is_complete(body) or not is_bearable(body):
        return None
    # A damaged picture is a lost frame, and no message of OpenCV.
    level = cv2.utils.logging.setLogLevel(cv2.utils.logging.LOG_LEVEL_SILENT)
    try:
        picture = cv2.imdecode(np.frombuffer(body, np.uint8), cv2.IMREAD_COLOR)
    except cv2.error:
        return None
    finally:
        cv2.utils.logging.setLogLevel(level)
    return None if picture is None else np.asarray(picture, np.uint8)


def is_complete(body: bytes) -> bool:
    """Returns False if a picture file's bytes are empty, or a JPEG or PNG without its end mark."""
    if body.startswith(b"\xff\xd8"):
        return body.rfind(b"\xff\xd9") > body.rfind(b"\xff\xda") > 0
    return b"IEND" in body[-64:] if body.startswith(b"\x89PNG") else len(body) > 0


@dataclass(frozen=True)
class PictureFolder:
    """The picture files of a recording."""

    folder: Path  # their folder
    # path of the file of each frame, by frame number (from 1); a frame without a picture has no entry. `last` is the
    # highest number, so frames without a picture below it are gaps.
    files: dict[int, Path]
    # how the numbers in the names became frames, None for files in the order of their names
    numbering: Numbering | None

    @property
    def last(self) -> int:
        """The highest frame (from 1) with a file; 0 without files."""
        return max(self.files, default=0)

    def first_size(self) -> tuple[int, int] | None:
        """Returns (width, height) px of the first picture that can be read; None if none can."""
        found = (read_picture(path) for path in self.files.values())
        return next((size_of(picture) for picture in found if picture is not None), None)

    def read(self, frames: Iterable[int], size: tuple[int, int] | None) -> Iterator[tuple[int, Image]]:
        """Yields (frame, picture) of those `frames` whose picture can be read, all of this size, in px."""
        if size is None:
            raise InputError(
                file=self.folder, got=f"{len(self.files)} pictures, none of which can be read", expected="JPG or PNG",
                remedy="restore the files",
            )  # fmt: skip
        for k in frames:
            picture = read_picture(self.files[k]) if k in self.files else None
            if picture is not None:
                yield k, require_size(picture, size, self.files[k])


def find_pictures(folder: Path, length: int | None, labelled: Labelled | None) -> PictureFolder:
    """Returns the picture files of a folder by frame; `picture_numbers` says which frame a file is.

    length: number of frames, None if unknown. labelled: returns the labelled frames, None without labels.
    """
    files = _picture_files(folder)
    numbering = numbering_of(folder, files, length, labelled)
    return PictureFolder(folder, frames_of(folder, files, numbering), numbering)


def find_right_pictures(folder: Path, left: PictureFolder) -> PictureFolder:
    """Returns the picture files of the right camera by frame, numbered like those of the left one."""
    files = _picture_files(folder)
    if files and left.numbering is None and len(files) != len(left.files):
        got, expected = f"{len(files)} pictures without numbers", f"{len(left.files)}, as in {left.folder.name}"
        raise InputError(file=folder, got=got, expected=expected, remedy="number the pictures of both cameras")
    return PictureFolder(folder, frames_of(folder, files, left.numbering), left.numbering)


def _picture_files(folder: Path) -> list[Path]:
    if not os.path.isdir(folder):
        return []
    found = sorted(p for p in folder.iterdir() if p.suffix.lower() in SUFFIXES and not is_hidden(p))
    for path in found:
        refuse_irregular(path)
    return found
