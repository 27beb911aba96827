"""Pixels per metre of an image: where the scale comes from, and the check that a tracker in the image has one.

Lengths in configs are metres. A tracker that works in the image plane multiplies them by this scale once, in `reset`.
Rules (docs/reference/formats.md): the camera's scale at the image centre, else the scale that the recording states,
else the median height of the given boxes of the first frames divided by 1.7 m (sim.scene.camera).
"""

from __future__ import annotations

from collections.abc import Iterable
from collections.abc import Sequence as SequenceOf
from dataclasses import dataclass

import numpy as np

from scenarios.errors import InputError
from scenarios.limits import is_number
from sim.scene.camera import scale_of_first_boxes
from sim.types import Array, Detections, Sequence, Tracks
from tracking.grouping.ground_of_boxes import LONGEST
from tracking.running.detection_mode import Given


@dataclass(frozen=True)
class ImageScale:
    """An image scale and what it was taken from."""

    px_per_m: float  # nan if unknown
    frames: int = 0  # the scale is that of the boxes of this many first frames; 0 if it has another source


def required(px_per_m: float) -> float:
    """Returns px_per_m (image scale, px per m) unchanged. Raises InputError if it is nan, zero or negative."""
    if px_per_m > 0:
        return px_per_m
    expected = "px per m at people, above 0, to track in the image"
    remedy = "give --px-per-m: the height in px of a person in the picture / 1.7 m"
    raise InputError(place="context.px_per_m", got=f"{px_per_m:g}", expected=expected, remedy=remedy)


def from_boxes(frames: Iterable[Detections | Tracks | None]) -> ImageScale:
    """Returns the image scale, px per m, by the heights of the boxes of the first frames, up to 60 s after the first
    box; nan if there is no box."""
    boxed, begun = list[tuple[int, Array]](), np.inf
    for d in frames:
        if d is not None and d.t > begun + LONGEST:
            break
        if d is not None and d.box is not None and len(d.box):
            begun = min(begun, d.t)
            boxed.append((d.index, d.box[:, 3]))
    index = np.repeat(np.array([k for k, _ in boxed], np.int64), [len(h) for _, h in boxed])
    return ImageScale(*scale_of_first_boxes(index, np.concatenate([np.zeros(0), *(h for _, h in boxed)])))


def from_tracks(given: ImageScale, learned: float, tracks: SequenceOf[Tracks]) -> ImageScale:
    """Returns the image scale for deriving groups from tracks; px_per_m is nan if it is unknown. It is `given` if that
    is known, else `learned` (the tracker's own scale, px per m), else that of the tracks' boxes."""
    if np.isfinite(given.px_per_m):
        return given
    return ImageScale(learned) if np.isfinite(learned) else from_boxes(tracks)


def learned_by(tracker: object) -> float:
    """Returns the tracker's own attribute `px_per_m` (px per m) as a float; nan if it is missing or no number."""
    value = getattr(tracker, "px_per_m", None)
    return float(value) if is_number(value) else float("nan")


def of_sequence(sequence: Sequence, given: Given | None) -> ImageScale:
    """Returns the image scale that a tracker is given with a sequence; px_per_m is nan if it is unknown.

    given: all detections of the sequence; their boxes decide if the sequence has no scale. None: the tracker works on
    pictures.
    """
    known = before_frames(sequence)
    return known if np.isfinite(known.px_per_m) or given is None else from_boxes(given.detections)


def before_frames(sequence: Sequence) -> ImageScale:
    """Returns the image scale that is known before the frames are read: by the camera, else as the sequence states.
    px_per_m is nan if there is none."""
    if sequence.camera is not None:
        from sim.scene.camera import px_per_m_at_centre

        return ImageScale(px_per_m_at_centre(sequence.camera))
    return ImageScale(sequence.px_per_m, int(sequence.source.get("px_per_m_frames", 0)))
