from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import sim.sequence
from scenarios.errors import WorkError
from scenarios.schema.scenario import Scenario
from sim.hashing import canonical_hash
from sim.sequence import observe
from sim.truth.label import bodies
from sim.types import Order
from tests.reference_sense import crowd


def scenario(**keys: Any) -> Scenario:
    group = [
        {"id": "a", "size": 2, "start": [4, 5], "goal": [12, 5]},
        {"id": "b", "size": 1, "start": [8, 8], "goal": [8, 2]},
    ]
    return Scenario.model_validate({"schema": 1, "group": group, **keys})


def test_detections_need_no_truth(monkeypatch: pytest.MonkeyPatch) -> None:
    def poisoned(*_: object) -> None:
        raise AssertionError("truth was asked for")

    monkeypatch.setattr(sim.sequence, "label", poisoned)
    sequence = observe(scenario(), crowd(0))
    assert sum(len(f.detections.pos) for f in sequence if f.detections) > 0
    with pytest.raises(AssertionError):
        _ = sequence.truth


def test_truth_of_a_script_that_did_not_come_true_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sim.sequence, "label", bodies)
    motion = replace(crowd(0, people=2), orders=(Order("m", "merge", None, ((1,), (2,)), ((1, 2),)),))
    with pytest.raises(WorkError, match="never fired"):
        _ = observe(scenario(), motion).truth
    assert observe(scenario(), motion, check=False).truth is not None


SMALL = {"image": [160, 120], "focal_px": 125}


def test_pictures_are_drawn_when_they_are_asked_for() -> None:
    motion, streams = crowd(0, frames=6), ("left", "right", "ids", "disparity")
    sequence = observe(scenario(camera=SMALL), motion, streams=streams)
    assert sequence.has_images
    assert sequence.has_right
    frame = list(sequence)[3]
    assert frame.right is not None
    assert (frame.image.shape, frame.image.dtype) == ((120, 160, 3), np.uint8)
    assert all(f.image is None and f.detections is not None for f in sequence.without_pictures())
    truth = sequence.frame_truth(4)
    assert len(truth.pixels.visible_px) == len(truth.id)
    assert truth.pixels.disparity is not None
    background = sequence.background()
    assert background.shape == (50, 120, 160, 3)


def test_pixels_asked_for_after_a_frame_are_those_asked_for_alone() -> None:
    motion = crowd(0, frames=4)
    drawn, alone = (observe(scenario(camera=SMALL), motion, streams=("left", "ids", "disparity")) for _ in range(2))
    for frame in drawn:
        one, two = drawn.load_pixels(frame.index), alone.load_pixels(frame.index)
        assert canonical_hash(one) == canonical_hash(two)
