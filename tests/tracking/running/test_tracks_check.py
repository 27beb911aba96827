"""What a tracker may say of groups and events, and what it must keep to from frame to frame."""

from __future__ import annotations

import numpy as np
import pytest

from scenarios.errors import WorkError
from sim.types import Frame, GroupEvent, Groups, Tracks
from tracking.running.tracks_check import ReportHistory, check_tracks

SQUARE = np.array([[0.0, 0], [1, 0], [1, 1]])
FRAME = Frame(3, 0.2)


def group(**changes):
    made = Groups(
        np.array([5]), (np.array([1, 2]),), np.zeros((1, 2)), np.zeros((1, 2)), np.full((1, 2, 2), np.nan),
        np.array([np.nan]), (SQUARE,),
    )  # fmt: skip
    return made.replace(**changes)


def event(**changes):
    given = {"kind": "merge", "start": 2, "end": 3, "emitted": 3, "before": (-1, -1), "after": (5,)}
    return GroupEvent(**{**given, "members": (1, 2), "pos": (0.0, 0.0), **changes})


def answer(index=3, ids=(1, 2), **changes):
    n, id = len(ids), np.array(ids, np.int64)
    two, alone = np.zeros((n, 2)), np.full(n, -1)
    made = Tracks(index, 0.2, "ground", "person", id, alone, two, two, np.zeros((n, 4, 4)), None, np.ones(n))
    return made.replace(**changes)


def check(made, history=None):
    return check_tracks(made, made.index, "mine.py:Mine", "s", history)


def refused(made, words, history=None):
    with pytest.raises(WorkError, match=words) as caught:
        check(made, history)
    assert str(caught.value).startswith(f"mine.py:Mine: s, frame {made.index}")


WRONG_GROUPS = [
    ({"id": np.array([5.0])}, "float64"), ({"id": np.array([[5]])}, "groups.id"),
    ({"id": np.array([-2])}, "group id -2"), ({"pos": np.zeros((1, 3))}, r"groups.pos of shape \(1, 3\)"),
    ({"pos": np.full((1, 2), np.nan)}, "NaN or infinity in groups.pos"),
    ({"vel": np.zeros((2, 2))}, "groups.vel of shape"), ({"extent": np.zeros((1, 2))}, "groups.extent of shape"),
    ({"size": np.zeros(3)}, "groups.size of shape"), ({"hull": (SQUARE, SQUARE)}, "2 groups.hull"),
    ({"hull": (np.zeros(4),)}, "groups.hull of shape"),
    ({"hull": (np.full((3, 2), np.nan),)}, "NaN in it"),
    ({"members": (np.array([1]), np.array([2]))}, "2 groups.members"),
    ({"members": (np.array([1, 7]),)}, "7 in groups.members"), ({"members": (np.array([1.0]),)}, "no ids"),
    ({"members": [[1]]}, "list groups.members"),
]  # fmt: skip


WRONG_EVENTS = [
    ({"kind": "meet"}, "kind 'meet'; expected one of merge"), ({"emitted": 2}, "emitted 2; expected 3"),
    ({"emitted": 4}, "emitted 4; expected 3"), ({"start": 4, "end": 5}, "start 4; expected a whole number from 1 to 3"),
    ({"start": 0}, "start 0"), ({"start": 2.0}, "start 2.0; expected a whole number"), ({"end": 1}, "end 1"),
    ({"members": (1, 7)}, "7 in the members of a merge"), ({"members": [1, 2]}, "members"),
    ({"before": (-2,)}, "before"), ({"after": 5}, "after 5"), ({"pos": (0.0,)}, "pos"), ({"pos": None}, "pos"),
]  # fmt: skip


WRONG_ANSWERS = [
    ({"id": np.array([4, 4])}, "the same id twice"), ({"id": np.array([-1, 4])}, "id -1"),
    ({"id": np.array([1.0, 2.0])}, "float64"), ({"pos": np.zeros((2, 3))}, r"pos of shape \(2, 3\)"),
    ({"vel": np.zeros((1, 2))}, "vel of shape"), ({"cov": np.full((2, 4, 4), np.nan)}, "NaN or infinity in cov"),
    ({"box": np.zeros((2, 3))}, "box of shape"), ({"index": 4}, "index 4"), ({"plane": "floor"}, "floor"),
    *(({"groups": group(**changes)}, words) for changes, words in WRONG_GROUPS),
    *(({"events": (event(**changes),)}, words) for changes, words in WRONG_EVENTS),
]  # fmt: skip


@pytest.mark.parametrize(("changes", "words"), WRONG_ANSWERS)
def test_wrong_answers_name_tracker_frame_and_fault(changes, words):
    with pytest.raises(WorkError, match=words) as caught:
        check_tracks(answer(**changes), 3, "mine.py:Mine", "s")
    assert str(caught.value).startswith("mine.py:Mine: s, frame 3")


def test_when_an_event_was_told_is_filled_in():
    (made,) = check(answer(events=(event(emitted=None, end=None),))).events
    assert (made.emitted, made.start, made.end) == (3, 2, 3)
    given = answer(events=(event(),), groups=group())
    assert check(given).events == given.events
    assert check(answer(groups=Groups.none())).groups is not None


