"""Whole motions: repeatable, finite, nobody through walls, orders fired, the batch interface as the plain loop."""

from __future__ import annotations

import numpy as np
import pymunk.batch
import pytest

from scenarios.loading.resolve import load, names
from sim.crowd.forces import Steering
from sim.crowd.world import WRITE, World, run


@pytest.mark.parametrize("name", names())
def test_every_scenario_moves_and_repeats(name: str) -> None:
    scenario = load(name, ["duration=12"] if name not in ("party", "mixed") else [])
    a, b = run(scenario, 3), run(scenario, 3)
    np.testing.assert_array_equal(a.pos, b.pos)
    assert np.isfinite(a.pos[a.present]).all()
    assert ((a.intent >= 0) == a.present).all()
    assert all(o.fired is not None for o in a.orders)
    speed = np.linalg.norm(a.vel, axis=2)
    assert np.nanmax(speed) < 2.6


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


def test_batches_read_what_the_loop_reads() -> None:
    world = World(load("crowd"), 2, 0, Steering())
    world._come_and_go(0.0, True)
    by_loop = np.array([(*b.position, *b.velocity) for b in (world.bodies[c] for c in world.columns)])
    np.testing.assert_array_equal(world._read()[: len(by_loop)], by_loop)
    gone = sorted(world.bodies)[:3]
    for column in gone:
        body = world.bodies.pop(column)
        world.space.remove(body, *body.shapes)
    world._map_rows()
    by_loop = np.array([(*b.position, *b.velocity) for b in (world.bodies[c] for c in world.columns)])
    np.testing.assert_array_equal(world.state, by_loop)
    world.force[: len(by_loop)] = np.arange(2 * len(by_loop)).reshape(-1, 2)
    pymunk.batch.set_space_bodies(world.space, WRITE, world._write_buffer)
    assert [tuple(world.bodies[c].force) for c in world.columns] == [tuple(f) for f in world.force[: len(by_loop)]]
