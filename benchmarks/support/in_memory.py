"""Sequences whose pictures are kept in memory, so that neither rendering nor decoding is timed or repeated."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import partial

from sim.types import Frame, Truth
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


def people_in_view(live: Recording, length: int) -> Recording:
    """Returns the first `length` frames of a simulated sequence with their pictures in memory, and `truth_in_view`."""
    frames = tuple(frame for frame in live.frames() if frame.index <= length)
    in_view = truth_in_view(live, len(frames))
    return replace(
        live, length=len(frames), frames=partial(_again, frames), load_truth=lambda: in_view, bare=None,
        load_pixels=None,
    )  # fmt: skip


def truth_in_view(live: Recording, length: int) -> Truth:
    """Returns the truth of the first `length` frames without people more than half outside the image, without groups
    and events."""
    truth = live.truth
    assert truth is not None
    assert truth.truncation is not None
    keep = (truth.frame <= length) & (truth.truncation < 0.5)
    columns = ("frame", "id", "group", "pos", "vel", "box", "visibility", "z", "heading", "height", "truncation")
    cut = {k: getattr(truth, k)[keep] for k in (*columns, "visible_box") if getattr(truth, k) is not None}
    none = {"groups": None, "groups_px": None, "labelled": None, "events": None, "near": None, "orders": ()}
    return truth.replace(length=length, **cut, **none)


def _again(frames: Sequence[Frame]) -> Iterator[Frame]:
    return iter(frames)
