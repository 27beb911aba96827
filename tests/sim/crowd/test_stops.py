"""Stops, scattered starts and entries in the warm-up: who stands where and how long, and who stays behind."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from scenarios.loading.resolve import load
from sim.crowd.world import run
from sim.sequence import simulate
from sim.types import Array, Motion

SCENE = """
schema = 1
duration = 30.0
world = { size = [30, 20] }
crowd = { free_speed = 1.3, spacing = 0.8, sway = 0, velocity_noise = [0, 0], place_noise = [0, 0] }
camera = { kind = "top", crop = true, px_per_m = 20, position = [15, 10] }
group = [{ id = "a", size = 2, start = [5, 10], goal = [27, 10], at_goal = "leave" }]
"""
STOP = "group.a.stops=[{ at = [14, 10], stay = 6 }]"


@pytest.fixture
def path(tmp_path: Path) -> Path:
    path = tmp_path / "stops.toml"
    path.write_text(SCENE)
    return path


def speeds(motion: Motion) -> Array:
    """Returns the speeds, m/s, (frames, people); absent people have -1."""
    return np.nan_to_num(np.linalg.norm(motion.vel, axis=2), nan=-1.0)


def test_a_group_stands_at_its_stop_for_its_time_and_then_leaves(path: Path) -> None:
    motion = run(load(path, [STOP]), 1)
    stands = (speeds(motion) >= 0) & (speeds(motion) < 0.3)
    assert 5.0 < stands[:, 0].sum() / motion.fps < 8.0
    assert np.abs(np.nanmedian(motion.pos[stands[:, 0], 0], axis=0) - (14, 10)).max() < 0.6
    assert not motion.present[-1].any()


def test_a_group_at_its_stop_is_not_stuck_and_one_on_the_way_may_be(path: Path) -> None:
    long = STOP.replace("stay = 6", "stay = 60")
    assert run(load(path, [long]), 1).never_arrive == ()
    (stuck,) = run(load(path, [long, "world.walls=[[10, 0, 10, 20]]"]), 1).never_arrive
    assert stuck.group == "a"


def test_people_wait_until_a_time(path: Path) -> None:
    other = "group.b={ size = 1, start = [10, 14], goal = [27, 14], at_goal = 'leave' }"
    stops = [f"group.{g}.stops=[{{ at = [14, {y}], until = [2, 15], stay = 1 }}]" for g, y in (("a", 10), ("b", 13))]
    motion = run(load(path, [other, *stops]), 1)
    v, t = speeds(motion), np.arange(300) / motion.fps
    assert (v[(t > 13) & (t < 15.9)] < 0.3).all(), "the first arrives after 2 s, both wait for 15 s and 1 s more"
    assert (v[(t > 17.5) & (t < 20)] > 0.8).all()


def test_a_member_stays_behind_and_catches_up_and_is_one_of_the_group(path: Path) -> None:
    motion = run(load(path, [STOP.replace("}]", ", members = 1 }]")]), 1)
    gap = np.linalg.norm(motion.pos[:, 0] - motion.pos[:, 1], axis=1)
    apart = np.flatnonzero(gap > 2.5)
    assert len(apart) > 10
    assert gap[apart[-1] :][~np.isnan(gap[apart[-1] :])][20:].max() < 1.6
    truth = simulate(load(path, [STOP.replace("}]", ", members = 1 }]")]), 1, streams=()).truth
    assert set(truth.group.tolist()) == {int(truth.group[0])} != {-1}


def test_an_order_ends_the_stops_of_its_group(path: Path) -> None:
    far = "group.a.stops=[{ at = [14, 2], stay = 60 }]"
    parts = "[{ id = 'c', goal = [25, 4] }, { id = 'd', goal = [25, 16] }]"
    split = f"event=[{{ id = 's', type = 'split', group = 'a', when = {{ time = 3 }}, parts = {parts} }}]"
    motion = run(load(path, [far, split]), 1)
    assert motion.pos[-1, :, 0].min() > 23
