"""The objective by itself is the one of `evaluate`, whatever the tracker says; kernels against their twins."""

from __future__ import annotations

import dataclasses
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from scenarios.loading.resolve import load
from sim.geometry.footprints import footprint_hulls
from sim.geometry.polygons import convex_hull, iou_matrix
from sim.sequence import simulate
from sim.types import Groups
from tracking import objective_kernels as kernels
from tracking.grouping.group_labels import label_people
from tracking.grouping.grouped_tracks import with_groups
from tracking.grouping.link_rule import LinkRule, find_links
from tracking.objective import DISC, FLAT, Judge, Shapes, f1
from tracking.scoring import evaluate

KEYS = ("objective", "HOTA", "group_F1_hull")


@pytest.fixture(scope="module")
def crowd():
    return simulate(load("crowd", ["camera.fps=5", "duration=10", "sensor.clutter_rate=2"]), 3, 0, ())


def same(found, expected):
    assert [found[k] for k in KEYS] == pytest.approx([expected[k] for k in KEYS], abs=1e-12, nan_ok=True)


def raw(name, sequence, **options):
    """Answers without derived groups, and the scale."""
    from tracking.prepare import prepare

    ready = prepare(name, sequence, **options)
    ready.reset(0)
    made = [ready.step(frame) for frame in ready.frames()]
    return made, ready.px_per_m(made)


@pytest.mark.parametrize("name", ["blob", "group-pda"])
@pytest.mark.parametrize("scenario", ["merge", "split", "queue", "party", "side-by-side"])
def test_on_scenes(name, scenario):
    sequence = simulate(load(scenario, ["camera.fps=5"]), 7, 0, ())
    made, scale = raw(name, sequence)
    judge = Judge(sequence.truth)
    for last in (1, 9, 30, len(made)):
        answers = with_groups(made[:last], sequence.fps, scale)
        same(judge.scores(made[:last], scale), evaluate(sequence.truth, answers, frames=last))
    assert 0 < judge.scores(made, scale)["objective"] < 1


@pytest.mark.parametrize("name", ["blob", "group-pda"])
def test_in_a_crowd_with_false_alarms(name, crowd):
    made, scale = raw(name, crowd)
    same(Judge(crowd.truth).scores(made, scale), evaluate(crowd.truth, with_groups(made, crowd.fps, scale)))


def test_in_the_image(crowd):
    flat = dataclasses.replace(crowd, camera=None, px_per_m=40.0, load_truth=lambda: in_image(crowd.truth))
    made, scale = raw("blob", flat)
    assert made[5].plane == "image"
    expected = evaluate(flat.truth, with_groups(made, flat.fps, scale))
    same(Judge(flat.truth).scores(made, scale), expected)
    assert expected["group_F1_hull"] > 0
    unboxed = [t.replace(box=None) for t in made]
    same(Judge(flat.truth).scores(unboxed, scale), evaluate(flat.truth, with_groups(unboxed, flat.fps, scale)))
    same(Judge(flat.truth).scores(unboxed, np.nan), evaluate(flat.truth, with_groups(unboxed, flat.fps, np.nan)))


def in_image(truth):
    return dataclasses.replace(truth, px_per_m=40.0)


