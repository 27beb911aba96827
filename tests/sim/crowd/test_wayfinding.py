"""Everybody finds the way: round walls, through narrow gates in both directions, and back to the group."""

from __future__ import annotations

import numpy as np
import pytest

from scenarios.loading.validation import validate
from scenarios.schema.scenario import Scenario
from sim.clock import SCRIPT_RATE
from sim.crowd.navigation import Navigator
from sim.crowd.world import World
from sim.geometry.walls import blocked
from sim.truth.label import label
from sim.types import Motion, Scene

TOP = {"kind": "top", "fps": 5, "px_per_m": 10}


def played(seed: int, **parts) -> tuple[Motion, World]:
    table = {"schema": 1, "about": "", "duration": 60.0, "turn_deg": 0, "camera": TOP, **parts}
    world = World(validate(table, model=Scenario), seed, 0)
    return world.run(), world


def left_at_the_end(motion: Motion) -> int:
    return int(np.isfinite(motion.measured.pos[-1, :, 0]).sum())


def crossings(motion: Motion) -> int:
    a, b = motion.measured.pos[:-1].reshape(-1, 2), motion.measured.pos[1:].reshape(-1, 2)
    there = np.isfinite(a[:, 0]) & np.isfinite(b[:, 0])
    return int(blocked(a[there], b[there], motion.scene.walls).sum())


def streams(n: int, size: object = 1) -> list[dict]:
    """Two streams of n groups that walk against each other through the middle of a wall."""
    left, right = ([{"uniform": [a, b]}, {"uniform": [1, 9]}] for a, b in ((1, 7), (13, 19)))
    common = {"size": size, "at_goal": "leave", "repeat": n}
    return [
        {"id": "a", "start": left, "goal": [17, 5], **common},
        {"id": "b", "start": right, "goal": [3, 5], **common},
    ]


