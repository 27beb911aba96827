"""What group_labels.py passes to the measuring functions and how it uses the result; groups_and_events is a stub."""

import types

import numpy as np
import pytest

from sim.io.formats.labels import labelled_truth_fields, rows_to_grid
from sim.types import GroupEvent, Near

FRAME = np.array([1, 1, 1, 3, 3], np.int64)
ID = np.array([4, 7, 9, 4, 7], np.int64)
LABEL = np.array([-1, 0, 0, -1, 0], np.int64)
POS = np.arange(10.0).reshape(5, 2) * 20


@pytest.fixture
def measured(monkeypatch):
    """groups_and_events as a stand-in that notes what it is given and answers with a merge of columns 2 and 3."""
    seen = types.SimpleNamespace()

    def groups_and_events(pos, vel, present, intent, fps):
        seen.given = (pos, vel, present, intent, fps)
        group = np.full(present.shape, -1)
        group[0, 1:] = group[2, 1] = 5
        event = GroupEvent("merge", 1, 3, None, (-1, -1), (5,), (2, 3), (1.0, 2.0))
        one = np.array([1], np.int64)
        return types.SimpleNamespace(group=group, events=(event,), near=Near(one, one, one, one + 2))

    monkeypatch.setattr("sim.truth.merge_split_events.groups_and_events", groups_and_events)
    return seen


def test_rows_become_metres_over_time_and_people(measured):
    labelled_truth_fields(FRAME, ID, LABEL, POS, POS, fps=25.0, length=3, px_per_m=20.0)
    pos, vel, present, intent, fps = measured.given
    assert (pos.shape, vel.shape, fps) == ((3, 3, 2), (3, 3, 2), 25.0)
    assert pos[0, 1].tolist() == [2, 3]
    assert np.isnan(pos[1]).all()
    assert present.tolist() == [[True] * 3, [False] * 3, [True, True, False]]
    assert intent[0, 1] == intent[0, 2] == intent[2, 1] == 0
    assert intent[0, 0] not in (0, -1)
    assert (intent == -1).sum() == 4


def test_answers_come_back_in_the_recordings_ids_and_unit(measured):
    found = labelled_truth_fields(FRAME, ID, LABEL, POS, POS, fps=25.0, length=3, px_per_m=20.0)
    (event,) = found["events"]
    assert (event.before, event.after, event.members, event.pos) == ((-1, -1), (0,), (7, 9), (20.0, 40.0))
    assert (found["near"].a.tolist(), found["near"].b.tolist()) == ([4], [9])
    first, nobody, last = found["groups"]
    assert first.id.tolist() == [0]
    assert first.members[0].tolist() == [7, 9]
    assert first.pos.tolist() == [POS[1:3].mean(axis=0).tolist()]
    assert first.extent[0] == pytest.approx(np.full((2, 2), 20.0**2)), "px²: they are 40 px apart, right and down"
    assert first.hull[0].min(axis=0) == pytest.approx(POS[1] - 0.25 * 20), "footprints of 0.25 m, in px"
    assert len(nobody.id) == len(last.id) == 0, "one of a group alone is none"
    assert found["labelled"].all()


def test_dense_keeps_order_of_ids():
    values = rows_to_grid(FRAME, ID, np.arange(5.0), 3)
    assert np.array_equal(values, [[0, 1, 2], [np.nan] * 3, [3, 4, np.nan]], equal_nan=True)


def test_labelled_groups_cross_and_queue_in_their_own_ids_and_unit():
    """Two pairs walk through each other at 1 m/s from 10 m apart; three others stand in line all the time."""
    t = np.arange(120) / 10
    start = np.array([[0, 5.0], [0, 5.7], [10, 5.2], [10, 5.9], [30, 5], [30.8, 5], [31.6, 5]])
    pos = start + t[:, None, None] * np.array([[1.0, 0]] * 2 + [[-1.0, 0]] * 2 + [[0.0, 0]] * 3)
    vel = np.broadcast_to([[1.0, 0]] * 2 + [[-1.0, 0]] * 2 + [[0.0, 0]] * 3, pos.shape)
    frame, id = np.repeat(np.arange(1, 121), 7), np.tile([10, 20, 30, 40, 50, 60, 70], 120)
    label = np.tile([8, 8, 3, 3, -1, -1, -1], 120)
    rows = (20 * x.reshape(-1, 2) for x in (pos, vel))
    queue, cross = labelled_truth_fields(frame, id, label, *rows, fps=10.0, length=120, px_per_m=20.0)["events"]
    assert (queue.kind, queue.start, queue.end, queue.members) == ("queue", 1, 120, (50, 60, 70))
    assert queue.before == queue.after == (-1, -1, -1)
    assert (cross.kind, cross.start, cross.end, cross.members) == ("cross", 44, 58, (10, 20, 30, 40))
    assert cross.before == cross.after == (3, 8)
    assert cross.pos == pytest.approx((100, 20 * 5.45))
