"""Pictures of a recording as files in a folder: which file is which frame, reading them, gaps, and equal sizes.

Pictures are often numbered from 0, from the middle of a longer recording, or with gaps. Labels are then numbered like
the files, or from 1 in the order of the pictures. The labelled frames decide which. Where both are possible, the user
is asked, because nobody notices pictures that are shifted against their labels. The size that a file declares is read
before the picture is decoded, since a file of some kilobytes may declare a picture that fills the memory.
"""

from __future__ import annotations

import io
import os.path
import re
import warnings
from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from itertools import chain
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from scenarios.errors import InputError, reject
from scenarios.limits import FRAMES, fits_picture
from scenarios.reading import is_present
from sim.store.own_files import is_hidden
from sim.types import Image, Ints


def declared_size(body: bytes) -> tuple[int, int] | None:
    """Returns the (width, height) px that the header of a picture file states; None if there is no such header."""
    from PIL import Image as Pictures

    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of large pictures
            return Pictures.open(io.BytesIO(body), formats=FORMATS).size
    except (OSError, ValueError, SyntaxError, Pictures.DecompressionBombError):
        return None


FORMATS = ("JPEG", "PNG", "BMP", "TIFF")
RENAME = "rename the pictures"
SPARSE = 100  # numbers in file names that use less than 1 of 100 values are time stamps, not frames

# returns the labelled frames, ascending, each once; called only where they decide something
Labelled = Callable[[], Ints]

# the words and the numbers of a file name without suffix, in the order in which they alternate
Key = tuple[tuple[str, ...], tuple[int, ...]]


@dataclass(frozen=True)
class Numbering:
    """How the number of a picture becomes its frame (from 1): frame = (number - origin) / step + 1."""

    origin: int = 1  # the number of frame 1
    step: int = 1  # between the numbers of successive frames


def numbering_of(folder: Path, files: list[Path], length: int | None, labelled: Labelled | None) -> Numbering | None:
    """Returns how numbers in file names become frames; None if files are frames in the natural order of their names.

    length: number of frames, None if unknown. labelled: returns the labelled frames; None without labels. Raises
    InputError if pictures and labels can be matched in two ways or in none. Warns if pictures with labels are not taken
    by their numbers.
    """
    keys = [_key(path) for path in files]
    _refuse_odd_names(folder, files, keys)
    numbers = _numbers(keys)
    if numbers is None:
        if files and labelled is not None:
            _say(folder, "pictures without a frame number in their names", "in the order of their names")
        return None
    found = np.unique(numbers)
    low, high = int(found[0]), int(found[-1])
    labels = np.zeros(0, np.int64) if labelled is None or len(found) == high == low + len(found) - 1 else labelled()
    if len(labels):
        return _labelled_numbering(folder, found, length, labels)
    steps = np.unique(np.diff(found))
    if length == len(found) and len(steps) == 1:
        return Numbering(low, int(steps[0]))
    # Without labels, nothing says what the numbers are, but their lowest and highest.
    free = length is None and labelled is None
    if free and len(steps) == 1 and steps[0] > 1:
        frames = f"1 to {len(found)}; --fps is that of these pictures"
        _say(folder, f"pictures {low} to {high} in steps of {steps[0]}", frames)
        return Numbering(low, int(steps[0]))
    return Numbering(low if low == 0 or free or (length is not None and high > length) else 1)


def frames_of(folder: Path, files: list[Path], numbering: Numbering | None) -> dict[int, Path]:
    """Returns the picture file of each frame (from 1), ascending; a frame without a picture has no entry."""
    keys = [_key(path) for path in files]
    if numbering is None:
        ordered = sorted(zip(keys, files, strict=True), key=lambda pair: (*pair[0], pair[1]))
        return {frame: path for frame, (_, path) in enumerate(ordered, 1)}
    numbers = _numbers(keys)
    if files and numbers is None:
        raise _wrong(folder, files[0].name, "names with frame numbers")
    found: dict[int, Path] = {}
    expected = f"frames up to {FRAMES}, numbered from {numbering.origin} in steps of {numbering.step}"
    for number, path in sorted(zip(numbers or (), files, strict=True)):
        before, rest = divmod(number - numbering.origin, numbering.step)
        if before + 1 in found:
            got = f"{found[before + 1].name} and {path.name}"
            raise _wrong(folder, got, "one picture of each frame", "remove one of the two")
        reject(rest or not 0 <= before < FRAMES, folder, path.name, expected, RENAME)
        found[before + 1] = path
    return found


def _wrong(folder: Path, got: str, expected: str, remedy: str = RENAME) -> InputError:
    return InputError(file=folder, got=got, expected=expected, remedy=remedy)


def _key(path: Path) -> Key:
    parts = re.split(r"([0-9]+)", path.stem)
    return tuple(parts[::2]), tuple(int(part) for part in parts[1::2])


def _refuse_odd_names(folder: Path, files: list[Path], keys: list[Key]) -> None:
    counts = Counter(words for words, numbers in keys if numbers).most_common(1)
    usual, odd = list[str](), list[str]()
    for path, (words, _) in zip(files, keys, strict=True):
        (usual if counts and words == counts[0][0] else odd).append(path.name)
    if len(usual) > 1 and odd:
        more = f" and {len(odd) - 1} more" if len(odd) > 1 else ""
        got, expected = f"{odd[0]}{more} beside {usual[0]}", "names that differ in their numbers only"
        raise _wrong(folder, got, expected, "move copies and other pictures elsewhere")


