"""Pixels per metre of an image: where the scale comes from, and the check that a tracker in the image has one.

Lengths in configs are metres. A tracker that works in the image plane multiplies them by this scale once, in `reset`.
Rules (docs/reference/formats.md): the camera's scale at the image centre, else the scale that the recording states,
else the median height of the given boxes divided by 1.7 m.
"""

from __future__ import annotations

from collections.abc import Iterable
from collections.abc import Sequence as SequenceOf

import numpy as np

from scenarios.errors import InputError
from sim.scene.body import PERSON_HEIGHT
from sim.types import DetectionMode, Detections, Frame, Sequence, Tracks


def required(px_per_m: float) -> float:
    """Return px_per_m (image scale, px per m) unchanged. Raises InputError if it is nan, zero or negative."""
    if px_per_m > 0:
        return px_per_m
    raise InputError(
        place="context.px_per_m",
        got=f"{px_per_m:g}",
        expected="px per m at people, above 0, to track in the image",
        remedy="give --px-per-m, for instance the median height of boxes / 1.7 m, or a camera",
    )


def from_boxes(frames: Iterable[Detections | Tracks | None]) -> float:
    """Return the image scale, px per m: the median height of all boxes of all frames divided by 1.7 m; nan if there is
    no box.

    frames: detections or tracks of each frame, read to the end. The height is the last of a box's four columns, px.
    None, and frames without boxes, are skipped; so are heights that are nan. If all are nan, so is the result.
    """
    heights = [d.box[:, 3] for d in frames if d is not None and d.box is not None and len(d.box)]
    return float(np.nanmedian(np.concatenate(heights))) / PERSON_HEIGHT if heights else float("nan")


def from_tracks(given: float, learned: object, tracks: SequenceOf[Tracks]) -> float:
    """Return the image scale for deriving groups from tracks, in px per m; nan if it is unknown.

    The first finite value counts: `given` (the context's scale, nan if unknown), `learned` (the tracker's own attribute
    `px_per_m`; anything but a number is ignored), then the median height of the tracks' boxes divided by 1.7 m. Zero
    and negative values are not refused.
    """
    if np.isfinite(given):
        return given
    if isinstance(learned, int | float) and np.isfinite(learned):
        return float(learned)
    return from_boxes(tracks)


def of_sequence(sequence: Sequence, mode: DetectionMode, frames: tuple[Frame, ...] | None) -> float:
    """Return the image scale that a tracker is given with a sequence, in px per m; nan if it is unknown.

    It is the camera's scale at the image centre, else the one that the sequence states. If there is neither and `mode`
    is not "image", it is the median box height over 1.7 m, of the boxes of `frames`, or of the sequence's stored
    detections if `frames` is None. Raises InputError if these cannot be read.
    """
    if sequence.camera is not None:
        from sim.scene.camera import px_per_m_at_centre

        return float(px_per_m_at_centre(sequence.camera))
    if np.isfinite(sequence.px_per_m) or mode == "image":
        return sequence.px_per_m
    return from_boxes(f.detections for f in (sequence.without_pictures() if frames is None else frames))
