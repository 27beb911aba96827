"""Events of the reported groups: kinds, onsets, people who arrive together, equal ids of people and groups."""

from __future__ import annotations

import numpy as np

from sim.truth.identity import Identities
from tracking.papers.joint.report import ReportedEvents

FPS = 10.0


def reported(pos, partitions):
    """The events of a sequence; pos (T, P, 2), nan where absent; partitions: frame (from 0) to groups, from then on."""
    report, identities, parts, out = ReportedEvents(FPS), Identities(), [], []
    for t, place in enumerate(pos):
        there = np.flatnonzero(np.isfinite(place[:, 0]))
        parts = partitions.get(t, parts)
        old = identities.groups
        changes = identities.step(t + 1, frozenset((there + 11).tolist()), [frozenset(p) for p in parts])
        report.add(there + 11, place[there])
        out += report.events(changes, old, identities.groups, 2.0)
    return out


def two(gap):
    """Two people (11, 12) side by side, `gap` (T,) apart."""
    pos = np.zeros((len(gap), 2, 2))
    pos[:, 1, 1] = gap
    return pos


def test_merges_and_splits_begin_when_the_rules_of_the_truth_come_true():
    gap = np.concatenate([np.linspace(6, 1, 50), np.ones(40), np.linspace(1, 6, 50)])
    form, dissolve = reported(two(gap), {70: [(11, 12)], 130: []})
    assert (form.kind, form.emitted, form.members, form.before, form.after) == ("form", 71, (11, 12), (-1, -1), (1,))
    assert 50 <= form.start <= 54, "near since frame 46, and alike in velocity since frame 51"
    assert (dissolve.kind, dissolve.emitted) == ("dissolve", 131)
    assert 90 < dissolve.start < 110
    assert form.pos[0] == 0
    assert 1.0 <= form.pos[1] <= 2 * 1.5


def test_people_who_arrive_together_have_no_merge():
    assert not reported(two(np.ones(60)), {20: [(11, 12)]})
    late = two(np.ones(60))
    late[:30] = np.nan
    assert not reported(late, {45: [(11, 12)]})


def test_members_of_an_event_are_those_of_its_parts():
    pos = np.zeros((120, 4, 2))
    pos[:, :, 1] = [0, 0.8, 10, 10.8]
    pos[:, 2:, 1] -= np.clip(np.arange(120) - 20, 0, 80)[:, None] * 0.1
    found = reported(pos, {0: [(11, 12), (13, 14)], 115: [(11, 12, 13, 14)]})
    (merge,) = [e for e in found if e.kind == "merge"]
    assert (merge.before, merge.after, merge.members) == ((1, 2), (1,), (11, 12, 13, 14))
    assert 85 < merge.start < 105


def test_what_is_more_than_the_searched_time_ago_is_forgotten():
    gap = np.concatenate([np.linspace(6, 1, 50), np.ones(400)])
    (form,) = reported(two(gap), {440: [(11, 12)]})
    assert form.start > 441 - 21 * FPS
