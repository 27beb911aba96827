"""How people sway with their strides, and how fluctuations move the members of a group, measured on whole motions."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.realism import OPEN_GROUND
from scenarios.schema.scenario import CrowdSpec, Scenario
from sim.crowd.population import PLACE_TIME, WANDER_TIME, Person, fluctuations
from sim.crowd.world import run
from sim.types import Motion

STEADY = {"sway": 0.0, "velocity_noise": [0, 0], "place_noise": [0, 0]}


def walk(
    size: int = 1, speed: float = 1.34, fps: float = 25.0, goal: tuple[float, float] = (50, 10), **crowd
) -> Motion:
    """Returns the motion of a group that walks from (20, 10) to the goal alone, with nothing rough but `crowd`."""
    group = {"id": "a", "size": size, "start": [20, 10], "goal": goal, "speed": speed, "at_goal": "walk"}
    more = {"camera": {"fps": fps}, "crowd": {**STEADY, **crowd}, "group": [group]}
    return run(Scenario.model_validate({**OPEN_GROUND, **more}), 3)


@pytest.mark.parametrize(("speed", "amplitude"), [(0.7, 0.0350), (1.34, 0.0238), (1.6, 0.0193)])
@pytest.mark.parametrize("fps", [10.0, 25.0])
def test_people_sway_as_in_the_literature(speed: float, amplitude: float, fps: float) -> None:
    # Orendurff et al. 2004; steps of 0.0064 m per step/min (Sekiya & Nagasaki 1998), two steps a stride
    motion = walk(speed=speed, fps=fps, sway=0.0238)
    y = motion.pos[:, 0, 1] - motion.pos[:, 0, 1].mean()
    frequency = np.sqrt(speed * 60 / 0.0064) / 120
    t = np.arange(len(y)) / fps
    waves = np.stack([np.sin(2 * np.pi * frequency * t), np.cos(2 * np.pi * frequency * t), np.ones(len(t))], axis=1)
    found, *_ = np.linalg.lstsq(waves, y, rcond=None)
    assert np.hypot(*found[:2]) == pytest.approx(amplitude, rel=0.06)
    assert (y - waves @ found).std() < 0.1 * amplitude
    assert motion.vel[:, 0, 0] == pytest.approx(speed, abs=0.01)


def test_zero_switches_everything_off() -> None:
    motion = walk()
    np.testing.assert_allclose(motion.pos[:, 0, 1], 10, atol=1e-9)
    np.testing.assert_allclose(motion.vel[:, 0, 0], 1.34, atol=1e-9)


def test_places_fluctuate_and_the_group_does_not() -> None:
    motion = walk(size=3, place_noise=[0.2, 0.1])
    middle = motion.pos.mean(axis=1)
    np.testing.assert_allclose(middle[:, 1], 10, atol=1e-6)
    np.testing.assert_allclose(motion.vel.mean(axis=1)[:, 0], 1.34, atol=1e-6)
    assert (motion.pos - middle[:, None]).std(axis=0).min() > 0.005


def test_the_velocity_fluctuates_along_and_across_the_way() -> None:
    along, across = walk(velocity_noise=[0.1, 0]), walk(velocity_noise=[0, 0.1])
    np.testing.assert_allclose(along.pos[:, 0, 1], 10, atol=1e-6)
    assert along.vel[:, 0, 0].std() > 0.03
    assert across.vel[:, 0, 1].std() > 0.03


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
