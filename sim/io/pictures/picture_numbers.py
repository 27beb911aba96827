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

SPARSE = 100  # numbers in file names that use less than 1 of 100 values are time stamps, not frames

# returns the labelled frames, ascending, each once; called only where they decide something
Labelled = Callable[[], Ints]

# the words and the numbers of a file name without suffix, in the order in which they alternate
Key = tuple[tuple[str, ...], tuple[int, ...]]


@dataclass(frozen=True)
class Numbering:
    """How picture numbers become frames: frame = (number - origin) / step + 1."""

    origin: int = 1  # the number of frame 1
    step: int = 1  # between the numbers of successive frames


def numbering_of(folder: Path, files: list[Path], length: int | None, labelled: Labelled | None) -> Numbering | None:
    """Returns how the files' numbers become frames; None if files are frames in the natural order of their names.

    length: number of frames, None if unknown. labelled: None without labels. Raises InputError if pictures and labels
    can be matched in two ways or in none; warns if labelled pictures are not taken by their numbers.
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
    return Numbering(low if low == 0 or free or (length is not None and high > length) else 1)


def frames_of(folder: Path, files: list[Path], numbering: Numbering | None) -> dict[int, Path]:
    """Returns the picture file of each frame (from 1), ascending; a frame without a picture has no entry."""
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
    if not keys or len({words for words, _ in keys}) > 1 or not keys[0][1]:
        return None
    columns = list(zip(*(numbers for _, numbers in keys), strict=True))
    varying = [column for column in columns if len(set(column)) > 1]
    if len(varying) > 1:
        return None
    found = list((varying or columns[-1:])[0])
    return None if max(found) - min(found) >= SPARSE * len(found) else found


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
    if doubtful or last < low or first > high:
        raise InputError(
            file=folder, got=f"{count} pictures numbered {low} to {high}, and labels of frames {first} to {last}",
            expected="pictures and labels with the same numbers",
            remedy="rename the pictures: each gets the number of its labels, from 000001",
        )  # fmt: skip
    return Numbering()


def _say(folder: Path, pictures: str, frames: str) -> None:
    warnings.warn(f"{folder}: {pictures} are taken as frames {frames}", stacklevel=5)
