"""Scores of groups on cases small enough to be worked out by hand, most of them such as a naive version gets wrong."""

from __future__ import annotations

import numpy as np
import pytest

from sim.geometry.polygons import footprint_hulls
from tests.hand_made import Scene, event, tracks, truth
from tracking.scoring import evaluate

APART = {1: (0.5, 0.5), 2: (1.5, 0.5), 3: (3.2, 0.5), 4: (3.8, 0.5)}


def near(value: float):
    return pytest.approx(value, abs=1e-12)


def scores(true, est, events=(), **options):
    return evaluate(truth(true, events), tracks(est), **options)


def test_one_giant_group_is_not_two():
    # Hulls 2 x 1, 1 x 1 and 5 x 1: IoU 2/5 and 1/5, so the first is matched: TP 1, FN 1, FP 0. All its people are
    # inside (GDSR 1/2), but only 2 of the giant's 4 are right (GDSR2 0). Jaccard 2/4: nothing is found (F1 0).
    # Middles (1, 0.5) and (2.5, 0.5): 1.5 m. Size 4 instead of 2.
    true = [Scene(APART, {1: ((1, 2), (0, 0, 2, 1)), 2: ((3, 4), (3, 0, 4, 1))})]
    found = scores(true, [Scene(APART, {9: ((1, 2, 3, 4), (0, 0, 5, 1))})])
    expected = {
        "TP": 1, "FN": 1, "FP": 0, "1-FP": 1, "1-FN": 0.5, "GDSR": 0.5, "GDSR2": 0, "MOTP": 1.5, "MOTA": 0.5,
        "F1": 0, "precision": 0, "recall": 0, "size_error": 2,
    }  # fmt: skip
    for key, value in expected.items():
        assert found[f"group_{key}"] == near(value), key


def test_sums_over_frames_are_not_means_over_frames():
    # Frame 1: two groups, both right. Frame 2: one group, right, and a false one. Sums: 1 - 1/3. Means: 1 - (0 + 1)/2.
    # Frame 3: nobody, a false group: sums 1 - 2/3; means 1 - (0 + 1 + 1)/3.
    two = {1: ((1, 2), None), 2: ((3, 4), None)}
    true = [Scene(APART, two), Scene(APART, {1: ((1, 2), None)}), Scene(APART)]
    found = scores(true, [Scene(APART, two), Scene(APART, two), Scene(APART, {1: ((1, 2), None)})])
    assert found["group_1-FP"] == near(1 / 3)
    assert found["group_1-FP_frames"] == near(1 / 3)
    assert found["group_1-FN"] == found["group_1-FN_frames"] == near(1)
    first = scores(true[:2], [Scene(APART, two)] * 2)
    assert first["group_1-FP"] == near(2 / 3)
    assert first["group_1-FP_frames"] == near(1 / 2)
    # The other way round the missed one is 1 of 3, or none of 2 and then 1 of 2.
    missed = scores([Scene(APART, two), Scene(APART, {1: ((1, 2), None)})], [Scene(APART, {1: ((1, 2), None)})] * 2)
    assert missed["group_1-FN"] == near(2 / 3)
    assert missed["group_1-FN_frames"] == near(3 / 4)


def test_hulls_that_only_touch_do_not_match():
    # One true and one estimated group, an edge in common: 1 missed, 1 false of 1: 1 - (1 + 1 + 0)/1 = -1.
    found = scores([Scene(APART, {1: ((1, 2), (0, 0, 2, 1))})], [Scene(APART, {1: ((3, 4), (2, 0, 4, 1))})])
    assert found["group_1-FP"] == found["group_1-FN"] == near(0)
    assert found["group_MOTA"] == near(-1)
    assert np.isnan(found["group_MOTP"])


