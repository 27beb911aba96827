"""The kernels of forces against their slow twins, and what forces may not depend on."""

from __future__ import annotations

import numpy as np
import pytest

from sim.crowd.forces import (
    END,
    GATHER,
    GROUP,
    MAX_ACCELERATION,
    MODE,
    PROCESSION,
    QUEUE,
    SWAY_X,
    SWAY_Y,
    GroupArrays,
    Obstacles,
    PeopleArrays,
)
from sim.crowd.forces_avoidance_kernels import _avoid_groups, _pairs, _walls
from sim.crowd.forces_goal_kernels import accelerate
from tests.reference_steering import between_groups, between_people, from_things

NO_STAIRS, NO_PILLARS = np.zeros((0, 10)), np.zeros((0, 3))
NOTHING = Obstacles.of(NO_STAIRS, np.zeros((0, 4)), NO_PILLARS)


def crowd(n: int, seed: int, side: float = 6.0) -> tuple[np.ndarray, PeopleArrays, GroupArrays]:
    r = np.random.default_rng(seed)
    state = np.concatenate([r.uniform(0, side, (n, 2)), r.normal(0, 1, (n, 2))], axis=1)
    people = PeopleArrays.empty(n)
    people.tag[:, GROUP] = people.tag[:, PROCESSION] = np.arange(n) // 3
    people.tag[:, MODE] = 0
    people.tag[:, QUEUE] = np.where(r.random(n) < 0.2, 0, -1)
    people.place[:] = r.normal(0, 0.7, (n, 2))
    people.noise[:] = r.normal(0, 0.1, (n, 4))
    people.gait[:] = r.uniform(0, [1.0, 1.0, 0.2, 0.2, 0.04], (n, 5))
    groups = GroupArrays.empty(int(people.tag[:, GROUP].max()) + 1, 4)
    groups.route[:, 0] = r.uniform(0, side, groups.route[:, 0].shape)
    groups.kind[:, 0] = r.choice([END, GATHER], len(groups.speed))
    groups.length[:] = 1
    groups.speed[:] = r.uniform(0.8, 1.6, len(groups.speed))
    angle = r.uniform(-3, 3, len(groups.speed))
    groups.heading[:] = np.stack([np.cos(angle), np.sin(angle)], 1)
    return state, people, groups


def forces(state: np.ndarray, people: PeopleArrays, groups: GroupArrays, obstacles: Obstacles = NOTHING) -> np.ndarray:
    out = np.zeros((len(state), 2))
    assert accelerate(state, *people, *groups, *obstacles, 0.02, out)
    return out


ROW = np.array([0.0, 3.0, 0.0, 0.0])
ARRANGED = {
    "scattered": lambda s: s, "standing": lambda s: s * [1, 1, 0, 0], "in a row": lambda s: s * [1, 0, 1, 1] + ROW,
    "half of them standing": lambda s: np.where(np.arange(len(s))[:, None] % 2, s, s * [1, 1, 0, 0]),
    "head on": lambda s: s * [1, 0, 1, 0] + ROW,
    "on a lattice as wide as strangers keep, some on one place": lambda s: on_lattice(s, 0.58),
    "at the edge of reach": lambda s: on_lattice(s, 3.5),
}  # fmt: skip


def on_lattice(state: np.ndarray, width: float) -> np.ndarray:
    return np.hstack([np.round(state[:, :2] / width) * width, state[:, 2:]])


@pytest.mark.parametrize("n", [2, 48, 49])
@pytest.mark.parametrize("arranged", ARRANGED)
def test_pairs_equal_the_slow_twin(arranged: str, n: int) -> None:
    state, people, groups = crowd(n, n, side=4 + n / 10)
    state = ARRANGED[arranged](state)
    out = np.zeros((n, 2))
    _pairs(state, people.tag, groups.boids, out)
    np.testing.assert_allclose(out, between_people(state, people.tag), atol=1e-9)
    out[:], people.tag[:, PROCESSION] = 0, np.arange(n) // 9  # three groups behind each other
    _pairs(state, people.tag, groups.boids, out)
    np.testing.assert_allclose(out, between_people(state, people.tag), atol=1e-9)


