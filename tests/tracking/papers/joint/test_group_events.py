"""Events of groups: features, rates, merges, splits, conflicts (companion page, section 4, D2 to D4)."""

from __future__ import annotations

from unittest.mock import Mock

import numpy as np
import pytest

from tests.reference_joint import all_partitions, label_of, validity
from tracking.papers.joint import division_kernels
from tracking.papers.joint import group_proposal_kernels as events
from tracking.papers.joint.config import JointConfig
from tracking.papers.joint.report import ReportedEvents

SCALES = np.array([0.5, 2.0])
BIAS = -1
COUNT = 20_000


def weights(merge=-100.0, split=-100.0):
    table = np.zeros((2, 7))
    table[:, BIAS] = merge, split
    return table


def rules(ratio=0.25, sharpness=8.0, every=False, mean=1.0, std=np.inf):
    return np.array([ratio, sharpness, every, mean, std])


def proposed(pos, label, table, rule=None, count=COUNT, seed=0):
    """The partitions (count, K) drawn from one partition of standing people."""
    pos = np.asarray(pos, float)
    state = np.concatenate([pos, np.zeros_like(pos)], axis=1)[None]
    labels = np.tile(np.asarray(label, np.int64), (1, count, 1))
    uniforms = np.random.default_rng(seed).random((1, count, len(pos), 3))
    events.propose(state, state, labels, uniforms, table, rules() if rule is None else rule, SCALES)
    return labels[0]


def share(drawn, label):
    return float((drawn == np.asarray(label)).all(axis=1).mean())


def test_without_events_partitions_stay():
    label = [1, 1, 0, 4, 4]
    drawn = proposed(np.arange(10).reshape(5, 2), label, weights(), count=50)
    assert (drawn == label).all()


def test_a_pair_of_people_merges_once_with_its_probability():
    """Two people are each other's nearest: the pair draws its merge once, though both are visited (D3)."""
    probability = 1 / (1 + np.exp(1.0))
    hazard = 1 - (1 - probability) ** 0.25
    drawn = proposed([[0, 0], [1, 0]], [0, 0], weights(merge=-1.0))
    assert share(drawn, [1, 1]) == pytest.approx(hazard, abs=0.01)


def test_the_rate_of_events_does_not_depend_on_the_frame_rate():
    features = np.array([2.0, 0.3, 0.5, 1.5, 0.2, 0.6])
    config, quiet = JointConfig(), []
    for dt in (0.1, 0.05):
        p = sum(events.event_probabilities(features, 2.0, 1.0, config.classifier, config.rules(dt)))
        quiet.append((1 - p) ** (1 / dt))
    assert quiet[0] == pytest.approx(quiet[1])


def test_the_size_prior_acts_on_merges_or_on_all_events():
    features, table = np.zeros(8), weights(0.0, 0.0)

    def odds(every, size, other, std=1.5):
        merge, split = events.event_probabilities(features, size, other, table, rules(1.0, every=every, std=std))
        return merge / (1 - merge - split), split / (1 - merge - split)

    assert odds(True, 3, 3, std=np.inf) == pytest.approx((1, 1))
    assert odds(False, 3, 3) == pytest.approx((np.exp(-(25 / 4.5)), 1))
    assert odds(True, 6, 1)[1] == pytest.approx(106, rel=0.01)
    assert odds(True, 4, 1)[1] == pytest.approx(5.9, rel=0.02)


def test_a_group_splits_into_all_pairs_of_parts_by_their_validity():
    pos = np.array([[0, 0], [0.6, 0], [2.0, 0], [2.7, 0.1]])
    drawn = proposed(pos, [1, 1, 1, 1], weights(split=100.0), rules(ratio=1.0))
    points = np.concatenate([pos, np.zeros_like(pos)], axis=1)
    parts = [p for p in all_partitions(4) if len(p) == 2]
    energy = np.array([validity(points, p, *SCALES) for p in parts])
    expected = np.exp(-8 * energy) / np.exp(-8 * energy).sum()
    for p, probability in zip(parts, expected, strict=True):
        assert share(drawn, label_of(p)) == pytest.approx(probability, abs=0.012)


