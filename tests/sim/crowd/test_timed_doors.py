"""Doors that open at times: nobody passes a shut one, those in the vehicle leave first, and who waits is not stuck."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from scenarios.errors import InputError
from scenarios.loading.resolve import load
from scenarios.loading.validation import validate
from scenarios.schema.scenario import Scenario
from sim.crowd.forces import CLOSING, HOLDER
from sim.crowd.world import World, run
from sim.truth.label import label
from sim.truth.merge_split_rules import separation
from sim.types import Motion

# a car of 16 m x 3 m with doors in its lower side, y = 6
WALLS = [[4, 6, 20, 6], [4, 9, 20, 9], [4, 6, 4, 9], [20, 6, 20, 9]]
OUT = {"id": "out", "size": 2, "start": [8, 8], "goal": [2, 1], "at_goal": "leave"}
IN = {"id": "in", "size": 1, "start": [8, 3], "goal": [14, 7.5], "at_goal": "leave"}
DRAWN = [{"uniform": [5, 19]}, {"uniform": [6.5, 8.5]}], [{"uniform": [5, 19]}, {"uniform": [1, 5]}]


def scene(*groups: dict[str, Any], open: Any = ((15, 25),), width: float = 1.3, **keys: Any) -> Scenario:
    door = {"at": (8, 6), "width": width, "open": open}
    world = {"size": [24, 14], "walls": WALLS, "doors": [door]}
    camera = {"kind": "top", "crop": True, "px_per_m": 20}
    table = {"schema": 1, "duration": 45, "world": world, "camera": camera, "group": [*groups]}
    return validate(table | keys, model=Scenario)


@cache
def exchange(width: float = 1.3) -> Motion:
    inside, outside = DRAWN
    groups = OUT | {"start": inside, "repeat": 4}, IN | {"start": outside, "repeat": 6}
    return run(scene(*groups, width=width, open=((15, 35),)), 90001)


def passing(motion: Motion) -> dict[int, tuple[float, int]]:
    """Returns by person the time, s, at which they first pass the line of the door, and the direction (1: inwards)."""
    inside = np.where(np.isfinite(motion.pos[..., 1]), motion.pos[..., 1] > 6, np.nan)
    change = np.nan_to_num(np.diff(inside, axis=0))
    passed = sorted(map(tuple, np.argwhere(change.T).tolist()), reverse=True)
    return {p + 1: (t / motion.fps, int(change[t, p])) for p, t in passed}


@pytest.mark.parametrize("width", [1.3, 2.0])
def test_nobody_passes_a_shut_door_and_all_pass_an_open_one(width: float) -> None:
    passed = passing(exchange(width))
    assert sorted(passed) == [*range(1, 15)]
    assert min(passed.values())[0] > 15.0
    shut = run(scene(IN, open=((1, 2), (40, 41))), 90001)
    assert np.nanmax(shut.pos[:400, 0, 1]) < 6.0


@pytest.mark.parametrize("width", [1.3, 2.0])
def test_those_in_the_car_leave_first(width: float) -> None:
    way = [direction for _, direction in sorted(passing(exchange(width)).values())]
    assert way == [-1] * 8 + [1] * 6


def test_others_stand_beside_the_opening_meanwhile() -> None:
    motion = exchange()
    before = motion.pos[140]
    outside = before[8:]
    assert (np.hypot(outside[:, 0] - 8, outside[:, 1] - 6) < 4.5).all(), "they have come to the door"
    assert not ((np.abs(outside[:, 0] - 8) < 0.4) & (outside[:, 1] > 4.6)).any(), "and left the way out free"


def test_who_waits_is_neither_stuck_nor_in_a_queue() -> None:
    line = [IN | {"id": f"p{k}", "start": [8, 3 - 0.8 * k], "speed": 1.0} for k in range(4)]
    motion = run(scene(*line, open=((60, 70),)), 90001)
    assert motion.never_arrive == motion.immobile == ()
    assert label(motion, None).events == ()
    assert motion.measured is not None
    assert motion.measured.waiting is not None
    assert motion.measured.waiting[100:].all()
    assert exchange().immobile == (), "who lets others leave is not stuck, either"


def test_a_group_that_waits_long_stays_one() -> None:
    motion = run(scene(OUT | {"size": 4}, open=((40, 45),)), 90001)
    assert motion.measured is not None
    assert set(motion.measured.intent[:420].ravel().tolist()) == {0}


def test_a_door_waits_for_those_in_it_and_lets_nobody_enter_meanwhile() -> None:
    doors = World(scene(IN, open=((5, 9),)), 90001, 0).doors
    far, within = np.array([[8.0, 3.0]]), np.array([[8.2, 6.3]])
    assert doors.shut.tolist() == [True]
    assert not doors.advance(4.9, far)
    assert doors.advance(5.0, far)
    assert not doors.advance(9.0, within)
    assert doors.gate_state[0, HOLDER] == CLOSING
    assert doors.advance(9.4, far)
    assert doors.shut.tolist() == [True]
    motion = run(scene(IN, open=((5, 9),)), 90001)
    assert motion.measured is not None
    assert [tick for tick, _ in motion.measured.walls] == [0, 50, 90]
    np.testing.assert_array_equal(motion.measured.walls[2][1], np.reshape(WALLS, (-1, 2, 2)))
    assert len(motion.measured.walls[1][1]) == 5


def test_bodies_are_stopped_by_a_shut_door() -> None:
    world = World(scene(OUT, IN), 90001, 0)
    for tick, _ in enumerate(world.ticks(100)):
        if tick == 80:
            world.bodies[0].position, world.bodies[0].velocity = (8.0, 6.6), (0.0, -3.0)
    assert world.states[0, 1] > 6.1


def test_distances_lead_round_a_shut_door() -> None:
    pos = np.tile([[12.0, 5.5], [12.0, 6.5]], (6, 1, 1))
    walls = np.array([[[10.0, 6.0], [14.0, 6.0]]])
    free = np.array([[[10.0, 6.0], [11.0, 6.0]]])
    found = separation(pos, 0 * pos, np.array([0]), np.array([1]), ((0, free), (12, walls), (14, free)), 10)
    np.testing.assert_allclose(found.distance, [1, 1, *[2 * np.hypot(2, 0.5)] * 2, 1, 1])


def test_strangers_to_the_truth_on_both_sides_are_no_group_until_it_opens() -> None:
    merge = {"id": "m", "type": "merge", "groups": ["a", "b"], "into": "c", "when": {"time": 12.0}}
    a, b = ({"id": n, "size": 1, "start": (8.0, y), "goal": (8.0, y)} for n, y in (("a", 5.4), ("b", 6.6)))
    motion = run(scene(a, b, event=[merge | {"at_goal": "stand"}], duration=30), 90001)
    truth = label(motion, None)
    assert truth.events is not None
    (event,) = (e for e in truth.events if e.kind == "form")
    assert event.start >= 149


def test_without_two_rooms_neither_side_is_first() -> None:
    doors = {"size": [24, 14], "walls": [[4, 6, 20, 6]], "doors": [{"at": [8, 6], "open": [[3, 9]]}]}
    assert World(scene(OUT, world=doors), 1, 0).doors._left_first == {0: 0.0}
    assert World(scene(OUT), 1, 0).doors._left_first == {0: 1.0}
    turned = {"size": [24, 14], "walls": [[20, 6, 4, 6], *WALLS[1:]], "doors": [{"at": [8, 6], "open": [[3, 9]]}]}
    assert World(scene(OUT, world=turned), 1, 0).doors._left_first == {0: -1.0}


@pytest.mark.parametrize("times", ["[[5, 5]]", "[[5, 9], [8, 12]]", "[[9, 12], [2, 3]]"])
def test_times_that_do_not_ascend_are_refused(tmp_path: Path, times: str) -> None:
    world = f"walls = [[2, 5, 9, 5]], doors = [{{ at = [5, 5], open = {times} }}]"
    group = '[[group]]\nid = "a"\nstart = [3, 3]\ngoal = [5, 3]\n'
    (tmp_path / "door.toml").write_text(f"schema = 1\nworld = {{ {world} }}\n{group}")
    with pytest.raises(InputError, match=r"world\.doors\.0\.open: got .* expected times that ascend"):
        load(tmp_path / "door.toml")
