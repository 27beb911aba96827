"""The frame rate is a property of the camera: the same seed is the same world at any rate."""

from __future__ import annotations

import numpy as np
import pytest

from scenarios.loading.resolve import load
from sim.clock import SCRIPT_RATE
from sim.crowd.world import run
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
