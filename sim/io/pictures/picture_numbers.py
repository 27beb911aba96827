"""Which frame each picture file of a recording is: by the number in its name, checked against the labelled frames.

Pictures are often numbered from 0, from the middle of a longer recording, or with gaps. Labels are then numbered like
the files, or from 1 in the order of the pictures. The labelled frames decide which. Where both are possible, the user
is asked, because nobody notices pictures that are shifted against their labels.
"""

from __future__ import annotations

import re
import warnings
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from scenarios.errors import InputError
from scenarios.limits import FRAMES
from sim.types import Ints

SPARSE = 100
"""Numbers in file names that use less than 1 of 100 values are time stamps, not frames."""

Labelled = Callable[[], Ints]
"""Returns the labelled frames, ascending, each once; called only where they decide something."""

Key = tuple[tuple[str, ...], tuple[int, ...]]
"""The words and the numbers of a file name without suffix, in the order in which they alternate."""


@dataclass(frozen=True)
class Numbering:
    """How picture numbers become frames: frame = (number - origin) / step + 1.

    origin: the number of frame 1. step: between the numbers of successive frames.
    """

    origin: int = 1
    step: int = 1


def numbering_of(folder: Path, files: list[Path], length: int | None, labelled: Labelled | None) -> Numbering | None:
    """Return how the files' numbers become frames; None if files are frames in the natural order of their names.

    Files are in that order if their names have no number, or time stamps. Else, without labels, the lowest number is
    frame 1 if it is 0, if the highest exceeds `length`, or if `length` is None; otherwise the number is the frame.
    `length` pictures with a steady step are counted in order. With labels see `_labelled_numbering`.

    folder: for messages. length: number of frames, None if unknown. labelled: None without labels and detections.
    Raises InputError if most files are named alike and some otherwise, or if pictures and labels can be matched in two
    ways or in none. Warns if labelled pictures are not taken by their numbers.
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
    free = length is None and labelled is None
    return Numbering(low if low == 0 or free or (length is not None and high > length) else 1)


def frames_of(folder: Path, files: list[Path], numbering: Numbering | None) -> dict[int, Path]:
    """Return the picture file of each frame (from 1), ascending; a frame without a picture has no entry.

    folder: for messages. numbering: as of `numbering_of`. Raises InputError if two files are one frame, as 1.jpg and
    01.jpg, a file is no frame of that numbering, or a frame is beyond 1,000,000.
    """
    keys = [_key(path) for path in files]
    if numbering is None:
        ordered = sorted(zip(keys, files, strict=True), key=lambda pair: (*pair[0], pair[1]))
        return {frame: path for frame, (_, path) in enumerate(ordered, 1)}
    numbers = _numbers(keys)
    if files and numbers is None:
        raise InputError(
            file=folder, got=files[0].name, expected="names with frame numbers", remedy="rename the pictures"
        )
    found: dict[int, Path] = {}
    for number, path in sorted(zip(numbers or (), files, strict=True)):
        frame, rest = divmod(number - numbering.origin, numbering.step)
        frame += 1
        if frame in found:
            got = f"{found[frame].name} and {path.name}"
            raise InputError(file=folder, got=got, expected="one picture of each frame", remedy="remove one of the two")
        if rest or not 1 <= frame <= FRAMES:
            expected = f"frames up to {FRAMES}, numbered from {numbering.origin} in steps of {numbering.step}"
            raise InputError(file=folder, got=path.name, expected=expected, remedy="rename the pictures")
        found[frame] = path
    return found


def _key(path: Path) -> Key:
    parts = re.split(r"([0-9]+)", path.stem)
    return tuple(parts[::2]), tuple(int(part) for part in parts[1::2])


def _refuse_odd_names(folder: Path, files: list[Path], keys: list[Key]) -> None:
    """Raises InputError for names beside a series of numbered ones, as of copies: they would shift the frames."""
    counts = Counter(words for words, numbers in keys if numbers)
    if not counts:
        return
    usual, count = counts.most_common(1)[0]
    odd = [path.name for path, (words, _) in zip(files, keys, strict=True) if words != usual]
    if count > 1 and odd:
        example = next(path.name for path, (words, _) in zip(files, keys, strict=True) if words == usual)
        more = f" and {len(odd) - 1} more" if len(odd) > 1 else ""
        raise InputError(
            file=folder, got=f"{odd[0]}{more} beside {example}", expected="names that differ in their numbers only",
            remedy="move copies and other pictures elsewhere",
        )  # fmt: skip


def _numbers(keys: list[Key]) -> list[int] | None:
    """Returns the number of each name: the only one that varies, else the last; None if there is none, if several vary,
    or for time stamps."""
    if not keys or len({words for words, _ in keys}) > 1 or not keys[0][1]:
        return None
    columns = list(zip(*(numbers for _, numbers in keys), strict=True))
    varying = [column for column in columns if len(set(column)) > 1]
    if len(varying) > 1:
        return None
    found = list((varying or columns[-1:])[0])
    return None if max(found) - min(found) >= SPARSE * len(found) else found


def _labelled_numbering(folder: Path, found: Ints, length: int | None, labels: Ints) -> Numbering:
    """Returns the numbering by which labels fit pictures; found (P,), labels (L,): picture numbers and labelled frames,
    ascending, each once, not empty.

    The number is the frame if each labelled frame then has a picture. Otherwise pictures are counted in order if their
    numbers have a steady step and the labels would fit; or counted from the first, gaps included, if the labels end
    with the last picture, or before the first number. Otherwise the number is the frame, and labelled frames lack
    pictures.
    """
    low, high, first, last = int(found[0]), int(found[-1]), int(labels[0]), int(labels[-1])
    span, count, steps = high - low + 1, len(found), np.unique(np.diff(found))
    beyond = length is not None and high > length
    if low > 0 and not beyond and np.isin(labels, found).all():
        return Numbering()
    if len(steps) == 1 and steps[0] > 1 and last <= count:
        _say(folder, f"pictures {low} to {high} in steps of {steps[0]}", f"1 to {count}, as the labels are numbered")
        return Numbering(low, int(steps[0]))
    if low != 1 and (last == span or (last < span and (last < low or (low > 0 and beyond)))):
        _say(folder, f"pictures {low} to {high}", f"1 to {span}, as the labels are numbered")
        return Numbering(low)
    doubtful = low == 0 or (low > 1 and last <= span) or (low == 1 and last == count < span)
    if doubtful or last < low or first > high:
        raise InputError(
            file=folder, got=f"{count} pictures numbered {low} to {high}, and labels of frames {first} to {last}",
            expected="pictures and labels with the same numbers",
            remedy="rename the pictures: each gets the number of its labels, from 000001",
        )  # fmt: skip
    return Numbering()


def _say(folder: Path, pictures: str, frames: str) -> None:
    warnings.warn(f"{folder}: {pictures} are taken as frames {frames}", stacklevel=5)
