"""Groups of beliefs: equal to a slow twin, whatever is missed or predicted."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from scenarios.loading.resolve import load
from sim.sequence import simulate
from tests import reference_belief as slow
from tracking.grouping.belief import default_belief
from tracking.grouping.belief_groups import BeliefGroups, StepGrouping
from tracking.grouping.motion_history import PeopleRows
from tracking.grouping.pair_beliefs import BeliefHistory, PairBeliefs, StepBeliefs, pair_probabilities
from tracking.grouping.person_motion import PersonMotion, StepRows, frames_per_step, step_rows
from tracking.grouping.tracks_table import TracksTable


def tabled(found, steps, people):
    """The group of each step and person, (S, P), -1 alone."""
    out = np.full((steps, people), -1)
    rows = found.step >= 0  # not of the step before
    out[found.step[rows], found.person[rows]] = found.group[rows]
    return out


def label_of_steps(shape, *rows_and_numbers):
    """The groups of all steps at once, (S, P); rows_and_numbers: step, a, b, values, unseen, stay, come, nearest."""
    grouping = StepGrouping(*rows_and_numbers[4:])
    grouping.take_people(np.full(shape[1], -1))
    return tabled(grouping.add(0, shape[0], *rows_and_numbers[:4]), *shape)


def found_groups(frame, column, pos, length, fps, belief, seen=None):
    """The links of all frames at once, and the groups now by step and person, (S, P)."""
    finder, people = BeliefGroups(fps, belief), int(column.max()) + 1
    finder.take_people(np.full(people, -1))
    seen = np.ones(len(frame), bool) if seen is None else seen
    rows = PeopleRows(frame, column, pos, np.full_like(pos, np.nan), np.full(len(frame), -1), seen)
    found = finder.add(rows, column, length)
    return found.links, tabled(found.now, -(-length // frames_per_step(fps)), people)


def parts(label):
    """The groups of a step as sets of people; label (P,): the least person of each one's group, -1 alone."""
    found = {frozenset(np.flatnonzero(label == g).tolist()) for g in set(label.tolist()) - {-1}}
    assert all(label[min(part)] == min(part) for part in found)
    return found


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize(("stay", "come", "nearest"), [(0.0, 0.0, 0.0), (2.5, 1.5, 0.0), (2.5, 1.5, 0.4)])
def test_groups_of_steps_are_linked_one_join_at_a_time(seed, stay, come, nearest):
    """Of log-odds to which `stay` is added in groups of the step before, `come` taken elsewhere."""
    r = np.random.default_rng(seed)
    steps, people, unseen = 5, 9, -4.0
    step, a, b = (x.ravel() for x in np.meshgrid(range(steps), range(people), range(people), indexing="ij"))
    kept = (a < b) & (r.random(len(a)) < 0.7)
    step, a, b = step[kept], a[kept], b[kept]
    log_odds = r.normal(0.5, 3, len(a))
    label = label_of_steps((steps, people), step, a, b, log_odds, unseen, stay, come, nearest)
    before, differ = set(), 0
    for s in range(steps):
        known = {(i, j): x for q, i, j, x in zip(step, a, b, log_odds, strict=True) if q == s}
        table = {
            (i, j): known.get((i, j), unseen) + (stay if any({i, j} <= g for g in before) else -come)
            for i in range(people) for j in range(i + 1, people)
        }  # fmt: skip
        found = parts(label[s])
        assert found == slow.groups(range(people), table, unseen, nearest)
        differ += found != slow.groups(range(people), known, unseen, nearest)
        before = found
    assert bool(differ) == bool(stay)


def test_a_chain_of_strangers_is_no_group_and_a_stretched_group_is_one():
    pairs = [(0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3)]
    a, b = np.array(pairs).T
    chain, stretched = np.array([1.0, -5, -6, 1, -5, 1]), np.array([4.0, 1, -1, 4, 1, 4])
    for log_odds, size in ((chain, 2), (stretched, 4)):
        label = label_of_steps((1, 4), np.zeros(6, np.int64), a, b, log_odds, -4.0)
        assert max(map(len, parts(label[0]))) == size


