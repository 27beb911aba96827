"""What is seen to be wrong before anything is simulated."""

from __future__ import annotations

from pathlib import Path

import pytest

from scenarios.errors import InputError
from scenarios.loading.resolve import load

WRONG = [
    (["group.b.id=a"], "group.a", "a second group named 'a'"),
    (["group.e={id='w-2', size=1, start=[1,7], goal=[2,7]}"], "group.w-2", "'w-2'"),
    (["event.s1.id=m1"], "event.m1", "a second order"),
    (["event.m1.groups=['a', 'x']"], "event.m1.groups.1", "'x'"),
    (["event.m1.groups=['a', 'a']"], "event.m1.groups.1", "twice"),
    (["event.m1.into=w-1"], "event.m1.into", "'w-1'"),
    (["event.s1.group=a"], "event.s1.group", "'a', which ended with 'm1'"),
    (["event.q1.groups=['ab', 'w-*']"], "event.q1.groups.0", "'ab', which ended with 's1'"),
    (["event.q1.groups=['z-*']"], "event.q1.groups.0", "'z-*'"),
    (["event.q1.groups=['d']"], "event.q1.groups", "2 people in d"),
    (["event.q1.counters=[[15, 3], [17, 3]]"], "event.q1.counters.1", "x = 17"),
    (["event.q1.counters=[[15, 3], [15, 3.5]]"], "event.q1.counters.1", "0.50 m from the counter [15.0, 3.0]"),
    (["event.q1.counters=[[12, 6.5]]"], "event.q1.counters.0", "from the head of the queue"),
    (["event.q1.counters=[]"], "event.q1.counters", "[]"),
    (["event.s1.when.after=q1"], "event.s1.when.after", "'q1'"),
    (["event.s1.when.after=s1"], "event.s1.when.after", "'s1'"),
    (["event.m1.when={reach={group='y'}}"], "event.m1.when.reach.group", "'y'"),
    (["event.q1.when={reach={group='ab'}}"], "event.q1.when.reach.group", "ended with 's1'"),
    (["event.q1.when.time=30"], "event.q1.when", "30 s"),
    (["event.q1.when.time={uniform=[31, 33]}"], "event.q1.when", "31 s"),
    (["event.q1.when.time=-1"], "event.q1.when", "-1 s"),
    (["group.a.size=4"], "event.s1.parts", "3 + 2"),
    (["group.a.size={uniform=[3, 4]}"], "event.s1.parts", "3 + 2"),
    (["group.a.start=[17, 5]"], "group.a.start", "x = 17"),
    (["group.a.goal=[11, -0.1]"], "group.a.goal", "y = -0.1"),
    (["group.b.start=[11, {uniform=[3, 12]}]"], "group.b.start", "y from 3 to 12"),
    (["event.q1.at=[12, 9.4]"], "event.q1.at", "the wall"),
    (["event.q1.at=[1, 7]", "event.q1.direction_deg=180"], "event.q1.at", "x = -0.6"),
    (["group.a.start=[2.4, 2]"], "group.a.start", "the pillar"),
    (
        ["group.a.start=[14, 2.2]", "group.w.start=[8, 2]", "group.w.goal=[9, 2]", "mirror=true"],
        "group.a.start",
        "pillar",
    ),
    (["world.doors=[{at=[4, 5]}]"], "world.doors.0", "no wall"),
    (["world.walls=[[1, 1, 1, 1]]"], "world.walls.0", "no length"),
    (["world.boxes=[{ at = [1, 1, -2], size = [1, 1, 1] }]"], "world.boxes.0.at.2", "1.5 m below the ground"),
    (["world.stairs=[{foot=[1, 1], head=[1, 1]}]"], "world.stairs.0", "one place"),
    (["group.w.size=0"], "group.w.size", "0"),
    (["group.w.size={normal=[3, 1]}"], "group.w.size", "any number"),
    (["group.a.speed=0"], "group.a.speed", "0 m/s"),
    (["group.a.height=3.5"], "group.a.height", "3.5 m"),
    (["group.a.clothes=rosso"], "group.a.clothes.0", "'rosso'"),
    (["group.a.clothes=['red', '#12345']"], "group.a.clothes.1", "'#12345'"),
    (["group.a.clothes=[]"], "group.a.clothes", "[]"),
    (["group.a.enter=30"], "group.a.enter", "30 s"),
    (["group.a.stops=[{at=[5, 5], stay=-1}]"], "group.a.stops.0.stay", "-1 s"),
    (["group.a.stops=[{at=[5, 5], members={uniform=[-3, 2]}}]"], "group.a.stops.0.members", "50"),
    (["group.a.scatter=-1"], "group.a.scatter", "-1 m"),
    (["sensor.hide=[{start=1, end=2, group='y'}]"], "sensor.hide.0.group", "'y'"),
    (["sensor.hide=[{start=2, end=2}]"], "sensor.hide.0", "2 to 2"),
]


@pytest.mark.parametrize(("settings", "place", "got"), WRONG)
def test_wrong(path: Path, settings: list[str], place: str, got: str) -> None:
    with pytest.raises(InputError) as caught:
        load(path, settings)
    error = caught.value
    assert error.file == str(path)
    assert error.place in (place, *(f"--set {setting}" for setting in settings))
    assert got in error.got
    assert error.expected
    assert error.remedy


RIGHT = [
    [],
    ["group.a.start=[4, 9.5]", "group.a.goal=[4, 9.6]"],  # in the door
    ["mirror=true", "group.w.goal=[12, 2]"],
    ["group.a.start=[2.71, 2]"],  # just beside the pillar
    ["group.a.start=[0, 0]"],
    ["event.s1.when.after=m1", "event.s1.when.delay={exponential=40}"],
    ["event.q1.when={reach={group='a'}}", "event.m1.when={reach={group='b', at=[8, 5]}}", "event.q1.when={time=1}"],
    ["event.s1.parts=[{id='c', size=4, goal=[14,5]}, {id='d', goal=[8,8]}]"],
    ["sensor.hide=[{start=1, end=2, group='ab'}, {start=1, end=2, group='w-1'}, {start=1, end=2}]"],
    ["turn_deg={uniform=[0, 360]}", "group.a.start=[2, 2]"],  # turned: its place depends on the draw
    ["group.a.start=[{normal=[5, 1]}, 5]"],
    ["group.w.size={poisson=1.1, clip=[1, 6]}"],
    ["world.walls=[[0, 8, 2, 8]]", "world.doors=[{at=[1, 8], width=2}, {at=[1, 8], width=2}]"],  # no wall is left
]


@pytest.mark.parametrize("settings", RIGHT)
def test_right(path: Path, settings: list[str]) -> None:
    load(path, settings)


def test_a_wall_is_closed_beside_its_door(path: Path) -> None:
    load(path, ["group.a.goal=[4.3, 9.5]"])
    with pytest.raises(InputError, match="the wall"):
        load(path, ["group.a.goal=[4.5, 9.5]"])
    with pytest.raises(InputError, match="the wall"):
        load(path, ["group.a.goal=[4, 9.5]", "world.doors=[]"])