def test_the_total_is_matched_and_what_is_found_is_matched_apart():
    # On a line: A = [0, 4], B = [3, 6]; P = [1, 5], Q = [-1.5, 2.5]. IoU A-P 3/5, A-Q 2.5/5.5, B-P 2/5, B-Q 0.
    # The nearest first would leave B alone; A-Q and B-P are 0.85 together: TP 2. Of 0.5 and more there is only A-P,
    # which F1 must not lose because the matching of all took P for B: 2 x 1 / 4.
    people = {1: (0.5, 0.5), 2: (1.5, 0.5), 3: (4.5, 0.5), 4: (5.5, 0.5)}
    true = [Scene(people, {1: ((1, 2), (0, 0, 4, 1)), 2: ((3, 4), (3, 0, 6, 1))})]
    found = scores(true, [Scene(people, {7: ((1, 2), (1, 0, 5, 1)), 8: ((3, 4), (-1.5, 0, 2.5, 1))})])
    assert (found["group_TP"], found["group_FP"], found["group_FN"]) == (2, 0, 0)
    assert found["group_F1_hull"] == near(0.5)


def test_a_switch_is_remembered_while_nobody_is_found():
    # The group is matched with 7, with nobody, with 8 (a switch from 7, not a fresh start), 8, 7 (another):
    # 1 - (1 missed + 2 switches)/5.
    def told(name):
        return Scene(APART, {name: ((1, 2), None)} if name else {})

    found = scores([told(1)] * 5, [told(7), told(0), told(8), told(8), told(7)])
    assert found["group_IDSW"] == 2
    assert found["group_MOTA"] == near(1 - 3 / 5)


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


def test_a_member_that_is_nobody_counts_as_a_wrong_one():
    # Tracks 3, 4, 5 stand where nobody is: 2 of 5 right, though all who are somebody are right.
    people = {1: (0.0, 0.0), 2: (1.0, 0.0)}
    ghosts = people | {3: (0.5, 9.0), 4: (0.6, 9.0), 5: (0.7, 9.0)}
    found = scores([Scene(people, {1: ((1, 2), (-1, -1, 2, 1))})], [Scene(ghosts, {1: (range(1, 6), (-1, -1, 2, 1))})])
    assert found["group_GDSR"] == 1
    assert found["group_GDSR2"] == 0
    assert found["pairwise_precision"] == near(1 / 10)  # 1 right pair of the 10 of five


def test_distances_with_and_without_a_gate():
    # Middles of the true 2 and 4.5, of the told 3 and 44.5. By hulls only 2-3 match: 1 m. By distance alone the others
    # do, too: (1 + 40)/2; the other way round it were (42.5 + 1.5)/2.
    people = {1: (0.5, 0.5), 2: (1.5, 0.5), 3: (3.2, 0.5), 4: (3.8, 0.5)}
    true = [Scene(people, {1: ((1, 2), (0, 0, 4, 1)), 2: ((3, 4), (4, 0, 5, 1))})]
    found = scores(true, [Scene(people, {1: ((1, 2), (1, 0, 5, 1)), 2: ((3, 4), (44, 0, 45, 1))})])
    assert (found["group_MOTP"], found["group_MSE"]) == (near(1), near(1))
    assert found["group_MOTP_ungated"] == near(20.5)


def test_hota_of_groups():
    # One group for 4 frames, told as 7, 7, 8, 8 with the very hull: DetA 1; each match's pair of identities shares 2
    # frames of 4 + 2 - 2: AssA 1/2; HOTA √(1/2). Identities found 2 of 4 (AssRe), all of theirs (AssPr).
    def told(name):
        return Scene(APART, {name: ((1, 2), None)})

    found = scores([told(1)] * 4, [told(7), told(7), told(8), told(8)])
    assert found["group_DetA"] == found["group_DetRe"] == found["group_DetPr"] == found["group_LocA"] == near(1)
    assert found["group_AssA"] == found["group_AssRe"] == near(0.5)
    assert found["group_AssPr"] == near(1)
    assert found["group_HOTA"] == near(0.5**0.5)


def test_extent_error_is_the_distance_of_gaussians():
    # On a line: places 0, 4 (mean 2, sd 2) and 4, 6 (mean 5, sd 1): √((5 - 2)² + (2 - 1)²).
    true = [Scene({1: (0.0, 0.5), 2: (4.0, 0.5)}, {1: ((1, 2), (0, 0, 4, 1))})]
    found = scores(true, [Scene({1: (4.0, 0.5), 2: (6.0, 0.5)}, {1: ((1, 2), (3, 0, 7, 1))})])
    assert found["group_extent_error"] == near(10**0.5)