def test_two_pairs_that_are_too_far_apart_for_evidence_are_two_groups():
    step, a, b = [0] * 6 + [1, 1], [0, 0, 0, 1, 1, 2, 0, 2], [1, 2, 3, 2, 3, 3, 1, 3]
    label = label_of_steps((2, 4), *map(np.array, (step, a, b)), np.full(8, 5.0), -4.0, 7.0, 1.2)
    assert label.tolist() == [[0, 0, 0, 0], [0, 0, 2, 2]]


@pytest.fixture(scope="module")
def scene():
    truth = simulate(load("mixed"), 20000, streams=()).truth
    r = np.random.default_rng(0)
    return truth.replace(pos=truth.pos + r.normal(0, 0.02, truth.pos.shape), vel=None, box=None)


def test_stay_and_come_decide_how_long_links_last(scene):
    column = np.unique(scene.id, return_inverse=True)[1]
    rows = (scene.frame - 1, column, scene.pos[:, :2], scene.length, scene.fps)

    def changes(**changed):
        return len(found_groups(*rows, dataclasses.replace(default_belief(), **changed))[0].frame)

    forgetful, default, late = changes(stay=0.0, come=0.0), changes(), changes(stay=30.0, come=30.0)
    assert forgetful > default > late


def side_by_side(apart):
    """Rows of two people who walk at 1 m/s, their distances apart (T,), m, at 2.5 frames per s."""
    length = len(apart)
    x = np.arange(length) / 2.5
    pos = np.stack([np.column_stack([x, 0 * x]), np.column_stack([x, np.asarray(apart, float)])], axis=1)
    return np.repeat(np.arange(length), 2), np.tile([0, 1], length), pos.reshape(-1, 2), length, 2.5


@pytest.mark.parametrize("together", [True, False])
def test_predictions_neither_link_nor_part(together):
    drift = 1 + np.clip((np.arange(60) - 30) / 3, 0, 8)  # the second person is predicted away, or near
    rows = side_by_side(drift if together else 10 - drift)
    seen = (rows[1] == 0) | (rows[0] < 30)
    (held, held_now), (free, free_now) = (found_groups(*rows, default_belief(), some) for some in (seen, None))
    assert held.on.tolist() == [True] * together
    assert free.on.tolist() == [True] + [False] * together
    assert ((held_now[30:] >= 0) == together).all()
    assert ((free_now[-1] >= 0) != together).all()


def test_people_who_are_not_measured_in_one_step_form_no_group():
    # a new track of a person whose old track is still predicted, at 10 frames per s: at 1 m/s, 0.3 m apart
    frame, column, pos, length, _ = side_by_side([1.2] * 40)
    reported = (column == 0) | (frame > 20)
    frame, column, pos = frame[reported], column[reported], pos[reported] / 4
    seen = (frame > 20) == (column == 1)
    held, free = (found_groups(frame, column, pos, length, 10.0, default_belief(), some)[1] for some in (seen, None))
    assert (held < 0).all()
    assert (free[-1] == 0).all()


def test_a_missed_pair_that_was_seen_apart_is_not_together():
    rows = side_by_side([*[1.0] * 30, *[20.0] * 3, *[20.0] * 10])
    seen = (rows[1] == 0) | (rows[0] < 33)
    assert (found_groups(*rows, default_belief(), seen)[1][30:] < 0).all()


