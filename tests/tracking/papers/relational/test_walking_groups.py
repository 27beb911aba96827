"""Groups and events from the probability that two people walk together."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from tracking.papers.relational.config import RelationalConfig
from tracking.papers.relational.walking_groups import PeopleNow, WalkingGroups

FPS = 10.0
WALK = np.array([1.2, 0.0])


def people(frame, place, together, seen=None):
    """Everybody walks to the right; place (K, 2): at time 0, m; together (K, K)."""
    count = len(place)
    every = np.ones(count, bool)
    return PeopleNow(
        frame, np.arange(1, count + 1), place + WALK * frame / FPS, np.tile(WALK, (count, 1)), together, every,
        every if seen is None else seen,
    )  # fmt: skip


def pair(probability):
    return np.array([[1.0, probability], [probability, 1.0]])


def run(scenes, config=None):
    """The labels and events of frames 1, 2, … given as (place, together) or (place, together, seen)."""
    groups, out = WalkingGroups(), []
    for _ in scenes[0][0]:
        groups.add()
    for frame, scene in enumerate(scenes, 1):
        out.append(groups.step(people(frame, *scene), FPS, config or RelationalConfig()))
    return [g.tolist() for g, _ in out], [e for _, events in out for e in events]


NEAR, APART = np.array([[0.0, 0.0], [0.0, 0.8]]), np.array([[0.0, 0.0], [0.0, 3.0]])


def test_who_walks_together_from_the_start_is_a_group_without_event():
    labels, events = run([(NEAR, pair(0.95))] * 30)
    assert labels[-1] == [1, 1]
    assert events == []


def test_a_merge_has_the_onset_of_being_near():
    scenes = [(APART, pair(0.02))] * 30 + [(NEAR, pair(0.95))] * 60
    labels, events = run(scenes)
    assert labels[29] == [-1, -1]
    assert labels[-1] == [1, 1]
    (event,) = events
    assert (event.kind, event.start, event.members) == ("form", 31, (1, 2))
    assert event.emitted > event.start


def test_inertia_delays_the_decision():
    scenes = [(APART, pair(0.02))] * 30 + [(NEAR, pair(0.8))] * 100
    late = []
    for rate in (1.0, 1e-3):
        config = dataclasses.replace(RelationalConfig(), join_rate=rate, part_rate=rate)
        late.append(run(scenes, config)[1][0].emitted)
    assert late[1] > late[0] + 3


def test_a_link_lasts_while_people_are_near():
    """A low probability alone parts nobody; being apart does."""
    labels, events = run([(NEAR, pair(0.95))] * 30 + [(NEAR, pair(0.02))] * 100)
    assert labels[-1] == [1, 1]
    labels, events = run([(NEAR, pair(0.95))] * 30 + [(APART, pair(0.02))] * 100)
    assert labels[-1] == [-1, -1]
    (event,) = events
    assert (event.kind, event.start) == ("dissolve", 31)


@pytest.mark.parametrize("seen", [True, False])
def test_a_pair_with_a_missed_person_keeps_its_decision(seen):
    scenes = [(NEAR, pair(0.95))] * 30 + [(APART, pair(0.02), np.array([True, seen]))] * 100
    labels, events = run(scenes)
    assert labels[-1] == ([-1, -1] if seen else [1, 1])
    assert len(events) == seen


def test_removed_people_leave_their_group():
    groups, config = WalkingGroups(), RelationalConfig()
    for _ in range(2):
        groups.add()
    for frame in range(1, 31):
        groups.step(people(frame, NEAR, pair(0.95)), FPS, config)
    groups.keep(np.array([True, False]))
    label, (event,) = groups.step(people(31, NEAR[:1], np.ones((1, 1))), FPS, config)
    assert label.tolist() == [-1]
    assert (event.kind, event.start, event.members) == ("leave", 30, (1, 2))
