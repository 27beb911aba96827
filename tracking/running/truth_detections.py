"""Detections made from the labels, for `--detections truth`: perfect, or degraded by sensor settings.

Input: the labels of a sequence (positions in m on the ground, or boxes in px). Output: one `Detections` per frame, in
order from frame 1. Without settings these are the labels with score 1. The settings have the keys of a scenario's
[sensor]; a key that is left out has the value of a perfect sensor. The rows of a frame are in random order, so that
they tell nothing about who is who.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from sim.rng import rng
from sim.types import Detections, FrameTruth, Ints, Sequence, Truth

PERFECT_SENSOR = {"detect_prob": 1.0, "clutter_rate": 0.0, "box_noise": {"scale": 0.0}, "noise_m": 0.0, "box": "amodal"}
# Settings by which hidden and small people are detected as well as others.
SEES_ALL = {"occlusion_power": 0.0, "min_visibility": 0.0, "small_px": 0.0}


def from_truth(sequence: Sequence, sensor: Mapping[str, Any], seed: int) -> tuple[list[Detections], list[Ints]]:
    """Returns detections made from the labels, with their owners. sensor: settings that degrade them, by name; {} gives
    the labels in random order."""
    truth = sequence.truth
    assert truth is not None, "the mode was chosen for a source with labels"
    if sensor:
        return _sensed(truth, sequence, sensor, seed)
    made = [_shuffled(*perfect(truth.at(i)), seed) for i in range(1, truth.length + 1)]
    return [d for d, _ in made], [who for _, who in made]


def _shuffled(d: Detections, owners: Ints, seed: int) -> tuple[Detections, Ints]:
    # The order of labels would tell who is who.
    order: Ints = rng(seed, "delivery", d.index).permutation(len(d.pos))
    return d.keep(order), owners[order]


def perfect(truth: FrameTruth) -> tuple[Detections, Ints]:
    """Returns the labels of a frame as detections with score 1, one row per labelled person, hidden or not, and the
    ids of the people.

    Detections lie on the ground if positions are labelled, else at the centres of the boxes. If boxes are labelled, a
    person without a finite box, such as one behind the camera, has no row.
    """
    seen = np.ones(len(truth.id), bool) if truth.box is None else np.isfinite(truth.box).all(axis=1)
    box, score = None if truth.box is None else truth.box[seen], np.ones(int(seen.sum()))
    if truth.pos is not None:
        return Detections(truth.index, truth.t, "ground", truth.pos[seen], None, box, score), truth.id[seen]
    assert box is not None, "labels have positions or boxes"
    centre = box[:, :2] + box[:, 2:] / 2
    return Detections(truth.index, truth.t, "image", centre, None, box, score), truth.id[seen]


def _sensed(
    truth: Truth, sequence: Sequence, sensor: Mapping[str, Any], seed: int
) -> tuple[list[Detections], list[Ints]]:
    from scenarios.loading.resolve import SensorFile
    from scenarios.loading.validation import validate
    from sim.detector.sense import sense_owned
    from sim.scene.visibility import with_visibility

    spec = validate({"sensor": PERFECT_SENSOR | SEES_ALL | _nested(sensor)}, model=SensorFile).sensor
    if spec.box == "visible" or spec.by_visibility or spec.occlusion_power or spec.min_visibility:
        truth = with_visibility(truth, sequence.image_size)
    hides_groups, load_people = any(hide.group is not None for hide in spec.hide), sequence.load_people
    people = load_people() if hides_groups and load_people is not None else {}
    return sense_owned(truth, spec, seed, sequence.camera, sequence.image_size, people=people)


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
