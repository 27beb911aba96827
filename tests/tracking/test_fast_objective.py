"""The objective by itself is the one of `evaluate`, whatever the tracker reports."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from scenarios.loading.resolve import load
from sim.sequence import simulate
from sim.types import Groups
from tracking.fast_objective import ObjectiveScorer
from tracking.grouping.belief import default_belief
from tracking.grouping.group_events import TrackedMotion
from tracking.grouping.group_labels import label_people
from tracking.grouping.grouped_tracks import with_groups
from tracking.grouping.grouping_choice import belief_groups, groups_now
from tracking.grouping.tracks_table import TracksTable
from tracking.scoring import evaluate

KEYS = ("objective", "HOTA", "group_F1")


@pytest.fixture(scope="module")
def crowd():
    return simulate(load("crowd", ["camera.fps=5", "duration=10", "sensor.clutter_rate=2"]), 3, 0, ())


def agree(truth, answers, scale, fps=5.0, last=None):
    """Whether the scores of the first answers are those of `evaluate`, which are returned."""
    found = ObjectiveScorer(truth).scores(answers[:last], scale)
    expected = evaluate(truth, with_groups(answers[:last], fps, scale), frames=last)
    assert [found[k] for k in KEYS] == pytest.approx([expected[k] for k in KEYS], abs=1e-12, nan_ok=True)
    return expected


def raw(name, sequence, **options):
    """Answers without derived groups, and the scale."""
    from tracking.running.prepare import prepare

    ready = prepare(name, sequence, **options)
    ready.reset(0)
    made = [ready.step(frame) for frame in ready.frames()]
    return made, ready.px_per_m(made)


@pytest.mark.parametrize("name", ["blob", "group-pda"])
@pytest.mark.parametrize("scenario", ["merge", "split", "queue", "party", "side-by-side"])
def test_on_scenes(name, scenario):
    sequence = simulate(load(scenario, ["camera.fps=5"]), 7, 0, ())
    made, scale = raw(name, sequence)
    for last in (1, 30, len(made)):
        whole = agree(sequence.truth, made, scale, last=last)
    assert 0 < whole["objective"] < 1


@pytest.mark.parametrize("name", ["blob", "group-pda"])
def test_in_a_crowd_with_false_alarms(name, crowd):
    agree(crowd.truth, *raw(name, crowd))


def test_in_the_image(crowd):
    labels = dataclasses.replace(crowd.truth, px_per_m=40.0)
    flat = dataclasses.replace(crowd, camera=None, px_per_m=40.0, load_truth=lambda: labels)
    truth, (made, scale) = flat.truth, raw("blob", flat)
    assert made[5].plane == "image"
    assert agree(truth, made, scale)["group_F1"] > 0
    unboxed = [t.replace(box=None) for t in made]
    for unit in (scale, np.nan):
        agree(truth, unboxed, unit)


def test_what_a_tracker_names_itself(crowd):
    """Labels of its own, groups of its own, derived ones."""
    made, scale = raw("blob", crowd)
    labelled = [t.replace(group=np.where(t.id % 3 == 0, t.id // 9, -1)) for t in made]
    derived = with_groups(made, crowd.fps, scale)
    own = [t.replace(group=np.full(len(t.id), -1), derived=False, events=()) for t in derived]
    for answers in (labelled, derived, own):
        agree(crowd.truth, answers, scale)


def test_wholes_of_every_shape(crowd):
    """Hulls without vertices, of one or two, clockwise, not convex, on top of each other; no groups at all."""
    made, scale = raw("group-pda", crowd)
    rng, answers = np.random.default_rng(4), []
    for t in made:
        g, hulls = t.groups, []
        for h in g.hull:
            star = np.concatenate([h, (h[:1] + h.mean(0)) / 2])
            kinds = [h, h[:0], h[:1], h[:2], h[::-1], star, 2 * h - h.mean(0)]
            hulls.append(kinds[rng.integers(len(kinds))])
        answers.append(t.replace(groups=g.replace(hull=tuple(hulls))))
    answers[3] = answers[3].replace(groups=None)
    answers[4] = answers[4].replace(groups=Groups.none())
    agree(crowd.truth, answers, scale)


def test_nothing_answered_and_nothing_labelled(crowd):
    scorer = ObjectiveScorer(crowd.truth)
    assert np.isnan(scorer.scores([], 1.0)["group_F1"]) or scorer.scores([], 1.0)["group_F1"] == 0
    bare = dataclasses.replace(crowd.truth, groups=None, groups_px=None, events=None)
    made, scale = raw("blob", crowd)
    agree(bare, made, scale)
    part = dataclasses.replace(crowd.truth, labelled=np.arange(crowd.truth.length) % 3 == 0)
    agree(part, made, scale)


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 10_000))
def test_partitions_are_those_of_the_grouping(seed):
    """Who is with whom in each frame, names apart; people come, go, and are not seen for a while."""
    rng = np.random.default_rng(seed)
    length, people, fps, belief = 60, 7, 10.0, default_belief()
    walk = np.cumsum(rng.normal(0, 0.06, (length, people, 2)), 0) + rng.uniform(0, 2, (people, 2))
    seen = rng.random((length, people)) < 0.8
    frame, column = np.nonzero(seen)
    pos, alone = walk[frame, column], np.full(len(frame), -1)
    table = TracksTable(frame, column, column, np.arange(people), pos, np.zeros_like(pos), alone, length, 1.0)
    found = belief_groups(frame, column, pos, length, fps, belief)
    expected = label_people(frame, column, TrackedMotion(table.motion(), fps), found, belief)[0]
    made = groups_now(table, fps, belief)
    for t in range(length):
        here = frame == t
        sides = [{g for g in together(column[here], x[here]) if len(g) > 1} for x in (made, expected)]
        assert sides[0] == sides[1]


def together(who, label):
    return {frozenset(who[label == g].tolist()) for g in set(label[label >= 0].tolist())}