def _numbers(keys: list[Key]) -> list[int] | None:
    if not keys or len({words for words, _ in keys}) > 1 or not keys[0][1]:
        return None
    columns = list(zip(*(numbers for _, numbers in keys), strict=True))
    varying = [column for column in columns if len(set(column)) > 1]
    found = (varying or columns[-1:])[0]
    stamps = len(varying) > 1 or max(found) - min(found) >= SPARSE * len(found)
    return None if stamps else list(found)


def _labelled_numbering(folder: Path, found: Ints, length: int | None, labels: Ints) -> Numbering:
    low, high, first, last = int(found[0]), int(found[-1]), int(labels[0]), int(labels[-1])
    span, count, steps = high - low + 1, len(found), np.unique(np.diff(found))
    beyond = length is not None and high > length
    # Each labelled frame has the picture of its number.
    if low > 0 and not beyond and np.isin(labels, found).all():
        return Numbering()
    # Pictures in even steps, labels counted in order.
    if len(steps) == 1 and steps[0] > 1 and last <= count:
        _say(folder, f"pictures {low} to {high} in steps of {steps[0]}", f"1 to {count}, as the labels are numbered")
        return Numbering(low, int(steps[0]))
    # Labels end with the last picture, or before the first number: counted from the first.
    if low != 1 and (last == span or (last < span and (last < low or (low > 0 and beyond)))):
        _say(folder, f"pictures {low} to {high}", f"1 to {span}, as the labels are numbered")
        return Numbering(low)
    # Both readings are possible.
    doubtful = low == 0 or (low > 1 and last <= span) or (low == 1 and last == count < span)
    doubtful = doubtful or last < low or first > high
    got = f"{count} pictures numbered {low} to {high}, and labels of frames {first} to {last}"
    remedy = f"{RENAME}: each gets the number of its labels, from 000001"
    reject(doubtful, folder, got, "pictures and labels with the same numbers", remedy)
    return Numbering()


def _say(folder: Path, pictures: str, frames: str) -> None:
    warnings.warn(f"{folder}: {pictures} are taken as frames {frames}", stacklevel=5)


SUFFIXES = (".jpg", ".jpeg", ".png", ".bmp", ".tif", ".tiff")
Picture = TypeVar("Picture", bound=NDArray[Any])


def fill_gaps(pairs: Iterable[tuple[int, Image]], length: int | None, place: str) -> Iterator[Image | None]:
    """Yields the picture of each frame from 1 to `length`, or None for a frame that is not in `pairs`.

    pairs: (frame, picture), ascending. length: None means up to the last pair. The first missing frame causes a
    warning, which names the recording as `place`.
    """
    shown, warned = 0, False
    # The end is a last pair without a picture.
    for number, picture in chain(pairs, [((length or 0) + 1, None)]):
        for lost in range(shown + 1, number):
            if not warned:
                text = f"{place}: frame {lost} has no readable picture; it and any others like it are lost frames"
                warnings.warn(text, stacklevel=2)
            warned = True
            yield None
        shown = max(shown, number)
        if picture is not None:
            yield picture


def size_of(picture: NDArray[Any]) -> tuple[int, int]:
    """Returns (width, height) in px of a picture of shape (H, W) or (H, W, 3)."""
    return picture.shape[1], picture.shape[0]


def require_size(picture: Picture, size: tuple[int, int], path: Path, place: str = "") -> Picture:
    """Returns the picture unchanged if its (width, height) is `size`, else raises InputError."""
    got, expected = "{}×{} px".format(*size_of(picture)), "{}×{} px like the first".format(*size)
    reject(size_of(picture) != size, path, got, expected, "give pictures of one size", place)
    return picture


def read_picture(path: Path) -> Image | None:
    """Returns a picture file as (H, W, 3) BGR uint8; None if it is missing, damaged, too large or of another kind."""
    import cv2

    try:
        body = path.read_bytes()
    except OSError:
        return None
    size = declared_size(body)
    # Some decoders return half a picture of a truncated file, or print to stderr.
    if not is_complete(body) or size is None or not fits_picture(*size):
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
    """Returns True unless a picture file's bytes are empty, or are a JPEG or PNG without the mark of its end."""
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
        """Yields (frame, picture) of `frames` whose picture can be read; InputError if its size is another."""
        if size is None:
            got = f"{len(self.files)} pictures, none of which can be read"
            raise _wrong(self.folder, got, "JPG or PNG", "restore the files")
        for k in frames:
            picture = read_picture(self.files[k]) if k in self.files else None
            if picture is not None:
                yield k, require_size(picture, size, self.files[k])


def find_pictures(folder: Path, length: int | None, labelled: Labelled | None) -> PictureFolder:
    """Returns the picture files of a folder by frame; `numbering_of` decides which frame a file is.

    length: number of frames, None if unknown. labelled: a function that returns the labelled frames; None without
    labels.
    """
    files = _picture_files(folder)
    numbering = numbering_of(folder, files, length, labelled)
    return PictureFolder(folder, frames_of(folder, files, numbering), numbering)


def find_right_pictures(folder: Path, left: PictureFolder) -> PictureFolder:
    """Returns the picture files of the right camera by frame, numbered like those of the left one."""
    files = _picture_files(folder)
    unlike = files and left.numbering is None and len(files) != len(left.files)
    got, expected = f"{len(files)} pictures without numbers", f"{len(left.files)}, as in {left.folder.name}"
    reject(unlike, folder, got, expected, "number the pictures of both cameras")
    return PictureFolder(folder, frames_of(folder, files, left.numbering), left.numbering)


def _picture_files(folder: Path) -> list[Path]:
    if not os.path.isdir(folder):
        return []
    found = sorted(p for p in folder.iterdir() if p.suffix.lower() in SUFFIXES and not is_hidden(p))
    for path in found:
        is_present(path)  # refuses a FIFO; a dead link keeps its place, as a lost frame
    return found
