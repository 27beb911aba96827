"""The frame rate is a property of the camera: the same seed is the same world at any rate."""

from __future__ import annotations

import numpy as np
import pytest

from scenarios.loading.resolve import load
from sim.clock import SCRIPT_RATE, FrameTicks, FrameTimes
from sim.crowd.world import run
from sim.sequence import observe
from sim.truth.label import label
from sim.truth.order_fulfilment import check_orders

KINDS = ("merge", "split", "form", "dissolve", "cross", "queue")


@pytest.mark.parametrize("name", ["merge", "queue", "party", "mixed", "stairs"])
@pytest.mark.parametrize("fps", [2.5, 7.0, 30.0])
def test_another_rate_shows_the_same_world(name: str, fps: float) -> None:
    seed = 3
    usual, other = (run(load(name, [f"camera.fps={f}"]), seed) for f in (10.0, fps))
    t = np.arange(len(other.pos)) / fps * SCRIPT_RATE
    common = np.abs(t - np.rint(t)) < 1e-9
    common &= np.rint(t) < len(usual.pos)
    at = np.rint(t[common]).astype(int)
    np.testing.assert_allclose(other.pos[common], usual.pos[at], atol=1e-3)
    np.testing.assert_array_equal(other.present[common], usual.present[at])
    a, b = label(usual, None), label(other, None)
    assert check_orders(usual, a).keys() == check_orders(other, b).keys()
    first = {(e.kind, e.members, e.before, e.after): e.start for e in a.events if e.kind in KINDS}
    found = {(e.kind, e.members, e.before, e.after): e.start for e in b.events if e.kind in KINDS}
    assert first.keys() == found.keys()
    for key, start in first.items():
        assert abs((start - 1) / 10.0 - (found[key] - 1) / fps) <= 0.5 / fps + 1e-9
    assert all(b.group[b.frame == e.start].max() >= 0 for e in b.events if e.kind in ("merge", "form"))


def test_a_frame_lies_between_the_steps_around_it() -> None:
    exact, shown = (run(load("cross", [f"camera.fps={f}"]), 1) for f in (50.0, 30.0))
    for f in range(len(shown.pos) - 2):
        k, rest = divmod(f * 50, 30)
        expected = exact.pos[k] + rest / 30 * (exact.pos[min(k + 1, len(exact.pos) - 1)] - exact.pos[k])
        np.testing.assert_allclose(shown.pos[f], expected, atol=1e-3)


def test_the_detector_misses_lasting_at_the_same_times() -> None:
    more = ["sensor.miss_memory=[{share=1.0,time=3.0}]", "sensor.detect_prob=0.6", "sensor.clutter_rate=0.0"]
    counts = {}
    for fps in (5.0, 10.0):
        scenario = load("side-by-side", [f"camera.fps={fps}", *more])
        frames = observe(scenario, run(scenario, 2)).without_pictures()
        counts[fps] = np.array([len(f.detections.pos) for f in frames])
    assert len(set(counts[10.0].tolist())) > 1
    np.testing.assert_array_equal(counts[5.0], counts[10.0][::2])


def test_frame_times() -> None:
    times = FrameTimes.of(8, 30.0)
    assert times.tick.tolist() == [0, 0, 0, 1, 1, 1, 2, 2]
    assert times.step.tolist() == [0, 1, 3, 0, 1, 3, 0, 1]
    assert times.share == pytest.approx([0, 2 / 3, 1 / 3, 0, 2 / 3, 1 / 3, 0, 2 / 3])
    present = np.ones((10, 1), bool)
    assert FrameTicks.of(3, 2.5, 10.0, present).tick.tolist() == [1, 5, 9]
    present[5:] = (
        False  # who leaves at tick 5 is not shown by the frame at tick 4, whose groups are those with all there
    )
    assert FrameTicks.of(3, 2.5, 10.0, present).tick.tolist() == [1, 4, 9]
