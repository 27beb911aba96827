"""Orders about groups that other orders made, about groups named twice, and about groups in a queue."""

import json
import re
from dataclasses import replace

import numpy as np
import pytest

from scenarios.loading.resolve import load
from sim.crowd.formation import standing
from sim.crowd.order_execution import concerned
from sim.crowd.world import World, run
from sim.sequence import observe
from sim.store.truth_files import truth_files

HEAD = """
schema = 1
duration = 24.0
camera.fps = 5
world.size = [30, 12]
group = [
  { id = "a", size = 2, start = [3, 4], goal = [14, 4] },
  { id = "b", size = 2, start = [3, 7], goal = [14, 7] },
  { id = "q", size = 1, start = [18, { uniform = [2, 10] }], goal = [27, 6], repeat = 3 },
]
"""
MERGE = '{ id = "m", type = "merge", groups = ["a", "b"], into = "ab", goal = [16, 6], when = { time = 0.5 } }'
SPLIT = (
    '{ id = "s", type = "split", group = "ab", when = { reach = { group = "ab", radius = 1.5 } }, '
    'parts = [{ id = "c", size = 2, goal = [20, 2] }, { id = "d", size = 2, goal = [20, 10] }] }'
)
LATER = '{ id = "n", type = "merge", groups = ["c", "d"], into = "e", when = { reach = { group = "c" } } }'


def scenario(tmp_path, *orders):
    path = tmp_path / "scene.toml"
    path.write_text(HEAD + "event = [\n" + ",\n".join(orders) + "\n]\n")
    return load(path)


def test_groups_that_orders_made_reach_their_goals(tmp_path):
    """`reach` without a place means the group's goal, also of groups made by merge and split."""
    motion = run(scenario(tmp_path, MERGE, SPLIT, LATER), 0)
    assert [order.fired is not None for order in motion.orders] == [True, True, True]


def test_a_group_that_two_patterns_match_queues_once(tmp_path):
    queue = '{ id = "l", type = "queue", groups = ["q-*", "q-1", "q-*"], at = [24, 6], when = { time = 0.5 } }'
    order = scenario(tmp_path, queue).event[0]
    assert concerned(order, ["q-1", "q-2", "q-3"]) == ["q-1", "q-2", "q-3"]
    motion = run(scenario(tmp_path, queue), 0)
    assert sorted(p for group in motion.orders[0].before for p in group) == [5, 6, 7]


def test_a_group_that_merges_leaves_its_queue(tmp_path):
    """The queue goes on without it; else it would wait for ever for the old group to reach the head."""
    queue = (
        '{ id = "l", type = "queue", groups = ["b", "a", "q-*"], at = [24, 6], direction_deg = 180, service = 3.0, '
        'goal = [28, 10], at_goal = "stand", when = { time = 0.2 } }'
    )
    merge = '{ id = "m", type = "merge", groups = ["a", "q-1"], into = "aq", goal = [3, 10], when = { time = 5 } }'
    made = scenario(tmp_path, queue, merge)
    path = tmp_path / "scene.toml"
    starts = ["group.b.start=[21, 6]", "group.a.start=[18, 6]", "group.q.start=[12, { uniform = [2, 10] }]"]
    last = run(load(path, set=[*starts, "duration=34"]), 0).pos[-1]
    assert len(last) == len(made.group) + 4
    assert np.all(np.linalg.norm(last[[0, 1, 4]] - [3, 10], axis=1) < 3.5), "the merged group goes to its goal"
    assert np.all(np.linalg.norm(last[[2, 3, 5, 6]] - [28, 10], axis=1) < 3.5), "all others are served"


ONE_BY_ONE = (
    '{ id = "l", type = "queue", groups = ["q-*"], at = [24, 6], direction_deg = 180, service = 1.0, '
    "when = { time = 1 } }"
)


@pytest.mark.parametrize("seed", range(4))
def test_an_order_after_a_queue_fires_when_the_queue_is_measured(tmp_path, seed):
    """Though nobody holds the same place for 3 s, as people are served one by one and advance."""
    after = '{ id = "m", type = "merge", groups = ["a", "b"], into = "ab", when = { after = "l" } }'
    scenario(tmp_path, ONE_BY_ONE, after)
    made = load(tmp_path / "scene.toml", ["group.q.repeat=8"])
    truth = observe(made, run(made, seed)).truth
    line, merge = truth.orders
    rule_time = merge.time - (truth.events[line.event].start - 1) / made.camera.fps
    assert 2.7 <= rule_time <= 4.0, "3 s, and some until people who move are seen to wait again"


@pytest.mark.parametrize(
    ("when", "reason"),
    [
        ("{ distance_lt = 0.2 }", r"its groups came within \d\.\d\d m"),
        ('{ reach = { group = "a", at = [3, 11] } }', r"its groups came within \d\.\d\d m"),
        ('{ after = "l" }', "l had not come true"),
        ("{ time = 20, delay = { choice = [3, 30, 30, 30] } }", "its trigger was met at 20 s, and `delay` is 30.0 s"),
    ],
)
def test_the_reason_is_given_for_an_order_that_never_fires(tmp_path, when, reason):
    after = f'{{ id = "m", type = "merge", groups = ["a", "b"], into = "ab", when = {when} }}'
    scenario(tmp_path, ONE_BY_ONE, after)
    made = load(tmp_path / "scene.toml", ["duration=23.8", "event.l.when.time=21"])
    ((order, words),) = run(made, 1).unfired
    assert order == "m"
    assert re.fullmatch(reason, words)


