"""The fluctuations of wanted velocities and places: their spread, their memory, and whose stream they come from."""

from __future__ import annotations

import numpy as np
from scipy.signal import lfilter

from scenarios.schema.scenario import CrowdSpec
from sim.crowd.population import PLACE_TIME, WANDER_TIME, Person, fluctuations
from sim.rng import normals, rng, uniforms

FPS = 10.0
CROWD = CrowdSpec(velocity_noise=(0.1, 0.2), place_noise=(0.3, 0.05))
SD, TIME = np.array([0.1, 0.2, 0.3, 0.05]), np.array([WANDER_TIME, WANDER_TIME, PLACE_TIME, PLACE_TIME])


def people(keys: list[tuple[int, int, int]]) -> list[Person]:
    return [Person(k, key, 1.3, 1.7, 0.02, 0.0) for k, key in enumerate(keys)]


def test_spread_and_memory_are_those_of_the_process_from_the_first_frame() -> None:
    u = fluctuations(CROWD, people([(0, 0, k) for k in range(8000)]), 16, FPS, 1, 0) / SD
    np.testing.assert_allclose(u.std(axis=1), 1, atol=0.05)
    after = (u[0] * u[15]).mean(axis=0)  # 1.5 s later
    np.testing.assert_allclose(after, np.exp(-15 / (FPS * TIME)), atol=0.04)


def test_it_is_the_recursive_filter_of_each_persons_own_noise() -> None:
    keys = [(0, 0, 0), (0, 1, 0), (3, 0, 2)]
    u = fluctuations(CROWD, people(keys), 50, FPS, 7, 2)
    keep = np.exp(-1 / (FPS * TIME))
    for p, key in enumerate(keys):
        noise = normals(uniforms(rng(7, "gait", *key, repeat=2), (50, 4)))
        noise[1:] *= np.sqrt(1 - keep**2)
        for k in range(4):
            filtered = lfilter([SD[k]], [1.0, -keep[k]], noise[:, k])
            np.testing.assert_allclose(u[:, p, k], filtered, atol=1e-14)
    np.testing.assert_array_equal(fluctuations(CROWD, people(keys[1:]), 50, FPS, 7, 2), u[:, 1:])