def test_who_was_reported_before_may_be_a_member():
    history = ReportHistory()
    check(answer(2, (1, 2)), history)
    check(answer(3, (1,), events=(event(kind="leave"),), groups=group()), history)
    refused(answer(3, (1,), events=(event(kind="leave"),)), "2 in the members of a leave")
    history.clear()
    refused(answer(3, (1,), events=(event(kind="leave"),)), "2 in the members of a leave", history)


def test_plane_and_unit_stay():
    history = ReportHistory()
    check(answer(2), history)
    refused(answer(3, plane="image"), "plane 'image', unit 'person'; expected plane 'ground', unit 'person'", history)
    refused(answer(3, unit="group", group=np.array([1, 2])), "unit 'group'; expected", history)


def test_declared_kinds_of_events_stay_and_no_others_are_reported():
    history = ReportHistory()
    check(answer(3, own_events=("merge", "split"), events=(event(),)), history)
    refused(answer(4), r"own_events \(\); expected .* always the same", history)
    declared = answer(3, own_events=("merge",), events=(event(kind="split", before=(5,), after=(-1, -1)),))
    refused(declared, "an event of kind 'split'; expected one of own_events, .'merge',")
    refused(answer(3, own_events=("meeting",)), "own_events .'meeting',.; expected a tuple of kinds of events .merge")
    refused(answer(3, own_events="merge"), "own_events 'merge'")


def test_trackers_of_groups():
    own = np.array([1, 2])
    check(answer(unit="group", group=own, groups=group(members=()), events=(event(members=()),)))
    refused(answer(unit="group", group=own[::-1].copy()), "group that is not id")
    refused(answer(unit="group", group=own, groups=group()), "1 in groups.members")
    refused(answer(unit="group", group=own, groups=group(members=()), events=(event(),)), "1 in the members")
    refused(answer(unit="group", group=own), "unit 'group' without hulls; expected groups")


def test_right_answers_pass():
    assert check_tracks(answer(), 3, "x", "s").id.tolist() == [1, 2]
    assert len(check_tracks(answer(ids=()), 3, "x", "s").id) == 0
    assert check_tracks(answer(score=np.zeros(0)), 3, "x", "s").score.tolist() == [1.0, 1.0]
    with pytest.raises(WorkError, match="NoneType"):
        check_tracks(None, 3, "x", "s")


def test_a_tracker_may_use_its_arrays_again():
    """What it overwrites later does not change what it reported: rows, groups, members and hulls."""
    ids, pos, hull, member = np.array([1, 2]), np.zeros((2, 2)), SQUARE.copy(), np.array([1, 2])
    made = check(answer(id=ids, pos=pos, groups=group(hull=(hull,), members=(member,))))
    for buffer in (ids, pos, hull, member):
        buffer[...] = 7
    assert made.id.tolist() == [1, 2]
    assert not made.pos.any()
    assert np.array_equal(made.groups.hull[0], SQUARE)
    assert made.groups.members[0].tolist() == [1, 2]
    for array in (made.id, made.pos, made.cov, made.groups.pos, made.groups.hull[0]):
        assert type(array) is np.ndarray
        assert array.base is None
        assert not array.flags.writeable


@pytest.mark.parametrize(
    ("made", "words"),
    [
        (Tracks.of_points(FRAME, [1, 2], np.zeros((2, 3))), r"pos of shape \(2, 3\), float64; expected \(2, 2\)"),
        (Tracks.of_points(FRAME, [1, 2], np.zeros((3, 2))), r"pos of shape \(3, 2\), float64; expected \(2, 2\)"),
        (Tracks.of_points(FRAME, [1, 2], np.zeros(4)), r"pos of shape \(4,\), float64; expected \(2, 2\)"),
        (Tracks.of_boxes(FRAME, [1, 2], np.zeros((2, 5))), r"box of shape \(2, 5\), float64; expected \(2, 4\)"),
        (Tracks.of_boxes(FRAME, [1, 2], np.zeros((3, 4))), r"box of shape \(3, 4\), float64; expected \(2, 4\)"),
    ],
)  # fmt: skip
def test_the_array_of_the_wrong_shape_is_named(made, words):
    refused(made, words)


@pytest.mark.parametrize("nobody", [[], np.zeros((0, 2)), np.zeros((0, 4))])
def test_nobody_needs_no_shape(nobody):
    assert check(Tracks.of_points(FRAME, [], nobody)).pos.shape == (0, 2)
    assert check(Tracks.of_boxes(FRAME, [], nobody)).box.shape == (0, 4)


def test_without_seen_all_are_measured():
    assert check(answer()).seen.tolist() == [True, True]
    assert check(answer(seen=np.array([True, False]))).seen.tolist() == [True, False]
    for wrong in (np.array([True]), np.array([1.0, 0.0])):
        refused(answer(seen=wrong), r"seen of shape .*expected \(2,\), bool")
