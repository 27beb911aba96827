"""Sequences whose pictures are kept in memory, so that neither rendering nor decoding is timed or repeated."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import partial

from sim.types import Frame
from sim.types import Sequence as Recording


def in_memory(sequence: Recording, *, with_background: bool = True) -> Recording:
    """Returns the sequence with all frames made once; with_background: its background sample is made once, too."""
    frames = tuple(sequence.frames())
    kept = replace(sequence, frames=partial(_again, frames))
    if not with_background:
        return kept
    sample = sequence.background()
    assert sample is not None, "a sequence with pictures has a background"
    return replace(kept, load_background=lambda: sample)


def _again(frames: Sequence[Frame]) -> Iterator[Frame]:
    return iter(frames)