@pytest.mark.parametrize("width", [0.9, 1.8, 3.0])
@pytest.mark.parametrize("size", [1, 3])
def test_two_streams_pass_a_door_in_both_directions(width: float, size: int) -> None:
    """Before the sides took turns, both pressed on each other in doors under 1.5 m to the end."""
    world = {"size": [20, 10], "walls": [[10, 0, 10, 10]], "doors": [{"at": [10, 5], "width": width}]}
    motion, _ = played(4, world=world, group=streams(24 // size, size), duration=120.0)
    assert left_at_the_end(motion) == 0
    assert crossings(motion) == 0


def test_a_member_behind_a_wall_walks_round_it_to_the_group() -> None:
    """Three walk beside a wall that parts them: one is behind it."""
    world = {"size": [24, 12], "walls": [[4, 6, 16, 6]]}
    group = {"id": "a", "size": 6, "start": [2.5, 6.0], "goal": [21, 9], "at_goal": "leave"}
    motion, _ = played(1, world=world, group=[group])
    assert left_at_the_end(motion) == 0
    assert not motion.never_arrive


def test_a_gap_without_a_door_is_a_gate_and_a_corner_is_none() -> None:
    walls = np.array([[[5, 0], [5, 4]], [[5, 5], [5, 10]]], float)
    found = Navigator(Scene(size=np.array([10.0, 10.0]), walls=walls))
    assert found.gates.mean(axis=1).tolist() == [[5.0, 4.5]]
    corner = np.array([[[5, 4.2], [5, 10]], [[4.2, 5], [10, 5]]], float)
    assert not len(Navigator(Scene(size=np.array([10.0, 10.0]), walls=corner)).gates)
    points, gates = found.way(np.array([4.0, 8.0]), np.array([8.0, 2.0]))
    assert gates.tolist() == [0, -1]
    assert points[0].tolist() == [5.0, 4.5]


def test_a_crowd_that_leaves_at_one_point_does_not_plug_it() -> None:
    """As before an exit without walls: groups that could not reach it stood round it for ever."""
    groups = [
        {"id": f"g{k}", "size": 4, "start": [x, y], "goal": [15, 1], "at_goal": "leave"}
        for k, (x, y) in enumerate([(6, 8), (10, 10), (15, 11), (20, 10), (24, 8)])
    ]
    motion, _ = played(0, world={"size": [30, 14]}, group=groups)
    assert left_at_the_end(motion) == 0


def test_who_has_lost_the_group_walks_alone_and_is_meant_to_be_alone() -> None:
    """A stream through the only door parts a group of six for longer than people wait."""
    world = {"size": [20, 10], "walls": [[10, 0, 10, 10]], "doors": [{"at": [10, 5], "width": 0.9}]}
    others = streams(30)
    family = {"id": "family", "size": 6, "start": [4, 5], "goal": [17, 8], "at_goal": "leave"}
    motion, world_run = played(2, world=world, group=[family, *others], duration=120.0)
    assert left_at_the_end(motion) == 0
    columns = world_run.groups.members[world_run.groups.alive["family"]]
    intents = motion.measured.intent[:, columns]
    apart = [len(set(row[row >= 0].tolist())) for row in intents]
    assert max(apart) > 1
    assert apart[0] == 1
    assert len(intents) / SCRIPT_RATE == pytest.approx(120, abs=0.2)


OBSTACLES = {
    "a triangle, whose corners are acute": [[8, 2, 14, 5], [14, 5, 8, 8], [8, 8, 8, 2]],
    "a pocket, on the line of whose walls the ways lie": [[6, 2, 12, 2], [12, 2, 12, 8], [12, 8, 6, 8]],
    "walls that leave 2 m to the border": [[6, 0, 6, 8], [10, 2, 10, 10], [14, 0, 14, 8]],
}


@pytest.mark.parametrize("walls", OBSTACLES.values(), ids=OBSTACLES)
def test_groups_walk_round_obstacles_in_both_directions(walls: list[list[float]]) -> None:
    there = {"id": "a", "size": 3, "start": [3, {"uniform": [3, 7]}], "goal": [17, 5], "at_goal": "leave", "repeat": 3}
    back = there | {"id": "b", "start": [18, {"uniform": [3, 7]}], "goal": [2, 5]}
    come = {"enter": {"uniform": [0, 15]}}
    motion, _ = played(2, world={"size": [20, 10], "walls": walls}, group=[there | come, back | come], duration=80.0)
    assert left_at_the_end(motion) == 0
    assert crossings(motion) == 0


def test_a_queue_behind_a_door_is_reached_from_afar_and_a_merge_too() -> None:
    """Nobody near the door: it is nobody's turn, and all may come."""
    world = {"size": [20, 10], "walls": [[10, 0, 10, 10]], "doors": [{"at": [10, 5], "width": 1.2}]}
    queuers = {"id": "a", "size": 1, "start": [{"uniform": [1, 8]}, {"uniform": [1, 9]}], "goal": [3, 9], "repeat": 4}
    queue = {
        "id": "q", "type": "queue", "groups": ["a-*"], "at": [17, 5], "direction_deg": 180, "service": 2.0,
        "goal": [4, 9], "at_goal": "leave", "when": {"time": 1.0},
    }  # fmt: skip
    motion, _ = played(2, world=world, group=[queuers], event=[queue])
    assert left_at_the_end(motion) == 0
    parts = [{"id": k, "size": 2, "start": [x, 3], "goal": [x, 3.2]} for k, x in (("a", 5), ("b", 15))]
    merge = {"id": "m", "type": "merge", "groups": ["a", "b"], "into": "ab", "goal": [17, 8], "when": {"time": 2.0}}
    motion, _ = played(0, world=world, group=parts, event=[merge])
    end = motion.measured.pos[-1]
    assert (end[:, 0] > 10).all()
    assert [e.kind for e in label(motion, None).events] == ["merge"]


def test_a_way_through_two_doors_of_one_wall() -> None:
    """The second door lies on the line of the first, so that it shows no side to which the way leads."""
    walls = [[10, 0, 10, 12], [2, 6, 10, 6], [10, 6, 18, 6]]
    world = {"size": [20, 12], "walls": walls, "doors": [{"at": [10, 3], "width": 1}, {"at": [10, 9], "width": 1}]}
    group = {"id": "a", "size": 2, "start": [8.5, 3], "goal": [8, 9], "at_goal": "leave", "repeat": 1}
    closed = {**world, "walls": [*walls, [0, 6, 2, 6]]}
    motion, _ = played(0, world=closed, group=[group])
    assert left_at_the_end(motion) == 0
