"""Detections made from labels: perfect, or degraded by a sensor's overrides (`--detections truth`)."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from scenarios.errors import InputError
from sim.types import Detections, FrameTruth, Sequence, Truth

PERFECT = {"detect_prob": 1.0, "clutter_rate": 0.0, "noise_px": 0.0, "noise_m": 0.0, "box": "amodal"}
ALWAYS = {"occlusion_power": 0.0, "min_visibility": 0.0, "small_px": 0.0}


def from_truth(sequence: Sequence, sensor: Mapping[str, Any], seed: int) -> Iterator[Detections]:
    """Detections of every labelled frame in order; `sensor` overrides start from perfect sight, keys as in [sensor]."""
    truth = sequence.truth
    assert truth is not None, "the mode was chosen for a source with labels"
    if not sensor:
        return (perfect(truth.at(i)) for i in range(1, truth.length + 1))
    return _sensed(truth, sequence, sensor, seed)


def perfect(truth: FrameTruth) -> Detections:
    """The labels themselves: on the ground where positions are known, else the boxes' centres; no velocities."""
    score = np.ones(len(truth.id))
    if truth.pos is not None:
        return Detections(truth.index, truth.t, "ground", truth.pos, None, truth.box, score)
    assert truth.box is not None, "labels have positions or boxes"
    return Detections(truth.index, truth.t, "image", truth.box[:, :2] + truth.box[:, 2:] / 2, None, truth.box, score)


def _sensed(truth: Truth, sequence: Sequence, sensor: Mapping[str, Any], seed: int) -> Iterator[Detections]:
    from pydantic import ValidationError

    from scenarios.schema.sensor import Sensor
    from sim.detector.sense import sense
    from sim.scene.box_visibility import with_visibility

    try:
        spec = Sensor.model_validate({**PERFECT, **ALWAYS, **sensor})
    except ValidationError as error:
        first = error.errors()[0]
        place = ".".join(["sensor", *map(str, first["loc"])])
        expected = first["msg"]
        raise InputError(place=place, got=first["input"], expected=expected, remedy="see docs/formats.md") from None
    if spec.box == "visible" or spec.by_visibility or spec.occlusion_power or spec.min_visibility:
        truth = with_visibility(truth, sequence.image_size)
    by_name, cast = any(hide.group is not None for hide in spec.hide), sequence.load_people
    people = cast() if by_name and cast is not None else {}
    return iter(sense(truth, spec, seed, sequence.camera, sequence.image_size, people=people))
