"""A truth given as tracks with one fault: the fault is listed, named and explained, and nothing else is."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest

from scenarios.errors import InputError
from sim.types import Groups, Sequence, Tracks
from tests.hand_made import Scene, event, tracks, truth
from tracking.app.commands.view import _errors
from tracking.errors.found import errors_of_run, find_errors
from tracking.errors.groups import GroupError
from tracking.running.run import TrackingRun

FRAMES = 60
SPEED = 0.12  # m per frame


def scene(k: int, swapped: bool = False) -> Scene:
    """People 1, 2 and 3, 4 walk in pairs, 5 and 6 alone; pairs and lone people keep 6 m and more from each other."""
    x = SPEED * k
    people = {1: (x, 0.0), 2: (x, 0.9), 3: (x, 8.0), 4: (x, 8.9), 5: (-x, 16.0), 6: (-x, 24.0)}
    return Scene(people, {1: ([1, 2], None), 2: ([3, 4], None)})


@dataclass
class Made:
    """A truth and tracks that equal it, frame by frame, to be spoiled."""

    scenes: list[Scene]

    def sequence(self, **changes) -> Sequence:
        made = truth(self.scenes, **changes)
        return Sequence("made", made.fps, made.length, lambda: iter(()), load_truth=lambda: made)


def changed(t: Tracks, keep=None, id=None, group=None, pos=None) -> Tracks:
    """The same frame with other columns; groups follow the column."""
    keep = np.ones(len(t.id), bool) if keep is None else keep
    ids = (t.id if id is None else id)[keep]
    label = (t.group if group is None else group)[keep]
    names = sorted({int(g) for g in label if g >= 0})
    members = tuple(ids[label == g] for g in names)
    count = len(names)
    groups = Groups(
        np.array(names, np.int64), members, np.zeros((count, 2)), np.zeros((count, 2)), np.zeros((count, 2, 2)),
        np.array([float(len(m)) for m in members]), (),
    )  # fmt: skip
    place = (t.pos if pos is None else pos)[keep]
    return t.replace(
        id=ids, group=label, pos=place, vel=np.zeros((len(ids), 2)), cov=np.zeros((len(ids), 4, 4)),
        score=np.ones(len(ids)), groups=groups,
    )  # fmt: skip


def lost(t, person, start, end):
    return changed(t, keep=t.id != person) if start <= t.index <= end else t


def renamed(t, person, new, start):
    return changed(t, id=np.where(t.id == person, new, t.id)) if t.index >= start else t


def regrouped(t, people, group, start, end):
    return changed(t, group=np.where(np.isin(t.id, people), group, t.group)) if start <= t.index <= end else t


def with_ghost(t, start, end):
    if not start <= t.index <= end:
        return t
    one = np.array([[20.0, 20.0]])
    return t.replace(
        id=np.append(t.id, 99), group=np.append(t.group, -1), pos=np.concatenate([t.pos, one]),
        vel=np.zeros((len(t.id) + 1, 2)), cov=np.zeros((len(t.id) + 1, 4, 4)), score=np.ones(len(t.id) + 1),
    )  # fmt: skip


def swapped(t, start):
    if t.index < start:
        return t
    other = {1: 3, 3: 1}
    return changed(t, id=np.array([other.get(int(i), int(i)) for i in t.id]))


def astray(t, person, start, end):
    """The track of a person is somewhere else for a while, so that its id is in use in the gap."""
    if not start <= t.index <= end:
        return t
    return changed(t, pos=np.where(t.id[:, None] == person, [30.0, 30.0], t.pos))


FAULTS = {
    "late": (lambda t, k: lost(t, 5, 1, k), [("late", 1, 0)]),
    "miss": (lambda t, k: lost(t, 5, k, FRAMES), [("miss", 0, FRAMES)]),
    "lost": (lambda t, k: lost(t, 5, 1, FRAMES), [("miss", 1, FRAMES)]),
    "fragment": (lambda t, k: lost(t, 5, k, k + 8), [("fragment", 0, 8)]),
    "track astray": (lambda t, k: astray(t, 5, k, k + 8), [("fragment", 0, 8), ("ghost", 0, 8)]),
    "switch": (lambda t, k: renamed(t, 5, 50, k), [("switch", 0, 0)]),
    "switch after a gap": (lambda t, k: lost(renamed(t, 5, 50, k), 5, k - 5, k - 1), [("switch", -5, 0)]),
    "swap": (swapped, [("switch", 0, 0), ("switch", 0, 0)]),
    "ghost": (lambda t, k: with_ghost(t, k, k + 5), [("ghost", 0, 5)]),
    "missed group": (lambda t, k: regrouped(t, [1, 2], -1, k, k + 9), [("missed group", 0, 9)]),
    "engulfed group": (lambda t, k: regrouped(t, [1, 2, 3, 4], 7, k, k + 9), [("engulfed group", 0, 9)] * 2),
    "strangers": (lambda t, k: regrouped(t, [1, 2, 5, 6], 7, k, k + 9), [("strangers joined", 0, 9)]),
}  # fmt: skip


def spans(kind: str, k: int, expected):
    """First and last frame of each expected error, of a fault at frame k."""
    for name, start, end in expected:
        first = start if start == 1 else k + start
        last = end if end == FRAMES else k + end
        yield name, first, last


@pytest.mark.parametrize("k", range(12, 42, 3))
@pytest.mark.parametrize("fault", FAULTS)
def test_the_fault_and_nothing_else(fault: str, k: int) -> None:
    spoil, expected = FAULTS[fault]
    scenes = [scene(n) for n in range(FRAMES)]
    run = [spoil(t, k) for t in tracks(scenes)]
    found = find_errors(Made(scenes).sequence(), run)
    listed = [(one.error.kind, one.error.start, one.error.end) for one in found.errors]
    assert sorted(listed) == sorted(spans(fault, k, expected))
    assert all(one.cost > 0 for one in found.errors)
    assert all(value == pytest.approx(0, abs=1e-9) for value in found.left.values()), found.left


def test_the_truth_has_no_errors() -> None:
    scenes = [scene(n) for n in range(FRAMES)]
    found = find_errors(Made(scenes).sequence(), tracks(scenes))
    assert found.errors == []
    assert found.scores == {"HOTA": 1, "IDF1": 1, "group_F1": 1}


def test_gains_add_up() -> None:
    scenes = [scene(n) for n in range(FRAMES)]
    run = [with_ghost(swapped(lost(regrouped(t, [1, 2], -1, 10, 20), 2, 25, 40), 30), 5, 50) for t in tracks(scenes)]
    found = find_errors(Made(scenes).sequence(), run)
    for key, score in found.scores.items():
        assert score + sum(row.gains[key] for row in found.causes) + found.left[key] == pytest.approx(1)
        assert found.left[key] == pytest.approx(0, abs=1e-9)


def meeting(n: int) -> Scene:
    """Two pairs that are one group from frame 20 to 39."""
    people = {1: (0.1 * n, 0.0), 2: (0.1 * n, 0.9), 3: (0.1 * n, 1.8), 4: (0.1 * n, 2.7)}
    one = {3: ([1, 2, 3, 4], None)}
    return Scene(people, one if 20 <= n + 1 < 40 else {1: ([1, 2], None), 2: ([3, 4], None)})


@pytest.mark.parametrize(
    ("start", "end", "groups", "kinds"),
    [
        (20, 29, {1: [1, 2], 2: [3, 4]}, ["late merge"]),
        (20, 39, {1: [1, 2], 2: [3, 4]}, ["missed merge"]),
        (40, 49, {3: [1, 2, 3, 4]}, ["late split", "late split"]),
        (40, 60, {3: [1, 2, 3, 4]}, ["missed split", "missed split"]),
    ],
)
def test_merges_and_splits(start: int, end: int, groups: dict[int, list[int]], kinds: list[str]) -> None:
    scenes = [meeting(n) for n in range(FRAMES)]
    events = [event("merge", 20, [1, 2, 3, 4]), event("split", 40, [1, 2, 3, 4])]
    label = {person: g for g, members in groups.items() for person in members}
    run = [
        changed(t, group=np.array([label[int(i)] for i in t.id])) if start <= t.index <= end else t
        for t in tracks(scenes)
    ]
    found = find_errors(Made(scenes).sequence(events=tuple(events)), run)
    assert [one.error.kind for one in found.errors] == kinds
    assert all(isinstance(one.error, GroupError) for one in found.errors)
    assert found.left["group_F1"] == pytest.approx(0, abs=1e-9)


@pytest.mark.parametrize(
    ("cause", "changes"),
    [
        ("hidden", {"visibility": 0.1}),
        ("edge", {"truncation": 0.6}),
        ("tracker", {}),
    ],
)
def test_causes_of_a_gap(cause: str, changes: dict[str, float]) -> None:
    scenes = [scene(n) for n in range(FRAMES)]
    made = truth(scenes)
    gap = (made.id == 5) & (made.frame >= 20) & (made.frame <= 30)
    columns = {"visibility": np.ones(len(made.id)), "truncation": np.zeros(len(made.id))}
    for name, value in changes.items():
        columns[name][gap] = value
    run = [lost(t, 5, 20, 30) for t in tracks(scenes)]
    (one,) = find_errors(Made(scenes).sequence(**columns), run).errors
    assert one.cause.name == cause


def test_the_detector_did_not_see_the_person() -> None:
    scenes = [scene(n) for n in range(FRAMES)]
    run = [lost(t, 5, 20, 30) for t in tracks(scenes)]
    (one,) = find_errors(Made(scenes).sequence(), run, seen=run).errors
    assert one.cause.name == "undetected"


@pytest.mark.parametrize(("where", "cause"), [((20.0, 20.0), "clutter"), ((0.5, 0.4), "double")])
def test_causes_of_a_ghost(where: tuple[float, float], cause: str) -> None:
    scenes = [scene(0) for _ in range(FRAMES)]
    run = [with_ghost(t, 20, 30) for t in tracks(scenes)]
    run = [t.replace(pos=np.where(t.id[:, None] == 99, np.array(where), t.pos)) for t in run]
    (one,) = find_errors(Made(scenes).sequence(), run).errors
    assert one.error.kind == "ghost"
    assert one.cause.name == cause


@pytest.mark.parametrize(
    ("spoil", "words"),
    [
        (lambda t: t.replace(plane="image"), "place|positions"),
        (lambda t: t.replace(unit="group"), "a tracker of whole groups"),
    ],
)
def test_what_cannot_be_compared_is_an_error_of_one_line(spoil, words: str) -> None:
    scenes = [scene(n) for n in range(FRAMES)]
    run = TrackingRun(tuple(spoil(t) for t in tracks(scenes)), {})
    with pytest.raises(InputError, match=words):
        errors_of_run(Made(scenes).sequence(), run)


def test_a_page_is_written_without_errors_that_cannot_be_found() -> None:
    scenes = [scene(n) for n in range(FRAMES)]
    run = TrackingRun(tuple(t.replace(plane="image") for t in tracks(scenes)), {})
    with pytest.warns(UserWarning, match="made: the page shows no errors"):
        assert _errors(Made(scenes).sequence(), run) == []
    assert _errors(Made(scenes).sequence(), None) == []
