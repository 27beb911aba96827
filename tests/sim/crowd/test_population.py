"""The fluctuation of wanted velocities: its spread, its memory, and whose stream it comes from."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import lfilter

from sim.crowd.population import WANDER_SD, WANDER_TIME, wander
from sim.rng import rng

FPS = 10.0


def test_spread_and_memory_are_those_of_the_process_from_the_first_frame() -> None:
    u = wander([(0, 0, k) for k in range(4000)], 16, FPS, 1, 0)
    assert u.std(axis=(1, 2)) == pytest.approx(np.full(16, WANDER_SD), rel=0.05)
    after = (u[0] * u[15]).mean() / WANDER_SD**2  # 1.5 s later
    assert after == pytest.approx(np.exp(-15 / (FPS * WANDER_TIME)), abs=0.04)


def test_it_is_the_recursive_filter_of_each_persons_own_noise() -> None:
    keys = [(0, 0, 0), (0, 1, 0), (3, 0, 2)]
    u = wander(keys, 50, FPS, 7, 2)
    keep = np.exp(-1 / (FPS * WANDER_TIME))
    for p, key in enumerate(keys):
        noise = rng(7, "gait", *key, repeat=2).normal(size=(50, 2))
        noise[1:] *= np.sqrt(1 - keep**2)
        np.testing.assert_allclose(u[:, p], lfilter([WANDER_SD], [1.0, -keep], noise, axis=0), atol=1e-15)
    np.testing.assert_array_equal(wander(keys[1:], 50, FPS, 7, 2), u[:, 1:])


def test_nobody() -> None:
    assert wander([], 5, FPS, 0, 0).shape == (5, 0, 2)