def test_matching_by_members():
    # Who is with whom is right, but each hull is drawn round the other group: by hulls both are matched wrongly.
    true = {1: ((1, 2), (0, 0, 2, 1)), 2: ((3, 4), (3, 0, 5, 1))}
    told = {1: ((1, 2), (3, 0, 5, 1)), 2: ((3, 4), (0, 0, 2, 1))}
    by_hull, by_members = (
        scores([Scene(APART, true)], [Scene(APART, told)], group_match=by) for by in ("hull", "members")
    )
    assert (by_hull["group_TP"], by_hull["group_GDSR"]) == (2, 0)
    assert (by_members["group_TP"], by_members["group_GDSR"]) == (2, 1)
    assert by_members["group_MOTP"] == near(3)
    assert by_hull["group_F1_hull"] == by_members["group_F1_hull"] == near(1)
    assert by_hull["group_F1"] == by_members["group_F1"] == near(1)  # by members, whatever is asked


@pytest.mark.parametrize(("wrong", "found"), [(1, 1), (2, 0), (3, 0)])
def test_members_with_a_jaccard_index_above_one_half_are_found(wrong, found):
    # 2 true ones with 1, 2, 3 others: 2/3, 2/4 (exactly one half), 2/5.
    people = {k: (0.5 * k, 0.0) for k in range(1, 6)}
    true, told = ([Scene(people, {1: (range(1, n + 1), None)})] for n in (2, 2 + wrong))
    assert scores(true, told, group_match="members")["group_F1"] == found
    assert scores(true, told, group_match="members")["group_TP"] == 1


def test_one_group_of_everybody_finds_neither_of_two_pairs():
    two, one = {1: ((1, 2), None), 2: ((3, 4), None)}, {9: ((1, 2, 3, 4), None)}
    assert scores([Scene(APART, two)], [Scene(APART, one)])["group_F1"] == 0
    assert scores([Scene(APART, one)], [Scene(APART, two)])["group_F1"] == 0


def test_of_two_hulls_round_one_group_the_second_is_false():
    # Both hold 1 and 2: one of two estimated groups is found. F1 2/3, precision 1/2, recall 1.
    true = truth([Scene(APART, {1: ((1, 2), None)})])
    twice = {7: ((), (0, 0, 2, 1)), 8: ((), (0.1, 0, 2, 1))}
    found = evaluate(true, tracks([Scene({}, twice)], unit="group"))
    assert [found[f"group_{key}"] for key in ("F1", "precision", "recall")] == near([2 / 3, 1 / 2, 1])


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


def test_of_equal_matchings_by_members_the_nearer():
    # {1, 2, 3, 4} is told in halves: Jaccard 2/4 each. The half whose middle is nearer is the match, in either order.
    people = {k: (float(k), 0.0) for k in range(1, 5)}
    true = [Scene(people, {1: ((1, 2, 3, 4), (0, -1, 4, 1))})]
    near_one, far_one = ((1, 2), (0, -1, 2, 1)), ((3, 4), (2, -1, 6, 1))
    for halves in ({7: near_one, 8: far_one}, {7: far_one, 8: near_one}):
        assert scores(true, [Scene(people, halves)], group_match="members")["group_MOTP"] == near(1)


def test_a_method_without_members_has_the_people_in_its_hulls():
    # Hull [0, 2] x [0, 1]. Who stands 0.29 m beside it is in it, 0.31 m is not.
    def found(x):
        people = {1: (0.5, 0.5), 2: (1.5, 0.5), 3: (2 + x, 0.5)}
        true = truth([Scene(people, {1: ((1, 2), None)})])
        return evaluate(true, tracks([Scene({}, {1: ((), (0, 0, 2, 1))})], unit="group"))

    assert found(0.29)["group_size_error"] == 1
    assert found(0.31)["group_size_error"] == 0
    assert found(0.29)["pairwise_precision"] == near(1 / 3)
    assert np.isnan(found(0.31)["HOTA"])
    assert found(0.31)["objective"] == found(0.31)["group_F1"]


