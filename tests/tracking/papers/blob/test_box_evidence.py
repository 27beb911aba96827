"""`blob` from pictures and boxes: what either misses, posters, shared boxes, large boxes, lost pictures, half rate."""

from __future__ import annotations

import copy

import numpy as np
import pytest

from sim.types import Detections, Frame
from tests import painted
from tests.painted import FPS, TALL, box, ids, overlap
from tracking.filters import existence
from tracking.papers.blob import box_evidence_kernels as kernels
from tracking.papers.blob.config import BlobConfig

POSTER = np.array([270.0, 20.0, 20.0, TALL])


def detections(k, boxes):
    found = np.reshape(np.array(boxes, float), (-1, 4))
    return Detections(k + 1, k / FPS, "image", found[:, :2] + found[:, 2:] / 2, None, found, np.ones(len(found)))


def track(people, boxes, *, lost=lambda k: False, config=None, watch=None):
    """Tracks on pictures of people (a list for each frame) and on boxes (a list for each frame, or None)."""
    tracker, r = copy.deepcopy(painted.learned(config, tuple(painted.spread()), 0, (painted.WIDE, painted.HIGH)))
    made = []
    for k, (here, found) in enumerate(zip(people, boxes, strict=True)):
        image = None if lost(k) else painted.picture(here, r)
        given = None if found is None else detections(k, found)
        made.append(tracker.step(Frame(k + 1, k / FPS, image=image, detections=given), given))
        if watch is not None:
            watch(tracker, k)
    return made


def walk(x, foot, step, frames):
    return [(x + step * k, foot, TALL) for k in range(frames)]


def of(people):
    return [[box(p) for p in here] for here in people]


def right(tracks, person):
    return max((overlap(b, box(person)) for b in tracks.box), default=0.0)


def test_pictures_carry_a_person_whom_the_detector_misses():
    people = [[p] for p in walk(60, 180, 4, 40)]
    made = track(people, [found if k < 10 else [] for k, found in enumerate(of(people))])
    assert len(ids(made)) == 1
    assert all(right(t, here[0]) > 0.6 for t, here in zip(made[3:], people[3:], strict=True))


def test_boxes_carry_a_person_while_pictures_are_lost():
    people = [[p] for p in walk(60, 180, 4, 40)]
    made = track(people, of(people), lost=lambda k: 10 <= k < 35)
    assert len(ids(made)) == 1
    assert all(right(t, here[0]) > 0.6 for t, here in zip(made[3:], people[3:], strict=True))


@pytest.mark.parametrize("lost", [False, True])
def test_a_box_that_comes_without_foreground_is_no_person(lost):
    people = [[p] for p in walk(60, 180, 2, 40)]
    boxes = [[*found, POSTER] if k >= 5 else found for k, found in enumerate(of(people))]
    made = track(people, boxes, lost=lambda k: lost)
    shown = [any(overlap(b, POSTER) > 0.5 for b in t.box) for t in made]
    assert sum(shown) > 25 if lost else not any(shown)


def test_a_person_who_stands_in_the_background_is_tracked_by_boxes():
    stands, walks = [POSTER] * 15, [box(p) for p in walk(POSTER[0] + POSTER[2] / 2, POSTER[1] + TALL, -3, 25)]
    people = [[] if k < 15 else [(POSTER[0] + POSTER[2] / 2 - 3 * (k - 15), POSTER[1] + TALL, TALL)] for k in range(40)]
    made = track(people, [[found] for found in stands + walks])
    assert len(ids(made)) == 1
    assert all(len(t.id) == 1 for t in made)


def test_nobody_stands_in_the_background_for_ever(monkeypatch):
    monkeypatch.setattr(existence, "LIFETIME", 1.5)
    made = track([[]] * 60, [[POSTER]] * 60)
    shown = [len(t.id) > 0 for t in made]
    assert shown[0]
    assert not any(shown[50:])


def test_one_box_of_two_people_loses_nobody():
    alone = 15
    left, other = walk(80, 180, 3, 45), walk(107, 182, 3, 45)
    people = [list(pair) for pair in zip(left, other, strict=True)]
    boxes = of(people)
    for k in range(alone, 45):
        low, high = boxes[k][0][:2], boxes[k][1][:2] + boxes[k][1][2:]
        low, high = np.minimum(low, boxes[k][1][:2]), np.maximum(high, boxes[k][0][:2] + boxes[k][0][2:])
        boxes[k] = [np.concatenate([low, high - low])]
    made = track(people, boxes)
    assert len(ids(made)) == 2
    assert all(len(t.id) == 2 for t in made[3:])
    assert all(min(right(t, p) for p in here) > 0.6 for t, here in zip(made[3:], people[3:], strict=True))


def test_offset_and_size_of_boxes_are_learned():
    people = [[p] for p in walk(60, 180, 3, 60)]
    large = [[(x - 0.2 * w + 4, y, 1.4 * w, h) for x, y, w, h in found] for found in of(people)]
    last = []
    made = track(people, large, watch=lambda tracker, _: last.append(tracker.updater.boxes))
    assert last[-1].over_person == pytest.approx([1.0, 1.4], rel=0.1)
    assert last[-1].offset * TALL / 1.7 == pytest.approx([4.0, 0.0], abs=2.5)
    assert len(ids(made)) == 1


def test_a_detector_at_half_the_rate_of_the_camera_loses_nobody():
    people = [[p, (250.0, 150.0, TALL), (200.0, 120.0, TALL)] for p in walk(60, 180, 2, 60)]
    boxes = [found if k % 2 == 0 else [] for k, found in enumerate(of(people))]
    known = []
    made = track(people, boxes, lost=lambda k: k >= 20, watch=lambda t, _: known.append(t.people.existence().min()))
    assert len(ids(made)) == 3
    assert min(known[25:]) > 0.8


def test_boxes_may_be_missing_and_wrong():
    people = [[p] for p in walk(60, 180, 4, 20)]
    wrong = [[5.0, 5.0, 0.0, 10.0], [400.0, 300.0, 30.0, 60.0]]
    boxes = [None if k % 3 == 0 else [*found, *wrong] for k, found in enumerate(of(people))]
    made = track(people, boxes)
    assert all(right(t, here[0]) > 0.6 for t, here in zip(made[3:], people[3:], strict=True))
    paper = track(people, of(people), config=BlobConfig.load("paper"))
    assert len(ids(paper)) == 1


def test_without_boxes_pictures_alone_decide():
    people = [[p, (200.0, 150.0, TALL)] for p in walk(60, 180, 4, 20)]
    alone, none = painted.track(people), track(people, [None] * 20)
    assert all(a.box.tobytes() == b.box.tobytes() for a, b in zip(alone, none, strict=True))


def test_boxes_beside_each_other():
    r = np.random.default_rng(0)
    boxes, sure = np.column_stack([r.uniform(0, 200, (12, 2)), r.uniform(20, 90, (12, 2))]), r.random(12)
    low, high = boxes[:, :2] - boxes[:, :1:-1] / 2, boxes[:, :2] + boxes[:, :1:-1] / 2
    touch = ((low[:, None] < high) & (low < high[:, None])).all(2) & (np.minimum(sure[:, None], sure) >= 0.5)
    pairs = kernels.pairs_beside(boxes, sure, 0.5)
    assert pairs.tolist() == np.argwhere(np.triu(touch, 1)).tolist()
    joint = kernels.joint_boxes(boxes, pairs)
    assert joint[:, :2] - joint[:, :1:-1] / 2 == pytest.approx(low[pairs].min(1))
    assert joint[:, :2] + joint[:, :1:-1] / 2 == pytest.approx(high[pairs].max(1))
