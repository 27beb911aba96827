"""Which detections a tracker gets: the mode (`--detections image`, `file`, `truth`) and the frames that follow from it.

    image  the tracker's own detector works on the pictures: the frames come without detections
    file   the detections stored with the sequence (det/det.txt)
    truth  the labelled positions or boxes, degraded only by the sensor settings of the command
    both   the pictures and the boxes stored with the sequence

A tracker lists in `needs` what it can work with: pixels, stereo, boxes, points, and "pixels and boxes" if it uses both
at once. It works with any one of them, and gets no more than it lists: `as_needed`.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from collections.abc import Sequence as SequenceOf
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from scenarios.errors import InputError
from sim.scene.standing import standing_points
from sim.types import DetectionMode, Detections, Frame, Ints, Sequence
from tracking.running.tracks_check import finite

BOTH = "pixels and boxes"
INPUTS: dict[DetectionMode, set[str]] = {
    "image": {"pixels", "stereo"}, "file": {"boxes", "points"}, "truth": {"boxes", "points"}, "both": {BOTH},
}  # fmt: skip
InputKind = Literal["points", "boxes", "pixels", "stereo", "pixels and boxes"]


def choose_mode(needs: tuple[str, ...], sequence: Sequence, requested: DetectionMode | None) -> DetectionMode:
    """Returns the requested detection mode; for None the first of "image", "file", "truth" and "both" that is possible.

    A mode is possible if the sequence has what a tracker with these needs takes in it. Raises InputError if the
    requested mode, or for None every mode, is impossible.
    """
    able = [mode for mode in modes_of(needs) if _works(mode, needs, sequence)]
    if requested in able or (requested is None and able):
        return requested or able[0]
    there = {
        "images": sequence.has_images, "a right image": sequence.has_right, "detections": sequence.has_detections,
        "truth": sequence.load_truth is not None,
    }  # fmt: skip
    contents, place = ", ".join(name for name, known in there.items() if known) or "nothing", "--detections"
    needed = " or ".join(need for need in needs if need != BOTH) or BOTH
    got = f"a tracker that needs {needed}, and {sequence.name} with {contents}"
    remedy = f"try --detections {able[0]}" if able else "take another, or give a detector's boxes with --boxes FILE"
    place += "" if requested is None else f" {requested}"
    raise InputError(place=place, got=got, expected="what both have", remedy=remedy)


def modes_of(needs: tuple[str, ...]) -> tuple[DetectionMode, ...]:
    """Returns the modes in which a tracker with these needs works if a sequence has what they take."""
    return tuple(mode for mode, inputs in INPUTS.items() if not inputs.isdisjoint(needs))


def _works(mode: DetectionMode, needs: tuple[str, ...], sequence: Sequence) -> bool:
    if mode == "image":
        return ("pixels" in needs and sequence.has_images) or ("stereo" in needs and sequence.has_right)
    if mode == "both":
        return sequence.has_images and sequence.has_detections
    return sequence.has_detections if mode == "file" else sequence.load_truth is not None


def input_kind(needs: tuple[str, ...], mode: DetectionMode, sequence: Sequence, frames: Iterable[Frame]) -> InputKind:
    """Returns what a tracker with these needs works on in this mode: "pixels", "stereo", "boxes", "points" or "pixels
    and boxes". frames: with the detections that the tracker gets; used only by a tracker that takes boxes and points:
    of detections in the image it works on the boxes, of others on the points."""
    if mode == "both":
        return "pixels and boxes"
    if mode == "image":
        return "pixels" if "pixels" in needs and sequence.has_images else "stereo"
    if not {"boxes", "points"} <= set(needs):
        return "boxes" if "boxes" in needs else "points"
    in_image = any(f.detections is not None and f.detections.plane == "image" for f in frames)
    return "boxes" if in_image else "points"


@dataclass(frozen=True, eq=False)
class Given:
    """The detections of frames 1, 2, … of a sequence, None for a frame without a detector. owners: of each frame the
    ids (M,) of the people whom the detections show, -1 for a false alarm; None if unknown."""

    detections: SequenceOf[Detections | None]
    owners: SequenceOf[Ints] | None = None


def given_detections(
    mode: DetectionMode, sequence: Sequence, sensor: Mapping[str, Any], seed: int, *, owned: bool = False
) -> Given:
    """Returns the detections of the mode "file", "both" or "truth". sensor, seed: degrade and shuffle those of "truth".
    owned: whether the owners of stored detections are read, too."""
    if mode == "truth":
        from tracking.running.truth_detections import from_truth

        return Given(*from_truth(sequence, sensor, seed))
    owners = sequence.load_owners() if owned and sequence.load_owners is not None else None
    return Given([f.detections for f in sequence.without_pictures()], owners)


def as_needed(given: Given, needs: tuple[str, ...], mode: DetectionMode, sequence: Sequence) -> Given:
    """Returns the detections as a tracker with these needs gets them.

    Without "boxes" and "pixels and boxes" among the needs they have no boxes. Without "points" their positions follow
    from their boxes. With a camera that is where the bodies with the boxes stand on the ground; a box whose foot shows
    no ground is left out. Without a camera it is the middle of the box. Raises InputError if the needs lack "points"
    and there are no boxes.
    """
    if {"boxes", BOTH}.isdisjoint(needs):
        return Given([None if d is None else d.replace(box=None) for d in given.detections], given.owners)
    if "points" in needs:
        return given
    nonempty = [d for d in given.detections if d is not None and len(d.pos)]
    if nonempty and all(d.box is None for d in nonempty):
        got, remedy = f"points alone, in {sequence.name}", "take a tracker that takes points"
        raise InputError(place=f"--detections {mode}", got=got, expected="boxes", remedy=remedy)
    boxes = [np.zeros((0, 4)) if d is None or d.box is None else d.box for d in given.detections]
    box, camera, plane = np.concatenate([np.zeros((0, 4)), *boxes]), sequence.camera, "ground"
    if camera is None:
        pos, plane = box[:, :2] + box[:, 2:] / 2, "image"
    else:
        pos = standing_points(box, camera, sequence.scene)
    there = np.isfinite(pos).all(axis=1) | ~np.isfinite(box).all(axis=1)  # check_detections names a box that is nan
    cuts = np.cumsum([*map(len, boxes)], dtype=int)
    places, kept = np.split(pos, cuts)[:-1], np.split(there, cuts)[:-1]
    found = [
        d if d is None or (d.box is None and len(d.pos)) else d.replace(plane=plane, pos=p, vel=None, box=b).keep(rows)
        for d, p, b, rows in zip(given.detections, places, boxes, kept, strict=True)
    ]
    owners = given.owners
    return Given(found, owners and [who[rows] for who, rows in zip(owners, kept, strict=True)])


def as_frames(detections: Iterable[Detections | None], fps: float) -> tuple[Frame, ...]:
    """Returns frames without pictures that have these detections."""
    own = (None if d is None else d.copy() for d in detections)  # a slice would show later frames as its base
    return tuple(Frame(k, (k - 1) / fps, detections=d) for k, d in enumerate(own, 1))


def check_detections(detections: Detections, needs: tuple[str, ...]) -> None:
    """Raises InputError if a frame's detections are not finite, or are points while the needs lack "points"."""
    place = f"frame {detections.index}"
    for a in (detections.pos, detections.vel, detections.box, detections.score):
        if a is not None and not finite(a):
            row = int(np.argwhere(~np.isfinite(a.reshape(len(a), -1)).all(1))[0, 0])
            got, place = "NaN or infinity", f"{place}: detection {row + 1}"
            raise InputError(place=place, got=got, expected="finite numbers", remedy="correct this row")
    if len(detections.pos) and detections.box is None and "points" not in needs:
        raise InputError(place=place, got="points", expected="boxes", remedy="take a tracker that takes points")
