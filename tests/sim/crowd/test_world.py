"""Whole motions: repeatable at any frame rate, nobody through walls, through doors, orders fired."""

from __future__ import annotations

import numpy as np
import pytest

from scenarios.loading.resolve import load
from sim.clock import SCRIPT_RATE
from sim.crowd.navigation import Navigator
from sim.crowd.world import run
from sim.truth.label import label
from sim.truth.order_fulfilment import check_orders
from sim.types import Scene


def test_one_group_more_does_not_change_who_the_others_are() -> None:
    few, many = run(load("merge"), 5), run(load("merge", ["group.passers.repeat=3"]), 5)
    n = few.pos.shape[1]
    np.testing.assert_array_equal(few.height, many.height[:n])
    np.testing.assert_array_equal(few.free_speed, many.free_speed[:n])


def test_people_go_through_the_door_and_not_through_the_wall() -> None:
    motion = run(load("door"), 1)
    x, y = motion.pos[:, :, 0], motion.pos[:, :, 1]
    crossing = (x[:-1] < 10) != (x[1:] < 10)
    assert crossing.any()
    assert (np.abs(y[:-1][crossing] - 6) < 0.7).all()


# a wall across the room with a door of 1.4 m in it
ROOM = Scene(
    size=np.array([20.0, 12.0]),
    walls=np.array([[[10, 0], [10, 5.3]], [[10, 6.7], [10, 12]]], float),
    doors=np.array([[[10, 5.3], [10, 6.7]]]),
)


@pytest.mark.parametrize("start", [[3.0, 6.0], [9.0, 2.0], [9.8, 11.0]])
def test_all_ways_through_a_door_lead_over_its_middle(start):
    """Also where the opening is in sight: a group is wider than a point."""
    goal = np.array([17.0, 6.4])
    points, gates = Navigator(ROOM).way(np.array(start), goal)
    np.testing.assert_allclose(points, [[10, 6], goal])
    assert gates.tolist() == [0, -1]
    back, _ = Navigator(ROOM).way(goal, np.array(start))
    np.testing.assert_allclose(back, [[10, 6], start])


def test_round_the_end_of_a_wall():
    wall = Scene(size=np.array([20.0, 12.0]), walls=np.array([[[10, 3], [10, 12]]], float))
    points, gates = Navigator(wall).way(np.array([8.0, 6.0]), np.array([12.0, 6.0]))
    assert len(points) == 2
    assert points[0][0] == 10
    assert points[0][1] < 3
    assert gates.tolist() == [-2, -1]


@pytest.mark.parametrize("seed", range(3))
def test_nobody_stays_behind_at_a_door(seed):
    motion = run(load("door"), seed)
    through = np.isin(motion.intent[0], [0, 1])
    beyond = motion.pos[-1, through, 0] > 10
    assert beyond.all() or not beyond.any()


KINDS = ("merge", "split", "form", "dissolve", "cross", "queue")


@pytest.mark.parametrize("name", ["merge", "mixed"])
@pytest.mark.parametrize("fps", [2.5, 30.0])
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
    check_orders(usual, a)
    check_orders(other, b)
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
