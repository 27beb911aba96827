"""The sample of frames that a background model is trained on: which frames of a recording, and in words."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np

from scenarios.errors import InputError
from sim.types import Image

FRAMES = 50
OWN = f"{FRAMES} empty frames before frame 1"


@dataclass(frozen=True)
class Choice:
    """Which frames: the first `count`, or `count` spread over the recording; `asked` for, or taken by default."""

    how: Literal["first", "spread"] = "spread"
    count: int = FRAMES
    asked: bool = False

    def __str__(self) -> str:
        """In words, as run.json has it."""
        return self.words(self.count)

    def words(self, count: int) -> str:
        """In words, where `count` frames could be had."""
        if self.how == "first":
            return f"first {count} frames"
        return f"{count} frames spread over the recording (not causal)"

    def indices(self, length: int) -> list[int]:
        """The frames (1-based, ascending) of a recording so long; all of a shorter one."""
        if self.how == "first" or length <= self.count:
            return list(range(1, min(self.count, length) + 1))
        return [int((k + 0.5) * length / self.count) + 1 for k in range(self.count)]


def read_choice(text: str | None) -> Choice:
    """`first:N` or `spread:N`; None is spread:50, not asked for."""
    if text is None:
        return Choice()
    found = re.fullmatch(r"(first|spread):([0-9]{1,6})", text)
    if found is None or int(found[2]) < 1:
        raise InputError(
            place="--background", got=text, expected="first:N or spread:N, N frames", remedy="for instance first:50"
        )
    return Choice("first" if found[1] == "first" else "spread", int(found[2]), True)


def stacked(pictures: Iterable[Image], path: Path) -> Image:
    """(K, H, W, 3); InputError where no picture of the sample could be read."""
    found = list(pictures)
    if not found:
        raise InputError(
            file=path, got="no readable picture in the background sample", expected="one at least",
            remedy="choose others: --background first:N or spread:N",
        )  # fmt: skip
    return np.stack(found)
