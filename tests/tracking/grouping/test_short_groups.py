"""Short groups: which are left out, and what stays of members, groups and events."""

from __future__ import annotations

import numpy as np

from sim.types import GroupEvent
from tests.made_up import make_sequence
from tests.tracking.export.test_tidy_tables import frame, rows
from tracking.export.tidy_tables import run_tables, truth_tables
from tracking.grouping.short_groups import LeftOut, summed, without_short_groups

FPS = 2.0
NAN = float("nan")


def event(kind: str, before: tuple[int, ...], after: tuple[int, ...]) -> GroupEvent:
    return GroupEvent(kind, 2, 3, 3, before, after, (1, 2), (NAN, NAN))


EVENTS = [
    event("form", (-1, -1), (7,)), event("form", (-1, -1), (8,)), event("merge", (7, 8), (8,)),
    event("split", (9,), (-1, -1)), event("enter", (), (-1,)), event("cross", (7, -1), (7, -1)),
]  # fmt: skip


def some() -> list:
    """Group 7 exists in frames 2, 3 and 5, in all 1.5 s, group 8 in frames 1 to 5; 9 only in an event."""
    groups = {1: -1, 2: 7, 3: 7, 4: -1, 5: 7}
    return [
        frame(k, {1: (k, 0, g), 2: (k, 1, g), 3: (k, 5, 8), 4: (k, 6, 8)}, *(EVENTS if k == 3 else []))
        for k, g in groups.items()
    ]


def test_short_groups_and_events_of_only_them_are_left_out():
    kept, left_out = without_short_groups(some(), FPS, 2.0)
    assert left_out == LeftOut(2.0, groups=1, all_groups=2, events=3, all_events=6)
    assert [t.groups.id.tolist() for t in kept] == [[8]] * 5
    assert [[m.tolist() for m in t.groups.members] for t in kept] == [[[3, 4]]] * 5
    assert kept[1].group.tolist() == [-1, -1, 8, 8]
    assert [(e.kind, e.before) for e in kept[2].events] == [("form", (-1, -1)), ("merge", (7, 8)), ("enter", ())]
    assert left_out.text() == "left out: 1 of 2 groups, under 2 s in all, and 3 of 6 events"


def test_the_time_of_a_group_is_that_of_its_frames():
    for seconds, number in ((1.5, 0), (1.51, 1), (2.5, 1), (2.6, 2)):
        assert without_short_groups(some(), FPS, seconds)[1].groups == number, seconds


def test_without_a_duration_nothing_changes():
    tracks = some()
    kept, left_out = without_short_groups(tracks, FPS, 0.0)
    assert all(a is b for a, b in zip(kept, tracks, strict=True))
    assert left_out.text() == ""


def test_tracks_without_groups():
    bare = [t.replace(groups=None, group=np.full(4, -1), events=()) for t in some()]
    kept, left_out = without_short_groups(bare, FPS, 2.0)
    assert (kept[0].groups, left_out.all_groups) == (None, 0)
    assert without_short_groups([], FPS, 2.0) == ((), LeftOut(2.0))


def test_tables_of_tracks_without_short_groups_equal_tables_without_them():
    ours, theirs = run_tables(some(), FPS, min_duration=2.0), run_tables(without_short_groups(some(), FPS, 2.0)[0], FPS)
    assert ours.left_out == LeftOut(2.0, groups=1, all_groups=2, events=3, all_events=6)
    for name, table in theirs.named().items():
        assert rows(ours.named()[name]) == rows(table), name


def test_tables_of_a_truth_have_no_short_groups():
    truth = make_sequence(0).truth
    every = rows(truth_tables(truth).groups)
    longest = max(g["frames"] for g in every) / truth.fps
    tables = truth_tables(truth, min_duration=longest)
    lasting = [g["id"] for g in every if g["frames"] / truth.fps == longest]
    assert [g["id"] for g in rows(tables.groups)] == lasting
    assert {m["group"] for m in rows(tables.members)} == set(lasting)
    assert set(tables.people.columns["group"].tolist()) - {-1} == set(lasting)
    assert tables.left_out.groups == len(every) - len(lasting) > 0


def test_what_is_left_out_of_several_runs():
    assert summed([LeftOut(1.0, 1, 2, 3, 4), LeftOut(1.0, 5, 6, 7, 8)]) == LeftOut(1.0, 6, 8, 10, 12)