def test_of_a_large_group_the_cut_between_two_clumps_is_found():
    rng = np.random.default_rng(1)
    pos = np.concatenate([rng.normal(0, 0.3, (5, 2)), rng.normal([3, 0], 0.3, (4, 2))])
    order = rng.permutation(9)
    drawn = proposed(pos[order], np.ones(9), weights(split=100.0), rules(ratio=1.0, sharpness=50.0), count=500)
    true = label_of([np.flatnonzero(order < 5).tolist(), np.flatnonzero(order >= 5).tolist()])
    assert share(drawn, true) > 0.9


MERGES = [
    # three people in a row: two of them merge, the third cannot join in the same frame (D3)
    ([[0, 0], [1, 0], [2, 0]], [0, 0, 0], {(1, 1, 0), (0, 2, 2)}),
    # a group merges with the nearest one only
    ([[0, 0], [0.8, 0], [3, 0], [9, 0]], [1, 1, 0, 0], {(1, 1, 1, 0), (1, 1, 3, 3)}),
]


@pytest.mark.parametrize(("pos", "label", "outcomes"), MERGES)
def test_a_group_takes_part_in_one_event_of_a_frame_and_merges_with_the_nearest(pos, label, outcomes):
    drawn = proposed(pos, label, weights(merge=100.0), rules(ratio=1.0))
    assert {tuple(d) for d in drawn.tolist()} == outcomes


def test_features_are_those_of_the_definition():
    early = np.array([[0, 0, 1, 0], [1, 0, 1, 0], [4, 1, 0, 0.5]], float)
    late = early + np.array([0.2, 0, 0, 0])
    features, (nearest, cluster, head) = np.empty((3, 6)), np.empty((3, 3), np.int64)
    found = features, nearest, cluster, head, np.empty((3, 9))
    count = events.partition_features(early, late, np.array([1, 1, 0]), *found)
    assert (count, nearest[:2].tolist(), cluster.tolist(), head[:2].tolist()) == (2, [1, 0], [0, 0, 1], [0, 2])
    prior = events.PRIOR**2 * np.eye(2)
    A, B = (np.diag([0.5, 0]) + prior) / 3, prior / 2
    d = np.array([3.5, 1])
    inverse = np.linalg.inv(A), np.linalg.inv(B)
    kl = (np.trace(inverse[0] @ B) + np.trace(inverse[1] @ A) - 4 + d @ (inverse[0] + inverse[1]) @ d) / 2
    expected = [min(np.log1p(kl), events.LOG_KL_MOST), np.hypot(1, 0.5), 0.5]
    np.testing.assert_allclose(features[0], expected * 2)
    np.testing.assert_allclose(features[1, [2, 5]], 0)


@pytest.mark.parametrize("count", [2, 4, 6, 7, 10])
def test_candidate_divisions_are_proper_and_different(count):
    sides = division_kernels.candidates(np.random.default_rng(count).normal(0, 1, (count, 2)))
    assert (sides.min(axis=1) == 0).all()
    assert (sides.max(axis=1) == 1).all()
    if count <= division_kernels.MOST_LISTED:
        folded = {tuple(s if s[0] == 0 else 1 - s) for s in sides}
        assert len(folded) == len(sides) == 2 ** (count - 1) - 1


def placed(pos, label, count=4000):
    """The partitions after the last person, alone so far, was placed."""
    points = np.concatenate([np.asarray(pos, float), np.zeros((len(pos), 2))], axis=1)[None]
    labels = np.tile(np.asarray(label, np.int64), (1, count, 1))
    uniforms = np.random.default_rng(0).random((1, count, 1))
    division_kernels.place_newcomers(points, labels, uniforms, 8.0, SCALES)
    return labels[0]


@pytest.mark.parametrize("away", [0.7, 1.5, 3.0])
def test_a_newcomer_joins_the_nearest_person_by_the_validity(away):
    points = np.array([[0, 0], [away, 0]])
    apart, together = (validity(points, p, *SCALES) for p in ([[0], [1]], [[0, 1]]))
    expected = np.exp(-8 * together) / (np.exp(-8 * together) + np.exp(-8 * apart))
    assert share(placed(points, [0, 0]), [1, 1]) == pytest.approx(expected, abs=0.025)
    assert (expected > 0.5) == (away < 1.5) or away == 1.5


