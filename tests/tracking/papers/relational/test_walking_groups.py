"""Groups and events from the probability that two people walk together."""

from __future__ import annotations

import numpy as np
import pytest

from tracking.papers.relational.walking_groups import PeopleNow, WalkingGroups

FPS = 10.0
WALK = np.array([1.2, 0.0])


def people(frame, place, together, seen=None):
    """Everybody walks to the right; place (K, 2): at time 0, m; together (K, K)."""
    count = len(place)
    every = np.ones(count, bool)
    return PeopleNow(
        frame, np.arange(1, count + 1), place + WALK * frame / FPS, np.tile(WALK, (count, 1)), together, every,
        np.zeros(count) if seen is None else np.where(seen, 0.0, frame / FPS),
    )  # fmt: skip


def pair(probability):
    return np.array([[1.0, probability], [probability, 1.0]])


def run(scenes):
    """The labels and events of frames 1, 2, … given as (place, together) or (place, together, seen)."""
    groups, out = WalkingGroups(), []
    for _ in scenes[0][0]:
        groups.add()
    for frame, scene in enumerate(scenes, 1):
        out.append(groups.step(people(frame, *scene), FPS))
    return [g.tolist() for g, _ in out], [e for _, events in out for e in events]


NEAR, APART = np.array([[0.0, 0.0], [0.0, 0.8]]), np.array([[0.0, 0.0], [0.0, 3.0]])


def test_who_walks_together_from_the_start_is_a_group_without_event():
    labels, events = run([(NEAR, pair(0.95))] * 30)
    assert labels[-1] == [1, 1]
    assert events == []


def test_a_merge_has_the_onset_of_being_near():
    scenes = [(APART, pair(0.02))] * 30 + [(NEAR, pair(0.3))] * 10 + [(NEAR, pair(0.95))] * 60
    labels, events = run(scenes)
    assert labels[39] == [-1, -1]
    assert labels[-1] == [1, 1]
    (event,) = events
    assert (event.kind, event.start, event.members) == ("form", 31, (1, 2))
    assert event.emitted == 41


def test_hysteresis():
    """A pair that is no group needs more to become one than a group needs to stay."""
    between = [(NEAR, pair(0.5))] * 30
    assert run([(NEAR, pair(0.05))] * 30 + between)[0][-1] == [-1, -1]
    assert run([(NEAR, pair(0.95))] * 30 + between)[0][-1] == [1, 1]


def test_people_who_part_have_the_onset_of_being_apart():
    labels, events = run([(NEAR, pair(0.95))] * 30 + [(APART, pair(0.02))] * 100)
    assert labels[-1] == [-1, -1]
    (event,) = events
    assert (event.kind, event.start) == ("dissolve", 31)


def test_a_person_who_is_missed_for_long_holds_no_parts_together():
    place = np.array([[0.0, 0.0], [0.0, 0.8], [0.0, 1.6]])
    before, after = np.full((3, 3), 0.95), np.eye(3)
    after[0, 1] = after[1, 0] = after[1, 2] = after[2, 1] = 0.95
    scenes = [(place, before)] * 30 + [(place, after, np.array([True, False, True]))] * 60
    labels, _ = run(scenes)
    assert labels[29] == [1, 1, 1]
    assert labels[-1] in ([1, 1, -1], [-1, 1, 1])


@pytest.mark.parametrize("seen", [True, False])
def test_a_pair_with_a_missed_person_keeps_its_decision(seen):
    scenes = [(NEAR, pair(0.95))] * 30 + [(APART, pair(0.02), np.array([True, seen]))] * 100
    labels, events = run(scenes)
    assert labels[-1] == ([-1, -1] if seen else [1, 1])
    assert len(events) == seen


def test_removed_people_leave_their_group():
    groups = WalkingGroups()
    for _ in range(2):
        groups.add()
    for frame in range(1, 31):
        groups.step(people(frame, NEAR, pair(0.95)), FPS)
    groups.keep(np.array([True, False]))
    label, (event,) = groups.step(people(31, NEAR[:1], np.ones((1, 1))), FPS)
    assert label.tolist() == [-1]
    assert (event.kind, event.start, event.members) == ("leave", 30, (1, 2))
