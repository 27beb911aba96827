"""Groups without formation are flocks: each of the three forces does what Reynolds (1987) says, at the end of a walk."""

from __future__ import annotations

from functools import cache
from typing import Any, NamedTuple

import numpy as np
import pytest

from scenarios.loading.validation import validate
from scenarios.schema.scenario import Scenario
from sim.crowd.world import World

SEEDS = range(1000, 1003)


class Flock(NamedTuple):
    """Means over people, times and seeds: distance to the nearest member and to the middle, m; length of the mean of
    the headings (1: all alike); spread of velocities, m/s."""

    neighbour: float
    radius: float
    polarisation: float
    spread: float


@cache
def walk(people: int, formation: str = "none", **crowd: float) -> Flock:
    """Returns the state of a group that has walked for 25 to 35 s over open ground."""
    group = {"id": "g", "size": people, "formation": formation, "start": [5, 10], "goal": [75, 10]}
    table: dict[str, Any] = {"schema": 1, "duration": 35, "warmup": 0.0, "world": {"size": [80, 20]}, "group": [group]}
    table |= {"camera": {"kind": "top", "fps": 10, "px_per_m": 5}, "crowd": crowd}
    found = []
    for seed in SEEDS:
        states = World(validate(table, "flock", model=Scenario), seed, 0).run().states()
        pos, vel = states.pos[250:], states.vel[250:]
        apart = np.linalg.norm(pos[:, :, None] - pos[:, None], axis=-1) + np.diag(np.full(people, np.inf))
        radius = np.linalg.norm(pos - pos.mean(axis=1, keepdims=True), axis=-1)
        ahead = vel / np.linalg.norm(vel, axis=-1, keepdims=True)
        polarisation = np.linalg.norm(ahead.mean(axis=1), axis=-1)
        found.append([np.median(apart.min(axis=-1)), radius.mean(), polarisation.mean(), vel.std(axis=1).mean()])
    return Flock(*np.mean(found, axis=0))


@pytest.mark.parametrize("people", [3, 12])
def test_separation_keeps_members_an_arm_apart(people: int) -> None:
    assert 0.6 <= walk(people).neighbour <= 0.95
    assert walk(people, separation=0.0).neighbour < 0.65 * walk(people).neighbour


@pytest.mark.parametrize("people", [3, 12])
def test_cohesion_holds_them_together(people: int) -> None:
    assert walk(people).radius < 1.2
    assert walk(people, cohesion=0.0).radius > 1.8 * walk(people).radius


@pytest.mark.parametrize("people", [3, 12])
def test_alignment_makes_them_walk_alike(people: int) -> None:
    assert walk(people).spread < 0.9 * walk(people, alignment=0.0).spread
    assert walk(people).polarisation > walk(people, alignment=0.0).polarisation


def test_the_factors_act_in_a_formation_too() -> None:
    usual = walk(12, "rows")
    assert walk(12, "rows", cohesion=0.0).radius > 1.1 * usual.radius
    assert walk(12, "rows", alignment=0.0).spread > 1.02 * usual.spread
    assert walk(12, "rows", separation=0.0).neighbour < usual.neighbour