def test_what_a_tracker_names_itself(crowd):
    """Labels of its own, groups of its own, derived ones."""
    made, scale = raw("blob", crowd)
    labelled = [t.replace(group=np.where(t.id % 3 == 0, t.id // 9, -1)) for t in made]
    derived = with_groups(made, crowd.fps, scale)
    own = [t.replace(group=np.full(len(t.id), -1), derived=False, events=()) for t in derived]
    judge = Judge(crowd.truth)
    for answers in (labelled, derived, own):
        same(judge.scores(answers, scale), evaluate(crowd.truth, with_groups(answers, crowd.fps, scale)))


def test_wholes_of_every_shape(crowd):
    """Hulls without vertices, of one or two, clockwise, not convex, on top of each other; no groups at all."""
    made, scale = raw("group-pda", crowd)
    rng = np.random.default_rng(4)

    answers = []
    for t in made:
        g, hulls = t.groups, []
        for h in g.hull:
            star = np.concatenate([h, (h[:1] + h.mean(0)) / 2])
            kinds = [h, h[:0], h[:1], h[:2], h[::-1], star, 2 * h - h.mean(0)]
            hulls.append(kinds[rng.integers(len(kinds))])
        answers.append(t.replace(groups=g.replace(hull=tuple(hulls))))
    answers[3] = answers[3].replace(groups=None)
    answers[4] = answers[4].replace(groups=Groups.none())
    same(Judge(crowd.truth).scores(answers, scale), evaluate(crowd.truth, answers))


def test_nothing_answered_and_nothing_labelled(crowd):
    judge = Judge(crowd.truth)
    assert np.isnan(judge.scores([], 1.0)["group_F1_hull"]) or judge.scores([], 1.0)["group_F1_hull"] == 0
    bare = dataclasses.replace(crowd.truth, groups=None, groups_px=None, events=None)
    made, scale = raw("blob", crowd)
    same(Judge(bare).scores(made, scale), evaluate(bare, made))
    part = dataclasses.replace(crowd.truth, labelled=np.arange(crowd.truth.length) % 3 == 0)
    same(Judge(part).scores(made, scale), evaluate(part, with_groups(made, crowd.fps, scale)))


@settings(deadline=None)
@given(st.integers(0, 10_000))
def test_overlaps_of_hulls(seed):
    rng = np.random.default_rng(seed)
    count = rng.integers(1, 6, 4)
    hulls = footprint_hulls(rng.normal(0, 0.7, (count.sum(), 2)), count)
    shapes = Shapes.made(
        np.ones(4, np.int64), np.zeros((4, 2)), np.concatenate(hulls), np.cumsum([len(h) for h in hulls])
    )
    assert shapes.regular.all()
    i, j = (g.ravel() for g in np.indices((4, 4)))
    made = kernels.overlaps(shapes.vertex, shapes.ends, shapes.area, shapes.vertex, shapes.ends, shapes.area, i, j)
    assert made.reshape(4, 4) == pytest.approx(iou_matrix(hulls, hulls), abs=1e-9)
    near = kernels.candidates(shapes.frame, shapes.box, shapes.area, shapes.frame, shapes.box, shapes.area, 0.5)
    found = set(zip(*(rows.tolist() for rows in near), strict=True))
    assert all((a, b) in found for a, b, s in zip(i, j, made, strict=True) if s >= 0.5)


@settings(deadline=None)
@given(st.integers(0, 10_000), st.booleans())
def test_footprints(seed, whole):
    """Also of people who stand on a line, on each other, or alone."""
    rng = np.random.default_rng(seed)
    count = rng.integers(1, 6, 5)
    pos = rng.integers(-2, 3, (count.sum(), 2)).astype(float) if whole else rng.normal(0, 1, (count.sum(), 2))
    vertex, ends = kernels.footprints(pos, np.cumsum(count), DISC)
    made = [vertex[a:b] for a, b in pairwise([0, *ends])]
    area, _, regular = kernels.measure(vertex, ends, FLAT)
    assert regular.all()
    for mine, twin, own in zip(made, footprint_hulls(pos, count), area, strict=True):
        assert iou_matrix([mine], [twin])[0, 0] == pytest.approx(1, abs=1e-9)
        assert own == pytest.approx(kernels.measure(twin, np.array([len(twin)]), FLAT)[0][0], abs=1e-9)


@settings(deadline=None)
@given(st.integers(0, 10_000))
def test_hulls_of_points(seed):
    rng = np.random.default_rng(seed)
    points = rng.integers(0, 4, (rng.integers(1, 12), 2)).astype(float)
    vertex, ends = kernels.footprints(points, np.array([len(points)]), np.zeros((1, 2)))
    assert {tuple(p) for p in vertex.tolist()} == {tuple(p) for p in convex_hull(points).tolist()}
    assert ends.tolist() == [len(vertex)]


@settings(deadline=None)
@given(st.integers(0, 10_000))
def test_partitions_are_those_of_the_rule(seed):
    """Who is with whom in each frame, names apart; people come, go, and are not seen for a while."""
    rng = np.random.default_rng(seed)
    length, people = 40, 7
    walk = np.cumsum(rng.normal(0, 0.12, (length, people, 2)), 0) + rng.uniform(0, 3, (people, 2))
    seen = rng.random((length, people)) < 0.8
    frame, column = np.nonzero(seen)
    pos, rule, fps = walk[frame, column], LinkRule(window=0.6, patience=0.4, acquaintance=0.2, memory=0.3), 10.0
    links = find_links(frame, column, pos, np.zeros_like(pos), length, fps, rule)
    places = np.where(seen[..., None], walk, np.nan)
    expected = label_people(frame, column, places, links, fps, rule)[0]
    made = kernels.partition(frame, column, length, people, 3, links.frame, links.a, links.b, links.on)
    for t in range(length):
        here = frame == t
        assert together(column[here], made[here]) == together(column[here], expected[here])


def together(who, label):
    return {frozenset(who[label == g].tolist()) for g in set(label[label >= 0].tolist())}


def test_f1_where_overlaps_are_a_half_or_have_rivals():
    """Squares: 0.5 exactly counts; of two partners one is taken."""
    square = np.array([[0.0, 0], [2, 0], [2, 1], [0, 1]])

    def shapes(*polygons):
        n = len(polygons)
        ends = np.cumsum([len(p) for p in polygons])
        return Shapes.made(
            np.ones(n, np.int64), np.array([p.mean(0) for p in polygons]), np.concatenate(polygons), ends
        )

    half = square * [0.5, 1]
    assert f1(shapes(square), shapes(half)) == 1
    assert f1(shapes(square), shapes(half * [0.99999, 1])) == 0
    assert f1(shapes(square), shapes(square * 0.9, square * [0.8, 1])) == pytest.approx(2 / 3)
    assert f1(shapes(square, square * 0.9), shapes(square * 0.95, square * 0.8)) == 1
    assert np.isnan(f1(shapes(square).until(0), shapes(square).until(0)))


def test_people_inside_are_counted_to_two():
    box = np.array([[0.0, 0], [2, 0], [2, 2], [0, 2]])
    shape = Shapes.made(np.array([1, 2, 3, 4]), np.zeros((4, 2)), np.tile(box, (4, 1)), 4 * np.arange(1, 5))
    place = np.array([[1.0, 1], [2.2, 1], [1, 1], [2.4, 1], [1, 1], [2.3, 1]])
    frame = np.array([1, 1, 2, 2, 3, 3])
    made = kernels.inside(
        frame[[0, 2, 4]], shape.vertex, shape.ends[:3], shape.box, shape.regular, frame, place, 0.3, 1e-7
    )
    assert made.tolist() == [2, 1, -1]