COUNTERS = (
    '{ id = "l", type = "queue", groups = ["q-*"], at = [21, 6], direction_deg = 180, counters = [[24, 4], [24, 8]], '
    'service = 4.0, goal = [29, 6], at_goal = "leave", when = { time = 1 } }'
)


@pytest.mark.parametrize("seed", range(3))
def test_the_first_of_one_line_goes_to_the_next_free_counter(tmp_path, seed):
    """Everybody is served once, at one of both counters, alone, for the time of service, in the order of the line."""
    scenario(tmp_path, COUNTERS)
    made = load(
        tmp_path / "scene.toml", ["group.q.repeat=6", "group.q.start=[{ uniform = [12, 18] }, 6]", "duration=45"]
    )
    motion = run(made, seed)
    served = []
    for at in made.event[0].counters:
        there = np.linalg.norm(motion.pos - np.array(at), axis=2) < 0.35
        assert there.sum(axis=1).max() == 1
        served += [
            (int(np.flatnonzero(there[:, p])[0]), p) for p in range(4, 10) if there[:, p].sum() > 3.5 * motion.fps
        ]
    assert sorted(p for _, p in served) == [4, 5, 6, 7, 8, 9], "groups a and b, of two people each, do not queue"
    at_head = np.linalg.norm(motion.pos - [21, 6], axis=2) < 0.35
    line = sorted(range(4, 10), key=lambda p: int(np.flatnonzero(at_head[:, p])[0]))
    assert [p for _, p in sorted(served)] == line
    assert not motion.present[-1, 4:].any(), "all leave after service"
    order = observe(made, motion).truth.orders[0]
    assert order.event is not None, "the waiting line is measured as a queue"


def test_a_group_that_merges_leaves_its_counter(tmp_path):
    merge = '{ id = "m", type = "merge", groups = ["a", "q-1"], into = "aq", goal = [3, 10], when = { time = 12 } }'
    scenario(tmp_path, COUNTERS, merge)
    made = load(
        tmp_path / "scene.toml", ["group.q.start=[{ uniform = [18, 20] }, 6]", "event.l.service=60", "duration=40"]
    )
    world = World(made, 0, 0)
    *_, last = (state.copy() for state, _ in world.ticks(400))
    (queue,) = world.orders.queues.values()
    served = {world.groups.members[g][0] for g in queue.called.values()}
    assert served == {5, 6}, "the third one has taken the free place"
    assert np.linalg.norm(last[[0, 1, 4], :2] - [3, 10], axis=1).max() < 3.5


def test_a_merge_as_a_parent_arrives_keeps_the_places_of_the_new_group(tmp_path):
    """Whatever the tick at which it fires, also the one in which the old group begins to stand in a circle."""
    merge = '{{ id = "m", type = "merge", groups = ["a", "b"], into = "ab", when = {{ time = {} }} }}'
    first = World(scenario(tmp_path), 0, 0)
    arrival = next(k for k, _ in enumerate(first.ticks(240)) if first.groups.arrays.arrived[0]) / 10
    for t in arrival + np.arange(-2, 3) / 10:
        world = World(scenario(tmp_path, merge.format(t)), 0, 0)
        assert len(list(world.ticks(240))) == 240
        g = world.groups.alive["ab"]
        kept = world.groups.places[world.groups.members[g]]
        assert sorted(kept.tolist()) == sorted(standing(4, world.groups.spacing[g]).tolist()), t


MEASURED = ("gt/events.json", "gt/near.csv", "gt/groups.csv", "gt/groups.parquet", "gt/groups_px.parquet")
DATED = {"merge": {"merge", "form"}, "split": {"split", "dissolve"}, "queue": {"queue"}}


def measured(scenario, motion):
    """The truth's files, measured anew from a motion."""
    return truth_files(observe(scenario, motion, check=False).truth.replace(orders=()))


@pytest.mark.parametrize("name", ["split", "queue", "party"])
def test_times_deleted_from_the_script_change_no_onset(name):
    scenario = load(name, ["camera.fps=5"])
    motion = run(scenario, 0)
    files = measured(scenario, motion)
    events = json.loads(files["gt/events.json"])["events"]
    assert {o.kind for o in motion.orders}
    assert all(any(e["kind"] in DATED[o.kind] for e in events) for o in motion.orders), "there are onsets to be moved"
    fired = {o.fired for o in motion.orders}
    onsets = {e["start"] for e in events if e["kind"] in set().union(*DATED.values())}
    assert not fired & onsets, "an onset is no order's time"
    for fired, time in ((None, None), (1, 0.0), (7, 1.2)):
        orders = tuple(replace(o, fired=fired, time=time) for o in motion.orders)
        again = measured(scenario, motion.replace(orders=orders))
        assert all(again[file] == files[file] for file in MEASURED)
        assert again.keys() == files.keys()
