"""Scores of groups on cases small enough to be worked out by hand, most of them such as a naive version gets wrong."""

from __future__ import annotations

import numpy as np
import pytest

from sim.geometry.polygons import footprint_hulls
from tests.hand_made import Scene, event, tracks, truth
from tracking.scoring import evaluate
from tracking.scoring.group_rows import true_groups
from tracking.scoring.people import true_people

APART = {1: (0.5, 0.5), 2: (1.5, 0.5), 3: (3.2, 0.5), 4: (3.8, 0.5)}


def near(value: float):
    return pytest.approx(value, abs=1e-12)


def scores(true, est, events=(), **options):
    return evaluate(truth(true, events), tracks(est), **options)


def test_one_giant_group_is_not_two():
    # Hulls 2 x 1, 1 x 1 and 5 x 1: IoU 2/5 and 1/5, so the first is matched: TP 1, FN 1, FP 0. All its people are
    # inside (GDSR 1/2), but only 2 of the giant's 4 are right (GDSR2 0). Jaccard 2/4: nothing is found (F1 0).
    # Middles (1, 0.5) and (2.5, 0.5): 1.5 m.
    true = [Scene(APART, {1: ((1, 2), (0, 0, 2, 1)), 2: ((3, 4), (3, 0, 4, 1))})]
    found = scores(true, [Scene(APART, {9: ((1, 2, 3, 4), (0, 0, 5, 1))})])
    expected = {
        "TP": 1, "FN": 1, "FP": 0, "1-FP": 1, "1-FN": 0.5, "GDSR": 0.5, "GDSR2": 0, "MOTP": 1.5, "MOTA": 0.5,
        "F1": 0, "precision": 0, "recall": 0,
    }  # fmt: skip
    for key, value in expected.items():
        assert found[f"group_{key}"] == near(value), key


@pytest.mark.parametrize(("size", "enough"), [(2, 2), (3, 2), (4, 3), (5, 3), (6, 4), (7, 5), (8, 5), (35, 21)])
def test_a_group_is_right_with_60_percent_of_its_people(size, enough):
    # ceil(0.6 n); of 5 three are exactly 60 %, of 35 twenty-one are, whatever 0.6 x 35 is in floating point.
    people = {k: (3.0 * k, 0.0) for k in range(1, size + 3)}

    def found(inside):
        told = (*range(1, inside + 1), size + 1, size + 2)
        est = [Scene(people, {1: (told, (0, -1, 150, 1))})]
        return scores([Scene(people, {1: (range(1, size + 1), (0, -1, 150, 1))})], est)["group_GDSR"]

    assert (found(enough - 1), found(enough)) == (0, 1)


@pytest.mark.parametrize(("wrong", "clean"), [(1, 1), (2, 1), (3, 0)])
def test_an_estimated_group_is_clean_with_60_percent_right_ones(wrong, clean):
    # 3 true people; 3 of 4 and 3 of 5 (exactly 60 %) are enough, 3 of 6 is not.
    people = {k: (0.5 * k, 0.0) for k in range(1, 8)}
    true = [Scene(people, {1: ((1, 2, 3), None)})]
    found = scores(true, [Scene(people, {1: (tuple(range(1, 4 + wrong)), None)})])
    assert found["group_GDSR"] == 1
    assert found["group_GDSR2"] == clean


@pytest.mark.parametrize("unit", ["person", "group"])
@pytest.mark.parametrize("apart", [0.5, 0.75, 1.2])
def test_a_right_pair_is_found_whatever_the_centimetres(apart, unit):
    """Errors of 0.15 m (standard deviation): the pair is right, though its hull often overlaps by less than half."""
    place, r = np.array([(0.0, 0.0), (apart, 0.0)]), np.random.default_rng(0)
    seen = [place + r.normal(0, 0.15, (2, 2)) for _ in range(200)]
    pair = {1: ((1, 2), None)}

    def sides(places):
        scenes = [Scene(dict(enumerate(map(tuple, p), 1)), pair) for p in places]
        hulls = [(footprint_hulls(p, np.array([2]))[0],) for p in places]
        return scenes, hulls

    (true_scenes, true_hulls), (est_scenes, est_hulls) = sides([place] * len(seen)), sides(seen)
    true, est = truth(true_scenes), tracks(est_scenes, unit=unit)
    true = true.replace(groups=tuple(g.replace(hull=h) for g, h in zip(true.groups, true_hulls, strict=True)))
    found = evaluate(true, [t.replace(groups=t.groups.replace(hull=h)) for t, h in zip(est, est_hulls, strict=True)])
    assert found["group_F1"] > 0.99
    assert found["group_F1_hull"] < 0.8