def placed_slowly(points, label, uniforms):
    """New people, the last ones, join the nearest cluster, one after the other; all clusters are looked at. Changes
    label (K,)."""
    n = len(points)
    for person in range(n - len(uniforms), n):
        heads = [k for k in range(n) if label[k] in (0, k + 1)]
        members = {k: np.flatnonzero(label == k + 1) if label[k] else np.array([k]) for k in heads}
        if label[person] > 0 or len(heads) < 2:
            continue
        others = [k for k in heads if k != person]
        away = [np.linalg.norm(points[members[k], :2].mean(axis=0) - points[person, :2]) for k in others]
        near = members[others[int(np.argmin(away))]]
        both = points[np.concatenate([[person], near])]
        apart, together = (validity(both, p, *SCALES) for p in ([[0], [*range(1, len(both))]], [[*range(len(both))]]))
        if uniforms[person - n + len(uniforms)] < 1 / (1 + np.exp(min(8.0 * (together - apart), 700))):
            rows = np.append(near, person)
            label[rows] = 1 + rows.min()


def test_many_newcomers_join_as_with_a_look_at_all_clusters():
    """60 people, 45 of them new, one far away: newcomers join groups, people and each other."""
    rng = np.random.default_rng(6)
    points = np.concatenate([rng.uniform(0, 12, (3, 59, 2)), rng.normal(0, 0.5, (3, 59, 2))], axis=2)
    points = np.concatenate([points, np.full((3, 1, 4), 300.0)], axis=1)
    labels = np.zeros((3, 6, 60), np.int64)
    labels[:, :, [0, 4]], labels[:, 3:, [5, 7, 9]] = 1, 6
    uniforms = rng.random((3, 6, 45))
    expected = labels.copy()
    for i, j in np.ndindex(3, 6):
        placed_slowly(points[i], expected[i, j], uniforms[i, j])
    division_kernels.place_newcomers(points, labels, uniforms, 8.0, SCALES)
    assert np.array_equal(labels, expected)
    assert (labels[..., 15:] > 15).any()
    assert ((labels[..., 15:] > 0) & (labels[..., 15:] <= 15)).any()


FPS = 10.0


def reported(pos, partitions, log_odds=1.0, measured=1000):
    """The events of a sequence; pos (T, P, 2), nan where absent; partitions: frame (from 0) to groups, from then on;
    log_odds: of all pairs; measured: frames in which people are measured."""
    report, parts, out = ReportedEvents(FPS), [], []
    for t, place in enumerate(pos):
        there = np.flatnonzero(np.isfinite(place[:, 0]))
        parts, every = partitions.get(t, parts), np.ones(len(there), bool)
        report._lasting = Mock(return_value=[frozenset(p) for p in parts])
        report.belief = Mock(log_odds=np.full((len(there),) * 2, log_odds), seen=every.copy)
        report.add(t + 1, there + 11, place[there], every & (t < measured))
        out += report.events({}, 2.0)
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
    doubted = reported(two(gap), {70: [(11, 12)], 130: []}, log_odds=-1.0)
    assert [e.kind for e in doubted] == ["form"], "who parts was never together"
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
    gap = np.concatenate([np.ones(50), np.linspace(1, 6, 50), np.full(400, 6)])
    assert not reported(two(gap), {0: [(11, 12)], 440: []})


def test_a_leave_is_dated_by_the_last_measurement():
    pos = two(np.ones(80))
    pos[70:] = np.nan
    (leave,) = reported(pos, {0: [(11, 12)], 70: []}, measured=50)
    assert (leave.kind, leave.start, leave.emitted) == ("leave", 50, 71)


@pytest.mark.parametrize(("measured", "kinds"), [(60, []), (1000, ["dissolve"])])
def test_who_is_missed_stays_in_the_group(measured, kinds):
    pos, report, out = two(np.concatenate([np.ones(60), np.linspace(1, 8, 40)])), ReportedEvents(FPS), []
    pos[:, :, 0] = np.arange(100)[:, None] / FPS
    report.belief.add(np.concatenate([pos[0], [[1.0, 0.0]] * 2], axis=1))
    for t in range(100):
        report.add(t + 1, np.array([1, 2]), pos[t], np.array([True, t < measured]))
        out += report.events({}, 1.0)
    assert [e.kind for e in out] == kinds
