"""Which detections a tracker gets: the mode (`--detections image`, `file`, `truth`) and the frames that follow from it.

    image  the tracker's own detector works on the pictures: the frames come without detections
    file   the detections stored with the sequence (det/det.txt)
    truth  the labelled positions or boxes, degraded only by the sensor settings of the command

A tracker lists in `needs` what it can work with: pixels, stereo, boxes, points. It works with any one of them.

Also here: detections made from the labels, for `--detections truth`: perfect, or degraded by sensor settings.

Input: the labels of a sequence (positions in m on the ground, or boxes in px). Output: one `Detections` per frame, in
order from frame 1. Without settings these are the labels with score 1. The settings have the keys of a scenario's
[sensor]; a key that is left out has the value of a perfect sensor. The rows of a frame are in random order, so that
they tell nothing about who is who.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from typing import Any, Literal

import numpy as np

from scenarios.errors import InputError
from sim.rng import rng
from sim.types import DetectionMode, Detections, Frame, FrameTruth, Ints, Sequence, Truth
from tracking.running.tracks_check import finite

InputKind = Literal["points", "boxes", "pixels", "stereo"]


def choose_mode(needs: tuple[str, ...], sequence: Sequence, requested: DetectionMode | None) -> DetectionMode:
    """Returns the requested detection mode; for None the first of "image", "file" and "truth" that is possible.

    A mode is possible if the sequence has what a tracker with these needs takes in it. Raises InputError if the
    requested mode, or for None every mode, is impossible.
    """
    able = [mode for mode in ("image", "file", "truth") if _works(mode, needs, sequence)]
    if requested in able or (requested is None and able):
        return requested or able[0]  # type: ignore[return-value]
    there = {
        "images": sequence.has_images, "a right image": sequence.has_right, "detections": sequence.has_detections,
        "truth": sequence.load_truth is not None,
    }  # fmt: skip
    contents, place = ", ".join(name for name, known in there.items() if known) or "nothing", "--detections"
    got = f"a tracker that needs {' or '.join(needs)}, and {sequence.name} with {contents}"
    remedy = f"try --detections {able[0]}" if able else "take another, or give a detector's boxes with --boxes FILE"
    place += "" if requested is None else f" {requested}"
    raise InputError(place=place, got=got, expected="what both have", remedy=remedy)


def _works(mode: str, needs: tuple[str, ...], sequence: Sequence) -> bool:
    if mode == "image":
        return ("pixels" in needs and sequence.has_images) or ("stereo" in needs and sequence.has_right)
    takes = {"boxes", "points"} & set(needs)
    return bool(takes) and (sequence.has_detections if mode == "file" else sequence.load_truth is not None)


def input_kind(needs: tuple[str, ...], mode: DetectionMode, sequence: Sequence, frames: Iterable[Frame]) -> InputKind:
    """Returns what a tracker with these needs works on in this mode: "pixels", "stereo", "boxes" or "points". frames:
    with the detections that the tracker gets; not used if `mode` is "image"."""
    if mode == "image":
        return "pixels" if "pixels" in needs and sequence.has_images else "stereo"
    in_image = any(f.detections is not None and f.detections.plane == "image" for f in frames)
    return "boxes" if in_image or "points" not in needs else "points"


def frames_with_detections(
    needs: tuple[str, ...], mode: DetectionMode, sequence: Sequence, sensor: Mapping[str, Any], seed: int
) -> tuple[Frame, ...] | None:
    """Returns the frames with the detections of `mode` and without pictures; None if `mode` is "image".

    sensor, seed: degrade and shuffle the detections of "truth". Raises InputError if the detections are points only,
    but the tracker needs boxes.
    """
    if mode == "image":
        return None
    if mode == "file":
        found: list[Detections | None] = [f.detections for f in sequence.without_pictures()]
    else:
        found = list(from_truth(sequence, sensor, seed))
    nonempty = [d for d in found if d is not None and len(d.pos)]
    if nonempty and "points" not in needs and all(d.box is None for d in nonempty):
        got, remedy = f"points alone, in {sequence.name}", "take a tracker that takes points"
        raise InputError(place=f"--detections {mode}", got=got, expected="boxes", remedy=remedy)
    own = (None if d is None else d.copy() for d in found)  # a slice would show later frames as its base
    return tuple(Frame(k, (k - 1) / sequence.fps, detections=d) for k, d in enumerate(own, 1))


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


PERFECT_SENSOR = {"detect_prob": 1.0, "clutter_rate": 0.0, "box_noise": {"scale": 0.0}, "noise_m": 0.0, "box": "amodal"}
# Settings by which hidden and small people are detected as well as others.
SEES_ALL = {"occlusion_power": 0.0, "min_visibility": 0.0, "small_px": 0.0}


def from_truth(sequence: Sequence, sensor: Mapping[str, Any], seed: int) -> Iterator[Detections]:
    """Returns an iterator over detections made from the labels, one `Detections` for each frame in order, from 1.
    sensor: settings that degrade them, by name; {} gives the labels in random order."""
    truth = sequence.truth
    assert truth is not None, "the mode was chosen for a source with labels"
    if not sensor:
        return (shuffled(perfect(truth.at(i)), seed) for i in range(1, truth.length + 1))
    return _sensed(truth, sequence, sensor, seed)


def shuffled(detections: Detections, seed: int) -> Detections:
    """Returns the detections of a frame in random order; the order follows from seed, frame number and row count."""
    d = detections  # the order of labels would tell who is who
    order: Ints = rng(seed, "delivery", d.index).permutation(len(d.pos))
    vel, box = (None if a is None else a[order] for a in (d.vel, d.box))
    return d.replace(pos=d.pos[order], vel=vel, box=box, score=d.score[order] if len(d.score) else d.score)


def perfect(truth: FrameTruth) -> Detections:
    """Returns the labels of a frame as detections with score 1, one row per labelled person, hidden or not.

    Detections lie on the ground if positions are labelled, else at the centres of the boxes. If boxes are labelled, a
    person without a finite box, such as one behind the camera, has no row.
    """
    seen = np.ones(len(truth.id), bool) if truth.box is None else np.isfinite(truth.box).all(axis=1)
    box, score = None if truth.box is None else truth.box[seen], np.ones(int(seen.sum()))
    if truth.pos is not None:
        return Detections(truth.index, truth.t, "ground", truth.pos[seen], None, box, score)
    assert box is not None, "labels have positions or boxes"
    return Detections(truth.index, truth.t, "image", box[:, :2] + box[:, 2:] / 2, None, box, score)


def _sensed(truth: Truth, sequence: Sequence, sensor: Mapping[str, Any], seed: int) -> Iterator[Detections]:
    from scenarios.loading.resolve import SensorFile
    from scenarios.loading.validation import validate
    from sim.detector.sense import sense
    from sim.scene.visibility import with_visibility

    spec = validate({"sensor": PERFECT_SENSOR | SEES_ALL | _nested(sensor)}, model=SensorFile).sensor
    if spec.box == "visible" or spec.by_visibility or spec.occlusion_power or spec.min_visibility:
        truth = with_visibility(truth, sequence.image_size)
    hides_groups, load_people = any(hide.group is not None for hide in spec.hide), sequence.load_people
    people = load_people() if hides_groups and load_people is not None else {}
    return iter(sense(truth, spec, seed, sequence.camera, sequence.image_size, people=people))


def _nested(settings: Mapping[str, Any]) -> dict[str, Any]:
    """Returns the settings as a table; "box_noise.scale" becomes the key "scale" of the table "box_noise"."""
    table: dict[str, Any] = {}
    for key, value in settings.items():
        outer, dot, inner = key.partition(".")
        here = table.get(outer, {})
        if dot and isinstance(here, dict):
            table[outer] = {**here, inner: value}
        else:
            table[key] = value
    return table
