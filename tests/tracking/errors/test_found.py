"""A truth given as tracks with one fault: the fault is listed, named and explained, and nothing else is."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from scenarios.errors import InputError
from sim.types import GroupEvent, Groups, Sequence, Tracks
from tests.hand_made import Scene, event, tracks, truth
from tracking.app.report.moments import shown_errors
from tracking.errors.found import EVERY, errors_of_run, find_errors
from tracking.errors.groups import GroupError
from tracking.running.run import TrackingRun
from tracking.scoring.evaluation import evaluate

FRAMES = 60
SPEED = 0.12  # m per frame


def scene(k: int, swapped: bool = False) -> Scene:
    """People 1, 2 and 3, 4 walk in pairs, 5 and 6 alone; pairs and lone people keep 6 m and more from each other."""
    x = SPEED * k
    people = {1: (x, 0.0), 2: (x, 0.9), 3: (x, 8.0), 4: (x, 8.9), 5: (-x, 16.0), 6: (-x, 24.0)}
    return Scene(people, {1: ([1, 2], None), 2: ([3, 4], None)})


SCENES = [scene(n) for n in range(FRAMES)]


def sequence_of(scenes: list[Scene], **changes) -> Sequence:
    made = truth(scenes, **changes)
    return Sequence("made", made.fps, made.length, lambda: iter(()), load_truth=lambda: made)


def with_rows(t: Tracks, id, group, pos) -> Tracks:
    n = len(id)
    return t.replace(id=id, group=group, pos=pos, vel=np.zeros((n, 2)), cov=np.zeros((n, 4, 4)), score=np.ones(n))


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
    return with_rows(t, ids, label, (t.pos if pos is None else pos)[keep]).replace(groups=groups)


def lost(t, person, start, end):
    return changed(t, keep=t.id != person) if start <= t.index <= end else t


def renamed(t, person, new, start):
    return changed(t, id=np.where(t.id == person, new, t.id)) if t.index >= start else t


def regrouped(t, people, group, start, end):
    return changed(t, group=np.where(np.isin(t.id, people), group, t.group)) if start <= t.index <= end else t


def with_ghost(t, start, end):
    if not start <= t.index <= end:
        return t
    return with_rows(t, np.append(t.id, 99), np.append(t.group, -1), np.vstack([t.pos, [20.0, 20.0]]))


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
    "engulfed group": (lambda t, k: regrouped(t, [1, 2, 3, 4], 7, k, k + 9), [("engulfed group", 0, 9)]),
    "strangers": (lambda t, k: regrouped(t, [1, 2, 5, 6], 7, k, k + 9), [("strangers joined", 0, 9)]),
}  # fmt: skip


def spans(kind: str, k: int, expected):
    """First and last frame of each expected error, of a fault at frame k."""
    for name, start, end in expected:
        first = start if start == 1 else k + start
        last = end if end == FRAMES else k + end
        yield name, first, last


@pytest.mark.parametrize("k", range(12, 42, 9))
@pytest.mark.parametrize("fault", FAULTS)
def test_the_fault_and_nothing_else(fault: str, k: int) -> None:
    spoil, expected = FAULTS[fault]
    run = [spoil(t, k) for t in tracks(SCENES)]
    found = find_errors(sequence_of(SCENES), run)
    listed = [(one.error.kind, one.error.start, one.error.end) for one in found.errors]
    assert sorted(listed) == sorted(spans(fault, k, expected))
    assert all(one.cost > 0 for one in found.errors)
    assert all(value == pytest.approx(0, abs=1e-9) for value in found.left.values()), found.left


def test_the_truth_has_no_errors() -> None:
    found = find_errors(sequence_of(SCENES), tracks(SCENES))
    assert found.errors == []
    assert found.scores == {"HOTA": 1, "IDF1": 1, "group_F1": 1}


def test_gains_add_up_and_the_table_by_cause_needs_no_single_costs() -> None:
    run = [with_ghost(swapped(lost(regrouped(t, [1, 2], -1, 10, 20), 2, 25, 40), 30), 5, 50) for t in tracks(SCENES)]
    found, without = (find_errors(sequence_of(SCENES), run, costs=costs) for costs in (EVERY, 0))
    assert without.causes == found.causes
    assert without.left == found.left
    assert all(one.cost is None for one in without.errors)
    gains = [row.gains["HOTA"] + row.gains["group_F1"] for row in found.causes]
    assert gains[0] == max(gains)
    for key, score in found.scores.items():
        assert score + sum(row.gains[key] for row in found.causes) + found.left[key] == pytest.approx(1)
        assert found.left[key] == pytest.approx(0, abs=1e-9)


def meeting(n: int) -> Scene:
    """Two pairs that are one group from frame 20 to 39."""
    people = {1: (0.1 * n, 0.0), 2: (0.1 * n, 0.9), 3: (0.1 * n, 1.8), 4: (0.1 * n, 2.7)}
    one = {3: ([1, 2, 3, 4], None)}
    return Scene(people, one if 20 <= n + 1 < 40 else {1: ([1, 2], None), 2: ([3, 4], None)})


def reported(scenes: list[Scene], start: int, end: int, groups, unit: str) -> list[Tracks]:
    """A tracker that reports other groups in some frames."""
    told = [Scene(s.people, groups) if start <= k <= end else s for k, s in enumerate(scenes, 1)]
    return tracks(told, unit=unit)


TWO, ONE = {1: ([1, 2], None), 2: ([3, 4], None)}, {3: ([1, 2, 3, 4], None)}


MERGES_AND_SPLITS = [
    (20, 29, TWO, ["late merge"]),
    (20, 39, TWO, ["missed merge"]),
    (40, 49, ONE, ["late split"]),
    (40, 60, ONE, ["missed split"]),
]


@pytest.mark.parametrize("unit", ["person", "group"])
@pytest.mark.parametrize(("start", "end", "groups", "kinds"), MERGES_AND_SPLITS)
def test_merges_and_splits(start: int, end: int, groups, kinds: list[str], unit: str) -> None:
    """Pairs are so far from each other that the hulls of whole groups hold no others."""
    far = [Scene({i: (x, 3 * y) for i, (x, y) in meeting(n).people.items()}, meeting(n).given) for n in range(FRAMES)]
    events = (event("merge", 20, [1, 2, 3, 4]), event("split", 40, [1, 2, 3, 4]))
    found = find_errors(sequence_of(far, events=events), reported(far, start, end, groups, unit))
    assert [one.error.kind for one in found.errors] == kinds
    assert all(isinstance(one.error, GroupError) for one in found.errors)
    assert found.left["group_F1"] == pytest.approx(0, abs=1e-9)


CAUSES = [
    ("hidden", {"visibility": 0.3}), ("tracker", {"visibility": 0.4}), ("edge", {"truncation": 0.25}),
    ("tracker", {"truncation": 0.15}), ("tracker", {}), ("undetected", {}),
]  # fmt: skip


@pytest.mark.parametrize(("cause", "changes"), CAUSES)
def test_causes_of_a_gap(cause: str, changes: dict[str, float]) -> None:
    made = truth(SCENES)
    gap = (made.id == 5) & (made.frame >= 20) & (made.frame <= 30)
    columns = {"visibility": np.ones(len(made.id)), "truncation": np.zeros(len(made.id))}
    for name, value in changes.items():
        columns[name][gap] = value
    run = [lost(t, 5, 20, 30) for t in tracks(SCENES)]
    (one,) = find_errors(sequence_of(SCENES, **columns), run, seen=run if cause == "undetected" else None).errors
    assert one.cause.name == cause


@pytest.mark.parametrize(("where", "cause"), [((20.0, 20.0), "clutter"), ((0.5, 0.4), "double")])
def test_causes_of_a_ghost(where: tuple[float, float], cause: str) -> None:
    scenes = [scene(0) for _ in range(FRAMES)]
    run = [with_ghost(t, 20, 30) for t in tracks(scenes)]
    run = [t.replace(pos=np.where(t.id[:, None] == 99, np.array(where), t.pos)) for t in run]
    (one,) = find_errors(sequence_of(scenes), run).errors
    assert one.error.kind == "ghost"
    assert one.cause.name == cause


INCOMPARABLE = [
    (lambda t: t.replace(plane="image"), "place|positions"),
    (lambda t: t.replace(plane="image", unit="group"), "no scale of the image"),
]


@pytest.mark.parametrize(("spoil", "words"), INCOMPARABLE)
def test_what_cannot_be_compared_is_an_error_of_one_line(spoil, words: str) -> None:
    run = TrackingRun(tuple(spoil(t) for t in tracks(SCENES)), {})
    with pytest.raises(InputError, match=words):
        errors_of_run(sequence_of(SCENES, px_per_m=np.nan), run)


WHOLE_GROUP_FAULTS = {
    "missed": ({1: ([1, 2], None)}, ["missed group"]),
    "engulfed": ({7: ([1, 2, 3, 4], None)}, ["engulfed group"]),
    "nobody": ({1: ([1, 2], None), 2: ([3, 4], None), 7: ([], (90, 90, 92, 92))}, ["false group"]),
    "double": ({1: ([1, 2], None), 2: ([3, 4], None), 7: ([1, 2], None)}, ["false group"]),
    "strangers": ({2: ([3, 4], None), 7: ([1, 2, 5, 6], None)}, ["strangers joined"]),
}


@pytest.mark.parametrize("k", range(12, 42, 9))
@pytest.mark.parametrize(("groups", "kinds"), WHOLE_GROUP_FAULTS.values(), ids=WHOLE_GROUP_FAULTS)
def test_errors_of_a_tracker_of_whole_groups(groups, kinds: list[str], k: int) -> None:
    scenes = [Scene({**scene(n).people, 5: (SPEED * n, 2.0), 6: (SPEED * n, -1.5)}, scene(n).given) for n in range(60)]
    run, sequence = reported(scenes, k, k + 9, groups, "group"), sequence_of(scenes)
    found = find_errors(sequence, run)
    assert [(one.error.kind, one.error.start, one.error.end) for one in found.errors] == [(x, k, k + 9) for x in kinds]
    assert all(one.cost > 0 for one in found.errors)
    assert found.left["group_F1"] == pytest.approx(0, abs=1e-9)
    assert np.isnan([found.scores["HOTA"], found.left["IDF1"]]).all()
    assert found.scores["group_F1"] == pytest.approx(evaluate(sequence.truth, run)["group_F1"])


def test_a_part_of_a_group_that_is_found_is_an_error() -> None:
    people = {k: (0.0, 0.8 * k) for k in range(1, 6)}
    scenes = [Scene(people, {1: ([1, 2, 3, 4, 5], None)}) for _ in range(FRAMES)]
    run = [regrouped(t, [4, 5], 8, 20, 29) for t in tracks(scenes)]
    (one,) = find_errors(sequence_of(scenes), run).errors
    assert (one.error.kind, one.error.start, one.error.end) == ("divided group", 20, 29)
    assert one.error.people == (1, 2, 3, 4, 5)


@pytest.mark.parametrize("unit", ["person", "group"])
def test_groups_that_are_engulfed_with_each_other_are_one_error(unit: str) -> None:
    """Three pairs are reported as one group; the last one leaves it earlier."""
    people = {k: (0.0, 0.9 * k) for k in range(1, 7)}
    scenes = [Scene(people, {k: ([2 * k - 1, 2 * k], None) for k in (1, 2, 3)}) for _ in range(FRAMES)]
    whole, two = {7: ([1, 2, 3, 4, 5, 6], None)}, {7: ([1, 2, 3, 4], None), 8: ([5, 6], None)}
    run = tracks([Scene(people, whole if k < 30 else two) for k in range(FRAMES)], unit=unit)
    found = find_errors(sequence_of(scenes), run)
    (one,) = found.errors
    assert (one.error.kind, one.error.start, one.error.end) == ("engulfed group", 1, FRAMES)
    assert one.who == "groups 1 2 3: people 1 2 with 3 4 5 6"
    assert one.facts(10.0)["engulfed"] == [1, 2, 3]
    assert found.left["group_F1"] == pytest.approx(0, abs=1e-9)


def test_groups_that_are_engulfed_at_different_times_or_places_are_two_errors() -> None:
    people = {k: (0.0, 0.9 * k + 9 * (k > 4)) for k in range(1, 9)}
    scenes = [Scene(people, {k: ([2 * k - 1, 2 * k], None) for k in (1, 2, 3, 4)}) for _ in range(FRAMES)]
    run = [regrouped(regrouped(t, [1, 2, 3, 4], 7, 10, 19), [5, 6, 7, 8], 8, 15, 24) for t in tracks(scenes)]
    run = [regrouped(t, [1, 2, 3, 4], 7, 40, 44) for t in run]
    found = [(one.error.start, one.error.end, one.who) for one in find_errors(sequence_of(scenes), run).errors]
    pairs = ["groups 1 2: people 1 2 with 3 4", "groups 3 4: people 5 6 with 7 8"]
    assert found == [(10, 19, pairs[0]), (15, 24, pairs[1]), (40, 44, pairs[0])]


def test_nothing_is_left_of_a_group_with_people_who_are_found_elsewhere() -> None:
    people = {1: (0.0, 0.0), 2: (0.0, 0.9), **{k: (0.0, 0.9 * k) for k in range(11, 17)}}
    scenes = [Scene(people, {1: ([1, 2], None), 2: (list(range(11, 17)), None)}) for _ in range(FRAMES)]
    run = [regrouped(t, [1, 2, 15, 16], 8, 20, 29) for t in tracks(scenes)]
    found = find_errors(sequence_of(scenes), run)
    assert [one.error.kind for one in found.errors] == ["strangers joined"]
    assert found.left["group_F1"] == pytest.approx(0, abs=1e-9)


@pytest.mark.parametrize(("start", "kind"), [(20, "late group"), (45, "missed group")])
def test_a_group_is_late_only_at_its_beginning(start: int, kind: str) -> None:
    """It is there from frame 20 on, and missed for 5 frames."""
    people = {1: (0.0, 0.0), 2: (0.0, 0.9)}
    scenes = [Scene(people, {1: ([1, 2], None)} if n >= 20 else {}) for n in range(1, FRAMES + 1)]
    run = [regrouped(t, [1, 2], -1, start, start + 4) for t in tracks(scenes)]
    (one,) = find_errors(sequence_of(scenes), run).errors
    assert (one.error.kind, one.error.start, one.error.end) == (kind, start, start + 4)


@pytest.mark.parametrize(("end", "kind"), [(49, "late split"), (60, "missed split")])
def test_a_pair_that_parts_late_is_a_late_split(end: int, kind: str) -> None:
    people = {1: (0.0, 0.0), 2: (0.0, 0.9)}
    scenes = [Scene(people, {1: ([1, 2], None)} if n < 39 else {}) for n in range(FRAMES)]
    run = [regrouped(t, [1, 2], 1, 40, end) for t in tracks(scenes)]
    (one,) = find_errors(sequence_of(scenes, events=(event("dissolve", 40, [1, 2]),)), run).errors
    assert (one.error.kind, one.error.start, one.error.end) == (kind, 40, end)


@pytest.mark.parametrize(("more", "kinds"), [([], []), ([5], ["wrong lineage"])])
@pytest.mark.parametrize("unit", ["person", "group"])
def test_wrong_lineage(unit: str, more: list[int], kinds: list[str]) -> None:
    """The merge is reported with a further parent: person 5, or of whole groups an empty one."""
    scenes = [Scene({**meeting(n).people, 5: (0.1 * n, 12.0)}, meeting(n).given) for n in range(FRAMES)]
    true = event("merge", 20, [1, 2, 3, 4], pos=(2.0, 1.35))
    members = (1, 2, 3, 4, *more) if unit == "person" else ()
    told = GroupEvent("merge", 20, 20, 22, (1, 2, *more), (3,), members, (2.0, 1.35))
    run = [t.replace(own_events=("merge", "split")) for t in tracks(scenes, [told], unit=unit)]
    found = find_errors(sequence_of(scenes, events=(true,)), run)
    assert [one.error.kind for one in found.errors] == kinds
    for one in found.errors:
        assert (one.error.start, one.error.end, one.error.people) == (20, 22, (1, 2, 3, 4))
        assert one.cost is None


@pytest.mark.parametrize(
    ("mode", "change", "cause"), [("image", 1.5, "light"), ("image", 1.05, "tracker"), ("file", 1.5, "tracker")]
)
def test_a_change_of_the_light_is_a_cause_of_errors_from_pixels(mode: str, change: float, cause: str) -> None:
    light = np.where(np.arange(FRAMES) < 24, 1.0, change)
    sequence = replace(sequence_of(SCENES), load_light=lambda: light)
    run = TrackingRun(
        tuple(lost(regrouped(t, [1, 2], -1, 25, 30), 5, 25, 30) for t in tracks(SCENES)), {"detections": mode}
    )
    found = find_errors(sequence, run)
    assert {one.error.kind: one.cause.name for one in found.errors} == {"fragment": cause, "missed group": cause}


def test_a_page_is_written_without_errors_that_cannot_be_found() -> None:
    run = TrackingRun(tuple(t.replace(plane="image") for t in tracks(SCENES)), {})
    with pytest.warns(UserWarning, match="made: the page shows no errors"):
        assert shown_errors(sequence_of(SCENES), run).errors == []