def links_of(found, seen, steps, monkeypatch):
    """On and sure of the links of two people in 10 steps, by their beliefs, with so many steps added at once."""
    motion = PersonMotion(2, 0.4).add(seen.step, seen.column, seen.pos, seen.time)
    parts = []
    for low in range(0, 10, steps):
        end = min(low + steps, 10)
        now, rows = ((x >= low) & (x < end) for x in (found.step, seen.step))
        people = StepRows(seen.step[rows], seen.column[rows], seen.pos[rows], seen.time[rows])
        parts.append(StepBeliefs(low, end, people, motion, found.take(now)))
    monkeypatch.setattr(BeliefHistory, "add", lambda *_: parts.pop(0))
    finder, nobody = BeliefGroups(2.5, default_belief()), PeopleRows.none()
    finder.take_people(np.full(2, -1))
    links = [finder.add(nobody, nobody.id, 0).links for _ in range(len(parts))]
    return [row for part in links for row in zip(part.on.tolist(), part.sure.tolist(), strict=True)]


at_once = pytest.mark.parametrize("steps", [1, 3, 10])


@at_once
@pytest.mark.parametrize(("begin", "sure"), [(3.0, False), (10.0, True)])
def test_whether_a_removal_is_sure_follows_from_what_was_measured(begin, sure, steps, monkeypatch):
    """The log-odds of the link's time sum to -5 or 2; those that a missed pair keeps are left out."""
    events, step = np.array([begin, *[-2.0] * 4, *[5.0] * 4, -9.0]), np.arange(10)
    missed, none = (step > 4) & (step < 9), np.zeros(10, np.int64)
    found = PairBeliefs(step, none, none + 1, np.column_stack([events, events]), np.zeros(10), missed)
    links = links_of(found, step_rows(*side_by_side([1.0] * 10)), steps, monkeypatch)
    assert [on for on, _ in links] == [True, False]
    assert links[1][1] == sure


@at_once
@pytest.mark.parametrize("before", [True, False])
def test_a_link_is_sure_if_people_were_seen_out_of_reach_before(before, steps, monkeypatch):
    """Beliefs begin in step 5, when the two are within 4 m; the second person is seen from step 0 or 5 on."""
    step, none = np.arange(5, 10), np.zeros(5, np.int64)
    found = PairBeliefs(step, none, none + 1, np.full((5, 2), 5.0), np.zeros(5), np.zeros(5, bool))
    frame, column, pos, length, fps = side_by_side([*[9.0] * 5, *[1.0] * 5])
    there = (column == 0) | (frame >= 5) | before
    seen = step_rows(frame[there], column[there], pos[there], length, fps)
    assert links_of(found, seen, steps, monkeypatch) == [(True, before)]


@pytest.mark.parametrize("fps", [2.5, 10.0])
def test_probabilities_are_those_of_the_groups(fps):
    """Of two people, one of whom is predicted for a while: the groups follow from the probabilities alone."""
    seconds = np.arange(80 * fps) / fps
    frame, column, pos, length, _ = side_by_side(2.2 + 1.7 * np.sin(seconds / 4))
    pos[:, 0] = frame / fps
    seen = (column == 0) | (frame % 50 < 40)
    belief = default_belief()
    belief = dataclasses.replace(belief, threshold=np.full(len(belief.noise), 0.4))
    size = frames_per_step(fps)
    none, ids = np.full(len(frame), -1), np.array([7, 9])
    table = TracksTable(frame, ids[column], column, ids, pos, np.full_like(pos, np.nan), none, length, 1.0, seen)
    found, together, expected = pair_probabilities(table, fps, belief), False, np.zeros(length, bool)
    told = dict(zip((found.frame - 1).tolist(), found.probability, strict=True))
    assert set(zip(found.a.tolist(), found.b.tolist(), strict=True)) == {(7, 9)}
    for k in range(length):
        if k % size == 0:
            change = belief.hold if together else -belief.join
            together = k in told and told[k] - 0.4 + change > 0
        expected[k] = together
    now = found_groups(frame, column, pos, length, fps, belief, seen)[1]
    np.testing.assert_array_equal(now[np.arange(length) // size, 0] == 0, expected)
    assert 0.1 < expected.mean() < 0.9
    assert {*range(40, 50)} <= told.keys(), "where one of the two is predicted, too"
