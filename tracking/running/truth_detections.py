"""Detections made from the labels, for `--detections truth`: perfect, or degraded by sensor settings.

Input: the labels of a sequence (positions in m on the ground, or boxes in px). Output: one `Detections` per frame, in
order from frame 1. Without settings these are the labels with score 1. The settings have the keys of a scenario's
[sensor]; a key that is left out has the value of a perfect sensor. The rows of a frame are in random order, so that
they tell nothing about who is who.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from sim.rng import rng
from sim.types import Detections, FrameTruth, Ints, Sequence, Truth

_PERFECT_SENSOR = {
    "detect_prob": 1.0,
    "clutter_rate": 0.0,
    "box_noise": {"scale": 0.0},
    "noise_m": 0.0,
    "box": "amodal",
}
# Settings by which hidden and small people are detected as well as others.
_SEES_ALL = {"occlusion_power": 0.0, "min_visibility": 0.0, "small_px": 0.0}


def from_truth(sequence: Sequence, sensor: Mapping[str, Any], seed: int) -> Iterator[Detections]:
    """Returns an iterator over the detections of a labelled sequence, one for each frame in order, from frame 1."""
    truth = sequence.truth
    assert truth is not None, "the mode was chosen for a source with labels"
    if not sensor:
        return (shuffled(perfect(truth.at(i)), seed) for i in range(1, truth.length + 1))
    return _sensed(truth, sequence, sensor, seed)


def shuffled(detections: Detections, seed: int) -> Detections:
    """Returns the detections of a frame in an order that depends on the seed and the number of the frame alone."""
    d = detections  # the order of labels would tell who is who
    order: Ints = rng(seed, "delivery", d.index).permutation(len(d.pos))
    vel, box = (None if a is None else a[order] for a in (d.vel, d.box))
    return d.replace(pos=d.pos[order], vel=vel, box=box, score=d.score[order] if len(d.score) else d.score)


def perfect(truth: FrameTruth) -> Detections:
    """Returns the labels of a frame as detections with score 1, a row per labelled person, hidden ones included.

    They lie on the ground if positions are labelled, else at the centres of the boxes. Without a box, as behind the
    camera, people in the image have no row.
    """
    seen = np.ones(len(truth.id), bool) if truth.box is None else np.isfinite(truth.box).all(axis=1)
    box, score = None if truth.box is None else truth.box[seen], np.ones(int(seen.sum()))
    if truth.pos is not None:
        return Detections(truth.index, truth.t, "ground", truth.pos[seen], None, box, score)
    assert box is not None, "labels have positions or boxes"
    return Detections(truth.index, truth.t, "image", box[:, :2] + box[:, 2:] / 2, None, box, score)


def _sensed(truth: Truth, sequence: Sequence, sensor: Mapping[str, Any], seed: int) -> Iterator[Detections]:
    from pydantic import ValidationError

    from scenarios.loading.resolve import SensorFile
    from scenarios.loading.validation import input_error
    from sim.detector.sense import sense
    from sim.scene.boxes import with_visibility

    table = {"sensor": _PERFECT_SENSOR | _SEES_ALL | _nested(sensor)}
    try:
        spec = SensorFile.model_validate(table).sensor
    except ValidationError as error:
        raise input_error(error, table, "", {}, SensorFile) from None
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
