"""Which detections a tracker gets: the mode (`--detections image`, `file`, `truth`) and the frames that follow from it.

    image  the tracker's own detector works on the pictures: the frames come without detections
    file   the detections stored with the sequence (det/det.txt)
    truth  the labelled positions or boxes, degraded only by the sensor settings of the command

A tracker lists in `needs` what it can work with: pixels, stereo, boxes, points. It works with any one of them.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any, Literal

import numpy as np

from scenarios.errors import InputError
from sim.types import DetectionMode, Detections, Frame, Sequence
from tracking.running.tracks_check import finite

InputKind = Literal["points", "boxes", "pixels", "stereo"]


def runs_own_detector(needs: tuple[str, ...], sequence: Sequence) -> bool:
    """Returns True if a tracker with these needs can run its own detector on the sequence's pictures."""
    return ("pixels" in needs and sequence.has_images) or ("stereo" in needs and sequence.has_right)


def choose_mode(needs: tuple[str, ...], sequence: Sequence, requested: DetectionMode | None) -> DetectionMode:
    """Returns the requested mode if it can work; without one the first of image, file, truth that can."""
    able = [mode for mode in ("image", "file", "truth") if _works(mode, needs, sequence)]
    if requested in able or (requested is None and able):
        return requested or able[0]  # type: ignore[return-value]
    remedy = f"try --detections {able[0]}" if able else "take another tracker or source"
    got = f"a tracker that needs {' or '.join(needs)}, and {sequence.name} with {_contents(sequence)}"
    expected = "what detections of some kind need"
    if requested:
        missing = _missing(requested, needs)
        expected = f"a sequence with {missing}" if missing else f"what --detections {requested} needs"
        got += f", without {missing}" if missing else ""
    raise InputError(place=f"--detections {requested or ''}".rstrip(), got=got, expected=expected, remedy=remedy)


def _works(mode: str, needs: tuple[str, ...], sequence: Sequence) -> bool:
    if mode == "image":
        return runs_own_detector(needs, sequence)
    takes = {"boxes", "points"} & set(needs)
    return bool(takes) and (sequence.has_detections if mode == "file" else sequence.load_truth is not None)


def _missing(mode: DetectionMode, needs: tuple[str, ...]) -> str:
    if mode == "image":
        return "pictures" if "pixels" in needs else "right pictures" if "stereo" in needs else ""
    takes = not {"boxes", "points"}.isdisjoint(needs)
    return {"file": "stored detections", "truth": "labels"}[mode] if takes else ""


def _contents(sequence: Sequence) -> str:
    parts = {
        "images": sequence.has_images,
        "a right image": sequence.has_right,
        "detections": sequence.has_detections,
        "truth": sequence.load_truth is not None,
    }
    return ", ".join(name for name, there in parts.items() if there) or "nothing"


def input_kind(needs: tuple[str, ...], mode: DetectionMode, sequence: Sequence, frames: Iterable[Frame]) -> InputKind:
    """Returns what a tracker with these needs works on in this mode: "pixels", "stereo", "boxes" or "points"."""
    if mode == "image":
        return "pixels" if "pixels" in needs and sequence.has_images else "stereo"
    in_image = any(f.detections is not None and f.detections.plane == "image" for f in frames)
    return "boxes" if in_image or "points" not in needs else "points"


def frames_with_detections(
    needs: tuple[str, ...], mode: DetectionMode, sequence: Sequence, sensor: Mapping[str, Any], seed: int
) -> tuple[Frame, ...] | None:
    """Returns the frames with the detections of `mode` and without pictures, or None if `mode` is "image"."""
    if mode == "image":
        return None
    if mode == "file":
        found: list[Detections | None] = [f.detections for f in sequence.without_pictures()]
    else:
        from tracking.running.truth_detections import from_truth

        found = list(from_truth(sequence, sensor, seed))
    nonempty = [d for d in found if d is not None and len(d.pos)]
    if nonempty and "points" not in needs and all(d.box is None for d in nonempty):
        got, remedy = f"points alone, in {sequence.name}", "take a tracker that takes points"
        raise InputError(place=f"--detections {mode}", got=got, expected="boxes", remedy=remedy)
    own = (None if d is None else d.copy() for d in found)  # a slice would show later frames as its base
    return tuple(Frame(k, (k - 1) / sequence.fps, detections=d) for k, d in enumerate(own, 1))


def check_detections(detections: Detections, needs: tuple[str, ...]) -> None:
    """Raises InputError if a frame's detections cannot be given to a tracker with these needs."""
    rows = len(detections.pos)
    arrays = [a for a in (detections.pos, detections.vel, detections.box, detections.score) if a is not None]
    for a in arrays:
        if not finite(a):
            row = int(np.argwhere(~np.isfinite(a.reshape(len(a), -1)).all(1))[0, 0])
            place = f"frame {detections.index}: detection {row + 1}"
            raise InputError(place=place, got="NaN or infinity", expected="finite numbers", remedy="correct this row")
    if rows and detections.box is None and "points" not in needs:
        place = f"frame {detections.index}"
        raise InputError(place=place, got="points", expected="boxes", remedy="take a tracker that takes points")