def test_a_method_without_members_has_the_people_in_its_hulls():
    # Hull [0, 2] x [0, 1]. Who stands 0.29 m beside it is in it, 0.31 m is not.
    def found(x):
        people = {1: (0.5, 0.5), 2: (1.5, 0.5), 3: (2 + x, 0.5)}
        true = truth([Scene(people, {1: ((1, 2), None)})])
        return evaluate(true, tracks([Scene({}, {1: ((), (0, 0, 2, 1))})], unit="group"))

    assert found(0.31)["pairwise_precision"] == 1
    assert found(0.29)["pairwise_precision"] == near(1 / 3)
    assert np.isnan(found(0.31)["HOTA"])
    assert found(0.31)["objective"] == found(0.31)["group_F1"]


@pytest.mark.parametrize("events", [None, [event("merge", 1, (1, 2))]])
def test_wholes_in_the_image_of_unknown_scale_have_scores_of_events_alone(events):
    true = truth([Scene(APART, {1: ((1, 2), None)})], events, px_per_m=float("nan"))
    found = evaluate(true, tracks([Scene({}, {1: ((), (0, 0, 2, 1))})], unit="group", plane="image"))
    known = {key for key, value in found.items() if not np.isnan(value)}
    assert ("merge_FN" in known) == bool(known) == (events is not None)
    assert not any(key.startswith(("group", "pairwise")) for key in known)


@pytest.mark.parametrize(("late", "core"), [(10, 1), (11, 1), (12, 18 / 19)])
def test_the_core_forgives_one_second(late, core):
    # 10 fps, 50 frames, a group that is there from frame 21 on (an event). Told n frames late it is missed in n of its
    # 30 frames. The core leaves out 11 … 31, so that 19 are left (32 … 50), of which 12 frames late misses frame 32.
    def frames(first):
        return [Scene(APART, {1: ((1, 2), None)} if k >= first else {}) for k in range(1, 51)]

    found = scores(frames(21), frames(21 + late), [event("form", 21, (1, 2))])
    assert found["group_1-FN"] == near(1 - late / 30)
    assert found["group_1-FN_core"] == near(core)


def test_only_merges_and_splits_have_a_core():
    scene = [Scene(APART, {1: ((1, 2), None)})] * 40
    for kind, left in (("merge", 19), ("split", 19), ("dissolve", 19), ("cross", 40), ("queue", 40), ("enter", 40)):
        assert scores(scene, scene, [event(kind, 20, (1, 2))])["group_TP_core"] == left, kind


def test_the_objective_is_the_mean_of_people_and_groups():
    # The people are perfect; of two groups one is found: F1 2/3.
    true = [Scene(APART, {1: ((1, 2), None), 2: ((3, 4), None)})]
    found = scores(true, [Scene(APART, {1: ((1, 2), None)})])
    assert found["HOTA"] == near(1)
    assert found["objective"] == near((1 + 2 / 3) / 2)
    # Where no groups are labelled it is HOTA, and no score of groups is known, least of all 0.
    bare = evaluate(truth(true, None, groups=None), tracks(true))
    assert bare["objective"] == bare["HOTA"] == near(1)
    unknown = ("group", "pairwise", "GMITRE", "right", "exact", "event", "merge")
    assert np.isnan([v for k, v in bare.items() if k.startswith(unknown)]).all()


def test_in_the_image_the_hulls_of_the_image_are_compared():
    # The same people, 40 px per metre: hulls in px equal those of the tracks; on the ground they are elsewhere.
    ground = [Scene(APART, {1: ((1, 2), None)})]
    px = {p: (40 * x, 40 * y) for p, (x, y) in APART.items()}
    image = [Scene(px, {1: ((1, 2), (0, 0, 80, 40))})]
    box = np.array([(x - 10, y - 10, 20, 20) for x, y in px.values()], float)
    true = truth(ground, box=box, groups_px=(image[0].groups(),))
    found = evaluate(true, tracks(image, plane="image"))
    assert found.surface == "image"
    assert found["group_F1"] == found["pairwise_F1"] == found["HOTA"] == near(1)
    shifted = [Scene(px, {1: ((1, 2), (60, 0, 140, 40))})]  # middles 60 px apart
    assert evaluate(true, tracks(shifted, plane="image"))["group_MOTP"] == near(60)


def test_members_are_renumbered_and_unknown_ones_stay_unknown():
    scene = Scene(APART, {1: ((1, 2), None), 2: ((3, 9), (0, 0, 2, 1))})
    true, n = truth([scene] * 4), len(APART)
    people = true_people(true, np.ones(5, bool))
    groups = true_groups(true, np.arange(5) > 0, people.rows, "ground")
    assert groups.groups.member.tolist() == [k + m if m >= 0 else -1 for k in range(0, 4 * n, n) for m in (0, 1, 2, -1)]
    for frames, starts in (((2, 4), (0, n)), ((3,), (0,)), ((1, 2, 3, 4), range(0, 4 * n, n)), ((), ())):
        kept = groups.in_frames(np.isin(np.arange(5), frames), people.rows).groups
        assert kept.member.tolist() == [k + m if m >= 0 else -1 for k in starts for m in (0, 1, 2, -1)]
        assert kept.rows.frame.tolist() == np.repeat(frames, 2).tolist()
        assert (kept.count.tolist(), len(kept.hull)) == ([2] * len(kept), len(kept))