@pytest.mark.parametrize("seed", range(8))
def test_groups_equal_the_slow_twin(seed: int) -> None:
    r = np.random.default_rng(seed)
    count = r.integers(0, 4, 40).astype(float)
    now = np.concatenate([count[:, None], r.uniform(0, 25, (40, 2)), r.normal(size=(40, 2)), r.random((40, 7))], axis=1)
    now[:, 9] = (count > 0) & (r.random(40) < 0.9)
    now[seed, 3:5] = 0.0
    push = np.ones((40, 2))
    head = np.arange(40) // (1 + 9 * (seed % 2))  # each alone, or ten behind each other
    _avoid_groups(now, push, r.permutation(40), head)
    np.testing.assert_allclose(push, between_groups(now, head), atol=1e-9)
    assert np.abs(push).max() > 0.1


def test_walls_and_pillars_equal_the_slow_twin() -> None:
    state, _, _ = crowd(100, 4)
    r = np.random.default_rng(4)
    walls, pillars = r.uniform(0, 6, (5, 4)), r.uniform(0.1, 6, (3, 3)) * [1, 1, 0.1]
    walls[0, 2:] = walls[0, :2]
    out = np.zeros((100, 2))
    wanted = r.normal(size=(100, 2))
    _walls(state, wanted, walls, pillars, out)
    np.testing.assert_allclose(out, from_things(state, wanted, walls, pillars), atol=1e-9)


@pytest.mark.parametrize("seed", range(5))
def test_turning_and_moving_the_scene_turns_the_forces(seed: int) -> None:
    state, people, groups = crowd(60, seed)
    walls = np.array([[0.0, -1.0, 6.0, -1.0]])
    pillars = np.array([[3.0, 3.0, 0.3]])
    a = forces(state, people, groups, Obstacles.of(NO_STAIRS, walls, pillars))
    c, s = np.cos(0.7), np.sin(0.7)
    turn, shift = np.array([[c, -s], [s, c]]), np.array([13.0, -4.0])
    state, people, groups = crowd(60, seed)
    turned = np.concatenate([state[:, :2] @ turn.T + shift, state[:, 2:] @ turn.T], axis=1)
    people.gait[:, SWAY_X : SWAY_Y + 1] = people.gait[:, SWAY_X : SWAY_Y + 1] @ turn.T
    groups.route[:] = groups.route @ turn.T + shift
    groups.heading[:] = groups.heading @ turn.T
    walls = (walls.reshape(-1, 2) @ turn.T + shift).reshape(-1, 4)
    pillars = np.concatenate([pillars[:, :2] @ turn.T + shift, pillars[:, 2:]], axis=1)
    b = forces(turned, people, groups, Obstacles.of(NO_STAIRS, walls, pillars))
    np.testing.assert_allclose(b, a @ turn.T, atol=1e-9)


def test_the_order_of_people_does_not_matter() -> None:
    state, people, groups = crowd(60, 3)
    a = forces(state, people, groups)
    state, people, groups = crowd(60, 3)
    order = np.random.default_rng(0).permutation(60)
    shuffled = PeopleArrays(*[np.ascontiguousarray(x[order]) for x in people])
    b = forces(np.ascontiguousarray(state[order]), shuffled, groups)
    np.testing.assert_allclose(b, a[order], atol=1e-9)


def test_forces_are_capped_and_states_that_are_not_finite_are_noticed() -> None:
    state, people, groups = crowd(100, 1, side=3.0)
    assert np.linalg.norm(forces(state, people, groups), axis=1).max() <= MAX_ACCELERATION + 1e-12
    state[5, 0] = np.nan
    assert not accelerate(state, *people, *groups, *NOTHING, 0.02, np.zeros((100, 2)))
