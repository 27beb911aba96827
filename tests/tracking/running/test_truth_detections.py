"""Detections made from labels tell nothing by their order or their arrays."""

from __future__ import annotations

import numpy as np
import pytest

from scenarios.errors import InputError
from scenarios.loading.resolve import load
from sim.sequence import simulate
from sim.types import Sequence
from tests.tracking.running.test_run import Stranger
from tracking.running.prepare import prepare
from tracking.running.run import track
from tracking.running.truth_detections import from_truth


@pytest.fixture(scope="module")
def merge() -> Sequence:
    return simulate(load("merge", ["camera.fps=5"]), 40_001)


class Writing(Stranger):
    """Tries to overwrite everything that it is given and all arrays behind it."""

    def step(self, frame, detections):
        for array in (detections.pos, detections.box, detections.score):
            while array is not None:
                array.flags.writeable = True
                array[...] = -1.0
                array = array.base
        return super().step(frame, detections)


def test_the_order_depends_on_seed_and_frame_alone(merge):
    first, again, other = (from_truth(merge, {}, seed)[0] for seed in (3, 3, 4))
    assert all(np.array_equal(a.pos, b.pos) for a, b in zip(first, again, strict=True))
    assert not all(np.array_equal(a.pos, b.pos) for a, b in zip(first, other, strict=True))
    for index, found in enumerate(first, 1):
        now = merge.truth.at(index)
        assert sorted(found.pos.tolist()) == sorted(now.pos.tolist())
        assert {(*p, *b) for p, b in zip(found.pos.tolist(), found.box.tolist(), strict=True)} == {
            (*p, *b) for p, b in zip(now.pos.tolist(), now.box.tolist(), strict=True)
        }


@pytest.mark.parametrize("mode", ["truth", "file"])
def test_arrays_lead_to_no_other_frame(merge, mode):
    frames = prepare(Stranger, merge, detections=mode).frames_given
    for frame in frames:
        for array in (frame.detections.pos, frame.detections.box, frame.detections.score):
            assert array.base is None
            assert not array.flags.writeable


@pytest.mark.parametrize("mode", ["truth", "file"])
def test_what_a_tracker_writes_reaches_neither_truth_nor_the_next_run(merge, mode):
    before = merge.truth.pos.copy(), merge.truth.box.copy()
    clean = track(Stranger, merge, detections=mode)
    track(Writing, merge, detections=mode)
    again = track(Stranger, merge, detections=mode)
    assert np.array_equal(merge.truth.pos, before[0])
    assert np.array_equal(merge.truth.box, before[1])
    assert all(np.array_equal(a.pos, b.pos) for a, b in zip(clean, again, strict=True))


def test_settings_with_dots_are_keys_of_a_table(merge):
    """One key of box_noise brings its defaults; without any, boxes are exact."""
    exact, whole, dotted = (
        [d.box for d in from_truth(merge, sensor, 0)[0]]
        for sensor in ({"noise_m": 0.1}, {"box_noise": {"scale": 2.0}}, {"box_noise.scale": 2.0})
    )
    assert all(map(np.array_equal, whole, dotted))
    assert not any(map(np.array_equal, whole, exact))
    for sensor, words in (({"noise_px": 3}, "or box_noise"), ({"noise_m.x": 3}, "sensor.noise_m")):
        with pytest.raises(InputError, match=words):
            from_truth(merge, sensor, 0)