def test_one_person_in_a_hull_is_no_false_group_but_nobody_is():
    # Hulls round nobody, round person 3 alone, and round the group: false is the first only.
    people = {1: (0.5, 0.5), 2: (1.5, 0.5), 3: (5.0, 0.5)}
    told = {1: ((), (0, 0, 2, 1)), 2: ((), (4.5, 0, 5.5, 1)), 3: ((), (9, 0, 10, 1))}
    found = evaluate(truth([Scene(people, {1: ((1, 2), None)})]), tracks([Scene({}, told)], unit="group"))
    assert (found["group_TP"], found["group_FP"], found["group_FN"]) == (1, 1, 0)


def test_groups_of_one_are_none_on_either_side():
    one = [Scene(APART, {1: ((1, 2), None), 2: ((3,), None)})]
    found = scores(one, one)
    assert (found["group_TP"], found["group_FP"], found["group_FN"]) == (1, 0, 0)


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


def test_pairs_with_a_track_that_is_nobody_are_false():
    # Truth {1, 2, 3}: 3 pairs. Told {1, 2, 9} with 9 far away, and nobody stands for 3: 1 right, 2 false, 2 missed.
    # Pairs of the unknown left out would give a precision of 1.
    people = {1: (0.0, 0.0), 2: (1.0, 0.0), 3: (2.0, 0.0)}
    told = [Scene({1: (0.0, 0.0), 2: (1.0, 0.0), 9: (30.0, 0.0)}, {1: ((1, 2, 9), None)})]
    found = scores([Scene(people, {1: ((1, 2, 3), None)})], told)
    assert found["pairwise_precision"] == found["pairwise_recall"] == found["pairwise_F1"] == near(1 / 3)


def test_pairs_are_pooled_over_frames():
    # Frame 1: 6 pairs of four people, all right. Frame 2: 1 pair, missed. 2 x 6 / (7 + 6), not the mean of 1 and 0.
    four = Scene(APART, {1: ((1, 2, 3, 4), None)})
    found = scores([four, Scene(APART, {1: ((1, 2), None)})], [four, Scene(APART)])
    assert found["pairwise_F1"] == near(12 / 13)
    assert found["pairwise_recall"] == near(6 / 7)
    assert found["pairwise_precision"] == near(1)


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


def test_frames_without_labels_do_not_count():
    # The group is told wrongly in frame 2, of which nothing is known.
    right, wrong = Scene(APART, {1: ((1, 2), None)}), Scene(APART, {1: ((1, 2), None), 2: ((3, 4), None)})
    true = truth([right] * 3, labelled=np.array([True, False, True]))
    found = evaluate(true, tracks([right, wrong, right]))
    assert (found["group_TP"], found["group_FP"], found["pairwise_F1"]) == (2, 0, 1)
    # Nor are they frames without errors: one false group in the one frame that is known.
    known = truth([right] * 3, labelled=np.array([False, True, False]))
    found = evaluate(known, tracks([right, wrong, right]))
    assert found["group_1-FP_frames"] == found["group_1-FP_frames_core"] == 0


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


def test_without_hulls_in_the_image_members_can_still_be_compared():
    px = {p: (40 * x, 40 * y) for p, (x, y) in APART.items()}
    box = np.array([(x - 10, y - 10, 20, 20) for x, y in px.values()], float)
    true = truth([Scene(APART, {1: ((1, 2), None)})], box=box)
    told = tracks([Scene(px, {1: ((1, 2), None)})], plane="image")
    by_hull, by_members = (evaluate(true, told, group_match=by) for by in ("hull", "members"))
    assert np.isnan([by_hull["group_GDSR"], by_hull["group_F1_hull"]]).all()
    assert by_hull["group_F1"] == by_hull["pairwise_F1"] == near(1)
    assert by_members["group_F1"] == by_members["group_GDSR2"] == near(1)
    assert np.isnan([by_members["group_MOTP"], by_members["group_F1_hull"]]).all()
