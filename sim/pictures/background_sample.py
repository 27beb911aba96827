"""The sample of a recording's frames on which a background model is trained: choosing the frames and reading them.

A picture of the empty place is added to the sample so often that it has the majority at each pixel; the frames still
show how large people are, and the noise.
"""

from __future__ import annotations

import re
import warnings
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal

import numpy as np

from scenarios.errors import InputError, reject
from scenarios.limits import SAMPLE_BYTES
from sim.pictures.picture_folder import SUFFIXES, read_picture, size_of
from sim.types import BACKGROUNDS, Image


@dataclass(frozen=True)
class BackgroundChoice:
    """Which frames of a recording are the sample for a background model."""

    # "first" for the first `count` frames, "spread" for `count` frames spread evenly over the recording, "learn" for at
    # most 50 frames spread evenly over the first `count`, in which nobody is tracked
    how: Literal["first", "spread", "learn"] = "spread"
    count: int = BACKGROUNDS  # 1 or more, by default 50
    asked: bool = False  # True if the user gave --background, False for the default
    picture: Path | None = None  # of the empty place

    def __str__(self) -> str:
        """Returns the text that run.json holds, as "first 50 frames (causal from frame 50)"."""
        if self.picture is not None:
            return f"{self.picture.name} and {replace(self, picture=None)}"
        if self.how == "first":
            return f"first {self.count} frames (causal from frame {self.count})"
        if self.how == "learn":
            return f"learned in the first {self.count} frames"
        return f"{self.count} frames spread over the recording (not causal)"

    def of(self, length: int, path: Path, size: tuple[int, int] | None = None) -> BackgroundChoice:
        """Returns the choice for a recording of `length` frames, with as many frames as it has and 2 GB can hold.

        size: (width, height) px; None if unknown. Raises InputError if the user asked for more frames (`asked`), or if
        the picture of the empty place cannot be used.
        """
        width, height = size or (1, 1)
        most = max(1, SAMPLE_BYTES // (3 * width * height))
        if self.picture is not None:
            most = max(1, most // 2)
            self.empty(size)
        if self.count <= min(length, most):
            return self
        got = f"a recording of {length} frames" if length < self.count else f"pictures of {width}×{height} px"
        remedy = f"ask for {min(length, most)} or fewer, or give a longer recording"
        reject(self.asked, path, got, f"{self.count} or more that fit into 2 GB", remedy, "--background")
        return replace(self, count=min(self.count, length, most))

    def empty(self, size: tuple[int, int] | None) -> Image:
        """Returns the picture of the empty place; InputError if it cannot be read or has another size than `size`."""
        assert self.picture is not None
        picture = read_picture(self.picture)
        if picture is not None and size in (None, size_of(picture)):
            return picture
        got = "no picture that can be read" if self.picture.is_file() else "no such file"
        expected, remedy = "a JPG or PNG of the empty place", "check the path, or store the picture anew"
        if picture is not None:
            got, expected = "{}×{} px".format(*size_of(picture)), "{}×{} px, as the recording".format(*size or ())
            remedy = "give a picture of the same camera in the same size"
        raise InputError(file=self.picture, place="--background", got=got, expected=expected, remedy=remedy)

    def indices(self, length: int) -> list[int]:
        """Returns the frames of the sample, from 1 and ascending, of a recording of `length` frames."""
        if self.how == "learn":
            return replace(self, how="spread", count=min(BACKGROUNDS, self.count)).indices(self.count)
        # Else the middle frame of each of `count` equal parts.
        if self.how == "first" or length <= self.count:
            return list(range(1, min(self.count, length) + 1))
        return [int((k + 0.5) * length / self.count) + 1 for k in range(self.count)]


def parse_choice(text: str | None) -> BackgroundChoice:
    """Returns the choice that --background names: "first:N", "learn:N", "spread:N" or a picture's path; None: the
    default."""
    if text is None:
        return BackgroundChoice()
    found = re.fullmatch(r"(first|spread|learn):([0-9]{1,6})", text)
    if found is None and Path(text).suffix.lower() in SUFFIXES:
        return BackgroundChoice(picture=Path(text))
    if found is None or int(found[2]) < 1:
        expected = "first:N, learn:N or spread:N, N frames, or a picture (JPG, PNG)"
        raise InputError(place="--background", got=text, expected=expected, remedy="for instance first:50")
    how: Any = found[1]
    return BackgroundChoice(how, int(found[2]), True)


@dataclass(frozen=True)
class BackgroundSample:
    """The sample of one recording's frames for a background model; calling it reads the pictures."""

    choice: BackgroundChoice  # which frames
    length: int  # number of frames of the recording
    path: Path  # the recording, for messages
    # called with ascending frames (from 1), it yields (frame, picture) for those of them that can be read
    pictures: Callable[[list[int]], Iterable[tuple[int, Image]]]

    def __call__(self) -> Image:
        """Returns the pictures (K, H, W, 3) in the order of frames, without those that cannot be read.

        A picture of the empty place follows them.
        """
        wanted, count = self.choice.indices(self.length), 0
        for count, (_, picture) in enumerate(self.pictures(wanted), 1):  # no second copy: 0.3 GB at 1920×1080
            if count == 1:
                found = np.empty((len(wanted), *picture.shape), np.uint8)
            found[count - 1] = picture
        remedy = "choose other frames: --background first:N or spread:N"
        reject(not count, self.path, "no readable picture in the background sample", "at least one", remedy)
        if 2 * count < len(wanted):
            words = f"only {count} of the {len(wanted)} frames of the background sample have a readable picture"
            remedy = "number the pictures 1, 2, 3, …, or choose other frames with --background"
            warnings.warn(f"{self.path}: {words}; {remedy}", stacklevel=2)
        found = found[:count]
        return found if self.choice.picture is None else with_copies(found, self.choice.empty(size_of(found[0])))


@dataclass(frozen=True)
class GivenSample:
    """Pictures (K, H, W, 3) for a background model, chosen before. choice: as of `BackgroundSample`, or None."""

    choice: BackgroundChoice | None
    pictures: Image

    def __call__(self) -> Image:
        """Returns the pictures."""
        return self.pictures


def untracked_frames(load: object) -> int:
    """Returns the number of first frames in which nobody is tracked, as a background is learned. load: what loads the
    sample of a sequence."""
    choice = load.choice if isinstance(load, BackgroundSample | GivenSample) else None
    return choice.count if choice is not None and choice.how == "learn" else 0


def with_copies(sample: Image, empty: Image) -> Image:
    """Returns a sample (K, H, W, 3) and K + 1 copies of `empty`, which is then the majority at each pixel."""
    return np.concatenate([sample, np.broadcast_to(empty, (len(sample) + 1, *empty.shape))])
