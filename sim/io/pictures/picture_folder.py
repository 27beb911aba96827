"""Pictures of a recording: read from files, in their slots, all of one size."""

from __future__ import annotations

import re
import warnings
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from scenarios.errors import InputError
from sim.types import Image

SUFFIXES = (".jpg", ".jpeg", ".png", ".bmp", ".tif", ".tiff")
Picture = TypeVar("Picture", bound=NDArray[Any])
SPARSE = 100  # numbers in names that leave more than 99 of 100 out are no frames (time stamps)


def fill_gaps(pairs: Iterable[tuple[int, Image]], length: int | None, place: str) -> Iterator[Image | None]:
    """A picture for each frame, None for those of `pairs` (frame, picture) that are not there; these are told once."""
    shown, told = 0, False
    for number, picture in pairs:
        for lost in range(shown + 1, number):
            told = told or _warn_lost(place, lost)
            yield None
        shown = max(shown, number)
        yield picture
    for lost in range(shown + 1, (length or 0) + 1):
        told = told or _warn_lost(place, lost)
        yield None


def _warn_lost(place: str, frame: int) -> bool:
    text = f"{place}: frame {frame} has no readable picture; it and any others like it are lost frames"
    warnings.warn(text, stacklevel=3)
    return True


def size_of(picture: NDArray[Any]) -> tuple[int, int]:
    """Width and height."""
    return picture.shape[1], picture.shape[0]


def require_size(picture: Picture, size: tuple[int, int], path: Path, place: str = "") -> Picture:
    """The picture; InputError where it is not of the recording's size."""
    if size_of(picture) != size:
        got, expected = "{}×{} px".format(*size_of(picture)), "{}×{} px like the first".format(*size)
        raise InputError(file=path, place=place, got=got, expected=expected, remedy="give pictures of one size")
    return picture


def read_picture(path: Path) -> Image | None:
    """(H, W, 3) BGR, None where the file is missing, cut off or no picture.

    Grey becomes BGR, 16 bits become the upper 8 of them (0 to 65535 is the full range), transparency is left out.
    """
    import cv2

    try:
        body = path.read_bytes()
    except OSError:
        return None
    if not is_complete(body):
        return None
    level = cv2.utils.logging.setLogLevel(cv2.utils.logging.LOG_LEVEL_SILENT)
    try:
        picture = cv2.imdecode(np.frombuffer(body, np.uint8), cv2.IMREAD_COLOR)
    except cv2.error:
        return None
    finally:
        cv2.utils.logging.setLogLevel(level)
    return None if picture is None else np.asarray(picture, np.uint8)


def is_complete(body: bytes) -> bool:
    """Whether a JPEG or PNG goes on to its end; older decoders give half a picture, and libraries grumble on stderr."""
    if body.startswith(b"\xff\xd8"):
        return body.rfind(b"\xff\xd9") > body.rfind(b"\xff\xda") > 0
    return b"IEND" in body[-64:] if body.startswith(b"\x89PNG") else len(body) > 0


@dataclass(frozen=True)
class PictureFolder:
    """Pictures by frame (1-based), and the last frame that their names speak of."""

    folder: Path
    files: dict[int, Path]

    @property
    def last(self) -> int:
        """The highest frame."""
        return max(self.files, default=0)

    def first_size(self) -> tuple[int, int] | None:
        """Size of the first picture that can be read, None where none can."""
        found = (read_picture(path) for path in self.files.values())
        return next((size_of(picture) for picture in found if picture is not None), None)

    def read(self, frames: Iterable[int], size: tuple[int, int] | None) -> Iterator[tuple[int, Image]]:
        """(frame, picture) of those that can be read; InputError where no file of the folder can, or sizes differ."""
        if size is None:
            raise InputError(
                file=self.folder, got=f"{len(self.files)} pictures, none of which can be read", expected="JPG or PNG",
                remedy="restore the files",
            )  # fmt: skip
        for k in frames:
            picture = read_picture(self.files[k]) if k in self.files else None
            if picture is not None:
                yield k, require_size(picture, size, self.files[k])


def find_pictures(folder: Path, length: int | None, labelled: bool) -> PictureFolder:
    """The pictures of a folder by the numbers that their names end with, by the order of names that have none.

    Numbers are frames. They are counted from the lowest where that is 0, where they go beyond `length`, or where
    nothing else speaks of frames (no `length`, not `labelled`).
    """
    found = sorted(p for p in folder.iterdir() if p.suffix.lower() in SUFFIXES) if folder.is_dir() else []
    numbers = [_number(path) for path in found]
    if not found or None in numbers or len({str(p.with_suffix(""))[: -len(_digits(p))] for p in found}) > 1:
        return PictureFolder(folder, dict(enumerate(found, 1)))
    known = [n for n in numbers if n is not None]
    low, high = min(known), max(known)
    if high - low >= SPARSE * len(known):
        return PictureFolder(folder, dict(enumerate(found, 1)))
    beyond = length is not None and high > length
    shift = 1 - low if low == 0 or beyond or (length is None and not labelled) else 0
    files: dict[int, Path] = {}
    for number, path in sorted(zip(known, found, strict=True)):
        if number + shift in files:
            got = f"{files[number + shift].name} and {path.name}"
            raise InputError(file=folder, got=got, expected="one picture of each frame", remedy="remove one of the two")
        files[number + shift] = path
    return PictureFolder(folder, files)


def _digits(path: Path) -> str:
    found = re.search(r"[0-9]+$", path.stem)
    return found[0] if found else ""


def _number(path: Path) -> int | None:
    return int(_digits(path)) if _digits(path) else None
