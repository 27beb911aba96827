"""Scores of events and of lineage on cases worked out by hand, and beside an oracle that tries all pairings."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.hand_made import Scene, event, tracks, truth
from tests.reference_social import event_hits
from tracking.scoring import evaluate
from tracking.scoring.event_members import ComparableEvent, EventMembers
from tracking.scoring.events import match_events, weighted_events
from tracking.scoring.frame_weights import unweighted

FRAMES = 60
CROWD = {p: (4.0 * p, 0.0) for p in range(1, 9)}  # far apart: everybody is who they are


def near(value: float):
    return pytest.approx(value, abs=1e-12)


def scores(happened, said, people=CROWD):
    return evaluate(truth([Scene(CROWD)] * FRAMES, happened), tracks([Scene(people)] * FRAMES, said))


def hits(kind, found):
    return tuple(found[f"{kind}_{k}"] for k in ("TP", "FP", "FN"))


@pytest.mark.parametrize(("start", "hit"), [(20, 1), (40, 1), (19, 0), (41, 0)])
def test_one_second_to_either_side(start, hit):
    # 10 fps: 10 frames are 1.0 s, which still counts.
    found = scores([event("merge", 30, (1, 2))], [event("merge", start, (1, 2), emitted=45)])
    assert hits("merge", found) == (hit, 1 - hit, 1 - hit)


MEMBERS = [
    ((1, 2, 3), 1),
    ((1, 2), 1),  # 2/3
    ((1, 2, 3, 4, 5, 6), 1),  # 3/6, exactly one half
    ((1, 2, 3, 4, 5, 6, 7), 0),  # 3/7
    ((1,), 0),  # 1/3
    ((1, 2, 30), 1),  # 2 of {1, 2, 3, nobody}
    ((1, 2, 30, 31), 0),  # 2/5: with those who are nobody left out it would be 2/3
]


@pytest.mark.parametrize(("members", "hit"), MEMBERS)
def test_half_of_all_people_concerned(members, hit):
    ghosts = {30: (4.0, 99.0), 31: (8.0, 99.0)}
    found = scores([event("split", 30, (1, 2, 3))], [event("split", 30, members, emitted=31)], CROWD | ghosts)
    assert hits("split", found) == (hit, 1 - hit, 1 - hit)


def test_kinds_are_kept_apart_but_forming_is_merging():
    happened = [event(kind, 30, (1, 2)) for kind in ("merge", "dissolve", "cross", "queue", "enter", "leave")]
    said = [event(kind, 30, (1, 2), emitted=30) for kind in ("form", "split", "cross", "queue", "enter", "leave")]
    found = scores(happened, said)
    for kind in ("merge", "split", "cross", "queue", "enter", "leave"):
        assert hits(kind, found) == (1, 0, 0), kind
    assert hits("cross", scores(happened, [event("queue", 30, (1, 2), emitted=30)])) == (0, 0, 1)


def test_latency_is_from_the_true_start_to_the_telling():
    # Merge: true start 10, told in frame 25 as having begun in 12: 1.5 s, though its own start is 1.3 s before that.
    # Split: 40, told in 45: 0.5 s. A false one has none.
    happened = [event("merge", 10, (1, 2)), event("split", 40, (1, 2))]
    said = [
        event("merge", 12, (1, 2), emitted=25),
        event("split", 41, (1, 2), emitted=45),
        event("split", 55, (3, 4), emitted=60),
    ]
    found = scores(happened, said)
    assert (found["merge_latency"], found["split_latency"], found["event_latency"]) == (near(1.5), near(0.5), near(1.0))
    assert np.isnan(found["cross_latency"])


@pytest.mark.parametrize(("gone", "hit"), [(9, 1), (10, 1), (11, 0)])
def test_who_is_not_seen_at_the_start_is_who_they_are_within_a_second(gone, hit):
    # Person 2 is first tracked `gone` frames after the start, person 3 likewise: {1} of {1, 2, 3} is not enough.
    few = {1: CROWD[1]}
    people = [Scene(CROWD if k >= 30 + gone else few) for k in range(1, FRAMES + 1)]
    told = tracks(people, [event("merge", 30, (1, 2, 3), emitted=50)])
    found = evaluate(truth([Scene(CROWD)] * FRAMES, [event("merge", 30, (1, 2, 3))]), told)
    assert hits("merge", found) == (hit, 1 - hit, 1 - hit)


@pytest.mark.parametrize(("x", "hit"), [(1.5, 1), (1.51, 0)])
def test_without_members_the_place_decides(x, hit):
    happened, said = [event("merge", 30, (1, 2))], [event("merge", 30, (), emitted=31, pos=(x, 0.0))]
    told = tracks([Scene({}, {})] * FRAMES, said, unit="group")
    assert hits("merge", evaluate(truth([Scene(CROWD)] * FRAMES, happened), told)) == (hit, 1 - hit, 1 - hit)


def test_events_that_begin_without_labels_do_not_count():
    labelled = np.arange(1, FRAMES + 1) < 30
    happened = [event("merge", 10, (1, 2)), event("merge", 40, (1, 2))]
    said = [event("merge", 10, (1, 2), emitted=35), event("merge", 40, (3, 4), emitted=41)]
    found = evaluate(truth([Scene(CROWD)] * FRAMES, happened, labelled=labelled), tracks([Scene(CROWD)] * FRAMES, said))
    assert hits("merge", found) == (1, 0, 0)  # told in a frame without labels, but of one with them


def changing(before, after, at):
    """Scenes whose groups are `before` until frame `at`."""
    names = {members: k for k, members in enumerate(sorted({*before, *after}), 1)}
    return [Scene(CROWD, {names[m]: (m, None) for m in (before if k < at else after)}) for k in range(1, FRAMES + 1)]


AB, CD, EF, ABCD = (1, 2), (3, 4), (5, 6), (1, 2, 3, 4)


MERGE_LINEAGES = [
    ([AB, CD], [ABCD], 1),
    ([AB], [ABCD], 0),  # 3 and 4 are said to have come alone: three parents
    ([(1, 2, 3), (4,)], [ABCD], 0),  # two parents, but 4 alone is not {3, 4}: 1/2 is not more than half
    ([AB, CD], [(1, 2, 3)], 0),  # 4 stayed outside: two children
    ([ABCD], [ABCD], 0),  # the tracker's groups did not change at all
]


@pytest.mark.parametrize(("before", "after", "right"), MERGE_LINEAGES)
def test_lineage_of_a_merge(before, after, right):
    true = truth(changing([AB, CD, EF], [ABCD, EF], 30), [event("merge", 30, ABCD)])
    told = tracks(changing(before, after, 35), [event("merge", 31, ABCD, emitted=35)])
    found = evaluate(true, told)
    assert found["merge_TP"] == 1
    assert found["lineage_accuracy"] == right


def test_lineage_does_not_mind_ids_nor_a_late_word():
    # The tracker changes its groups in frame 32 and tells so in 40; its ids have nothing to do with the truth's.
    true = truth(changing([AB, CD], [ABCD], 30), [event("merge", 30, ABCD)])
    said = changing([AB, CD], [ABCD], 32)
    for s in said:
        s.given = {g + 70: members for g, members in s.given.items()}
    assert evaluate(true, tracks(said, [event("merge", 31, ABCD, emitted=40)]))["lineage_accuracy"] == 1


@pytest.mark.parametrize("seed", range(6))
def test_as_many_hits_as_there_can_be(seed):
    r = np.random.default_rng(seed)

    def one(most_wrong):
        people = frozenset(r.choice(5, int(r.integers(2, 5)), replace=False).tolist())
        return int(r.integers(1, 40)), people, int(r.integers(0, most_wrong + 1))

    happened, said = [one(0) for _ in range(4)], [one(1) for _ in range(4)]
    true, told = (
        [ComparableEvent("merge", s, s, EventMembers(people, wrong), (0.0, 0.0)) for s, people, wrong in side]
        for side in (happened, said)
    )
    found = unweighted(weighted_events(match_events(true, told, 10.0, 1.0), 10.0, 60), 60)
    assert found["merge_TP"] == event_hits(happened, said, 10.0)


def test_two_hits_by_half_are_more_than_a_whole_one():
    """The merge of (1, 2) is told exactly; the best pairing gives it to another event, by half, and that one too."""
    happened = [event("merge", 30, (1, 2)), event("merge", 40, (1, 2, 3, 4))]
    said = [event("merge", 30, (1, 2), emitted=45), event("merge", 40, (1,), emitted=45)]
    assert hits("merge", scores(happened, said)) == (2, 0, 0)


def test_latency_is_to_the_answer_that_told_whatever_it_claims():
    told = tracks([Scene(CROWD)] * FRAMES, [event("merge", 30, (1, 2), emitted=45)])
    claimed = [t.replace(events=tuple(replace(e, emitted=30) for e in t.events)) for t in told]
    true = truth([Scene(CROWD)] * FRAMES, [event("merge", 30, (1, 2))])
    for said in (told, claimed):
        assert evaluate(true, said)["merge_latency"] == near(1.5)


def test_crossings_and_queues_of_a_method_without_people_are_unknown_unless_it_tells_some():
    kinds = ("cross", "queue", "merge")
    true = truth([Scene(CROWD)] * FRAMES, [event(kind, 30, (1, 2, 3)) for kind in kinds])
    silent = evaluate(true, tracks([Scene({}, {})] * FRAMES, unit="group"))
    assert [np.isnan(silent[f"{kind}_{k}"]) for kind in kinds for k in ("F1", "FN")] == [True] * 4 + [False] * 2
    said = [event("cross", 30, (), emitted=31)]
    told = evaluate(true, tracks([Scene({}, {})] * FRAMES, said, unit="group"))
    assert hits("cross", told) == (1, 0, 0)
    assert np.isnan(told["queue_FN"])
