"""rho: where it starts, falls and rises, and that it hangs on the pattern of sightings alone."""

from __future__ import annotations

import numpy as np
import pytest

from tracking.filters import kalman, track_uncertainty
from tracking.filters.track_uncertainty import Dynamics

MADE = Dynamics(0.04, np.array([2.0, 2.0, 1.0, 1.0]), np.full(4, 0.01), np.full(4, 1.5**2))


def follow(dynamics, pattern, r):
    """rho at each prediction; pattern of hits, measured at random places."""
    state, found = dynamics.newborn(), []
    for hit in pattern:
        kalman.predict(state, dynamics.dt, dynamics.q)
        found.append(track_uncertainty.rho(state, dynamics.noise, dynamics.asymptote)[0])
        if hit:
            kalman.update(state, np.array([0]), r.normal(0, 3, (1, 4)), dynamics.noise)
    return np.array(found)


def test_steady_state_in_closed_form():
    state = MADE.newborn()
    for _ in range(1000):
        kalman.predict(state, MADE.dt, MADE.q)
        kalman.update(state, np.array([0]), np.zeros((1, 4)), MADE.noise)
    assert np.allclose(state[2:], MADE.steady()[2:], rtol=1e-9)
    assert track_uncertainty.after_misses(MADE, 0) == pytest.approx(1.0, rel=1e-12)


def test_rho_falls_with_hits_and_rises_with_misses():
    r = np.random.default_rng(0)
    hits = follow(MADE, [True] * 40, r)
    assert (np.diff(hits[:20]) < 0).all()
    assert hits[-1] > 1 - 1e-12
    misses = [track_uncertainty.after_misses(MADE, k) for k in range(30)]
    assert (np.diff(misses) > 0).all()


@pytest.mark.parametrize("seed", range(5))
def test_rho_does_not_see_the_measured_values(seed):
    pattern = np.random.default_rng(seed).random(80) < 0.5
    first, second = (follow(MADE, pattern, np.random.default_rng(k)) for k in (1, 2))
    assert np.array_equal(first, second)
