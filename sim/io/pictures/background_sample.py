"""The sample of a recording's frames on which a background model is trained: choosing the frames and reading them."""

from __future__ import annotations

import re
import warnings
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

import numpy as np

from scenarios.errors import InputError
from scenarios.limits import SAMPLE_BYTES
from sim.types import BACKGROUNDS, Image


@dataclass(frozen=True)
class BackgroundChoice:
    """Which frames of a recording are the sample for a background model.

    how: "first" for the first `count` frames, "spread" for `count` frames spread evenly over the recording. count: 1 or
    more, by default 50. asked: True if the user gave --background, False for the default.
    """

    how: Literal["first", "spread"] = "spread"
    count: int = BACKGROUNDS
    asked: bool = False

    def __str__(self) -> str:
        """Return the text that run.json holds, as "first 50 frames (causal from frame 50)".

        "causal" means that no frame of the sample follows the frame that is tracked. For "spread" the text is "50
        frames spread over the recording (not causal)".
        """
        if self.how == "first":
            return f"first {self.count} frames (causal from frame {self.count})"
        return f"{self.count} frames spread over the recording (not causal)"

    def of(self, length: int, path: Path, size: tuple[int, int] | None = None) -> BackgroundChoice:
        """Return the choice for a recording of `length` frames: itself if there are enough frames and they fit into 2
        GB.

        size: (width, height) of the pictures in px, None if unknown. A default choice is reduced to all `length` frames
        of a shorter recording, and to as many large pictures as fit. Raises InputError, naming the recording `path`, if
        the user asked for more frames than there are, or than fit.
        """
        width, height = size or (1, 1)
        most = max(1, SAMPLE_BYTES // (3 * width * height))
        if self.count <= min(length, most):
            return self
        if self.asked:
            got = f"a recording of {length} frames" if length < self.count else f"pictures of {width}×{height} px"
            raise InputError(
                file=path, place="--background", got=got, expected=f"{self.count} or more that fit into 2 GB",
                remedy=f"ask for {min(length, most)} or fewer, or give a longer recording",
            )  # fmt: skip
        return replace(self, count=min(self.count, length, most))

    def indices(self, length: int) -> list[int]:
        """Return the frames of the sample, from 1 and ascending, for a recording of `length` frames.

        A recording with at most `count` frames gives all of them. "first" takes the frames 1 to `count`, "spread" the
        middle frame of each of `count` equal parts.
        """
        if self.how == "first" or length <= self.count:
            return list(range(1, min(self.count, length) + 1))
        return [int((k + 0.5) * length / self.count) + 1 for k in range(self.count)]


def parse_choice(text: str | None) -> BackgroundChoice:
    """Return the choice that --background names: "first:N" or "spread:N", with N from 1 to 999,999.

    None gives the default, spread:50, which counts as not asked for. Raises InputError for any other text.
    """
    if text is None:
        return BackgroundChoice()
    found = re.fullmatch(r"(first|spread):([0-9]{1,6})", text)
    if found is None or int(found[2]) < 1:
        raise InputError(
            place="--background", got=text, expected="first:N or spread:N, N frames", remedy="for instance first:50"
        )
    return BackgroundChoice("first" if found[1] == "first" else "spread", int(found[2]), True)


@dataclass(frozen=True)
class BackgroundSample:
    """The sample of one recording's frames for a background model; calling it reads the pictures.

    choice: which frames. length: number of frames of the recording. path: the recording, for messages. pictures: called
    with ascending frames (from 1), it yields (frame, picture) for those of them that can be read.
    """

    choice: BackgroundChoice
    length: int
    path: Path
    pictures: Callable[[list[int]], Iterable[tuple[int, Image]]]

    def __call__(self) -> Image:
        """Return the pictures (K, H, W, 3) BGR uint8 in the order of frames; frames that cannot be read are left out.

        K is at most `choice.count`. Warns if a default sample covers the whole recording, because that is shorter than
        50 frames. Raises InputError if no picture can be read or their sizes differ.
        """
        wanted, count = self.choice.indices(self.length), 0
        for count, (_, picture) in enumerate(self.pictures(wanted), 1):  # no second copy: 0.3 GB at 1920×1080
            if count == 1:
                found = np.empty((len(wanted), *picture.shape), np.uint8)
            found[count - 1] = picture
        if not count:
            raise InputError(
                file=self.path, got="no readable picture in the background sample", expected="at least one",
                remedy="choose other frames: --background first:N or spread:N",
            )  # fmt: skip
        if self.length < BACKGROUNDS and not self.choice.asked:
            words = f"shorter than a background sample of {BACKGROUNDS} frames; all {self.length} are taken"
            warnings.warn(f"{self.path.name}: {words}", stacklevel=2)
        return found[:count]
