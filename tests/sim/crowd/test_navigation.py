"""Ways round walls and through doors."""

from __future__ import annotations

import numpy as np
import pytest

from scenarios.loading.resolve import load
from sim.crowd.navigation import BEHIND, Navigator
from sim.crowd.world import run
from sim.types import Scene

# a wall across the room with a door of 1.4 m in it
ROOM = Scene(
    size=np.array([20.0, 12.0]),
    walls=np.array([[[10, 0], [10, 5.3]], [[10, 6.7], [10, 12]]], float),
    doors=np.array([[[10, 5.3], [10, 6.7]]]),
)


@pytest.mark.parametrize("start", [[3.0, 6.0], [9.0, 2.0], [9.8, 11.0]])
def test_all_go_through_a_door_by_its_middle_and_straight(start):
    """Also where the opening is in sight: a group is wider than a point."""
    goal = np.array([17.0, 6.4])
    points, narrow = Navigator(ROOM).way(np.array(start), goal)
    np.testing.assert_allclose(points, [[10, 6], [10 + BEHIND, 6], goal])
    assert narrow.tolist() == [True, True, False]
    back, _ = Navigator(ROOM).way(goal, np.array(start))
    np.testing.assert_allclose(back, [[10, 6], [10 - BEHIND, 6], start])


def test_round_the_end_of_a_wall():
    wall = Scene(size=np.array([20.0, 12.0]), walls=np.array([[[10, 3], [10, 12]]], float))
    points, narrow = Navigator(wall).way(np.array([8.0, 6.0]), np.array([12.0, 6.0]))
    assert len(points) == 2
    assert points[0][0] == 10
    assert points[0][1] < 3
    assert not narrow.any()


@pytest.mark.parametrize("seed", range(8))
def test_nobody_stays_behind_at_a_door(seed):
    motion = run(load("door"), seed)
    through = np.isin(motion.intent[0], [0, 1])
    beyond = motion.pos[-1, through, 0] > 10
    assert beyond.all() or not beyond.any()
