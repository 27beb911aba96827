"""Errors of groups: which true groups are not found, from when to when and how; false groups; wrong lineages.

A true group is found in a frame if an estimated group has more than half of the people of both (group_F1). A tracker of
whole groups names no people: in its groups are the true people inside the hull or at most 0.3 m from it, as in the
scores. A stretch of frames in which a true group is not found in one and the same way is an error:

    missed group      its tracked members are in no group
    divided group     its tracked members are in several groups, or some of them in none; also of a group that is found,
                      if members outside are most of another estimated group
    engulfed group    most of it is in one group with most of another true group
    strangers joined  most of it is in one group with too many others
    late merge        one of these that begins with a true merge, if the group is found before it ends
    missed merge      one of these that begins with a true merge, if the group is not found before it ends
    late split        one of these that begins with a true split, if the group is found before it ends
    missed split      one of these that begins with a true split, if the group is not found before it ends
    late group        a missed group that begins with the group itself and is found later
    false group       an estimated group that finds no true group, and has nobody of a group that is not found
    wrong lineage     a merge or split that was reported with the right kind, start and people, but with other groups
                      before or after than the true event has, as in lineage_accuracy; from the event to the report

A group of which too few members are tracked is *unseen*: these are errors of people, not of the group. Groups that are
engulfed in one estimated group at the same time are one error, which names them all.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import groupby

import numpy as np

from sim.types import GroupEvent, Ints
from tracking.errors.people import first_and_last
from tracking.scoring.event_members import HEADLINE
from tracking.scoring.events import MatchedEvents, same_lineage
from tracking.scoring.group_rows import GroupRows
from tracking.scoring.groups import group_of_person, groups_found, shared_members
from tracking.scoring.rows import FrameRows

AT_THE_EVENT = 1.0  # s: a stretch that begins so soon after an event belongs to it
JOINS, PARTS = ("merge", "form"), ("split", "dissolve")
FOUND, UNSEEN = "found", "unseen"
MISSED, DIVIDED, ENGULFED, STRANGERS = "missed group", "divided group", "engulfed group", "strangers joined"
FALSE, LINEAGE = "false group", "wrong lineage"
LATE_GROUP = "late group"
EVENT_KINDS = ("late merge", "missed merge", "late split", "missed split")
KINDS = (MISSED, DIVIDED, ENGULFED, STRANGERS, *EVENT_KINDS, LATE_GROUP, FALSE, LINEAGE)


@dataclass(frozen=True)
class GroupError:
    """One error of a true group, a false group, or a wrong lineage."""

    kind: str
    start: int  # first frame
    end: int  # last frame
    group: int | None  # id of the true group, None for a false one and a lineage
    people: tuple[int, ...]  # ids of its people; of a false group, of the true people in it; of an event, its members
    others: tuple[int, ...] = ()  # ids of further true people in the estimated groups
    rows: tuple[int, ...] = ()  # tracked rows that belong together
    alone: tuple[int, ...] = ()  # memberships, of the same estimated groups, of people who belong to no group there
    false: tuple[int, ...] = ()  # rows of estimated groups that should not be there
    engulfed: tuple[int, ...] = ()  # ids of the true groups that are engulfed with each other, with `group`


class Memberships:
    """Who is in which group in the labelled frames, on both sides, as the scores of groups count them.

    The R rows of true and S rows of tracked people are those of all scored frames. Where the tracker names no members,
    the true people stand for the tracked ones.

    Attributes: true: G groups, members are rows of true people. est: H groups, members are rows of tracked people;
    memberships are sorted by group. people: the R true people. person: (S,) true row of each tracked row, -1 none.
    persons: the same with -1 as last element, for a member who is not among the people. named: False if the tracker
    names no members. track: (R,) tracked row of each true row, -1 none. true_group: (R + 1,) row of the true group of
    each true row, -1 for none and as last element. shared: the numbers of common people; parts: for each true group,
    the estimated groups with some of its people, and how many. found: the rows of true groups that are found, each with
    the most similar estimated group; finders: the rows of these. true_members, members: the rows of people of each true
    and each estimated group. states: the state of each true group, (G,).
    """

    def __init__(self, true: GroupRows, est: GroupRows, people: FrameRows, person: Ints, named: bool) -> None:
        self.true, self.est, self.people, self.person, self.named = true, est, people, person, named
        self.persons = np.append(person, -1)
        self.track = np.full(len(people), -1, np.int64)
        self.track[person[person >= 0]] = np.flatnonzero(person >= 0)
        self.true_group = group_of_person(true, len(people))
        self.shared = shared_members(true, est, self.persons[est.member], len(people))
        self.parts: list[dict[int, int]] = [{} for _ in range(len(true))]
        for key, count in zip(self.shared.key.tolist(), self.shared.count.tolist(), strict=True):
            self.parts[key // self.shared.width][key % self.shared.width] = count
        n, m = true.count.tolist(), est.count.tolist()
        self.found = {
            i: max(self.parts[i].items(), key=lambda part: part[1] / (n[i] + m[part[0]] - part[1]))[0]
            for i in np.flatnonzero(groups_found(true, est, self.shared)).tolist()
        }
        self.finders = set(self.found.values())
        self.true_members, self.members = (_split(side.of, side.member, len(side)) for side in (true, est))
        self.states = [self._state(i) for i in range(len(true))]

    def _state(self, i: int) -> str:
        n = len(self.true_members[i])
        if i in self.found:
            return DIVIDED if self._has_part_outside(i) else FOUND
        if 2 * sum(self.track[row] >= 0 for row in self.true_members[i] if row >= 0) <= n:
            return UNSEEN
        j, common = max(self.parts[i].items(), key=lambda part: part[1], default=(-1, 0))
        if not common:
            return MISSED
        if 2 * common <= n:
            return DIVIDED
        whole = (2 * self.parts[h].get(j, 0) > len(self.true_members[h]) for h in self._groups_in(j) if h != i)
        return ENGULFED if any(whole) else STRANGERS

    def _has_part_outside(self, i: int) -> bool:
        """Returns True if members of a found group that are not in the one that finds it are most of another group."""
        if len(self.parts[i]) < 2:
            return False
        est = self.members
        outside = {int(self.track[row]) for row in self.true_members[i] if row >= 0} - {*est[self.found[i]], -1}
        return any(2 * len(outside.intersection(est[j])) > len(est[j]) for j in self.parts[i] if j not in self.finders)

    def _groups_in(self, j: int) -> set[int]:
        """Returns the rows of true groups with people in an estimated group."""
        return set(self.true_group[self.persons[self.members[j]]].tolist()) - {-1}

    def astray(self, j: int) -> list[int]:
        """Returns the memberships (indices) of estimated group j that do not belong there: of people in no true group,
        or in a true group that another estimated group finds."""
        first, after = np.searchsorted(self.est.of, (j, j + 1)).tolist()
        groups = self.true_group[self.persons[self.est.member[first:after]]].tolist()
        return [k for k, i in enumerate(groups, first) if i < 0 or self.found.get(i, j) != j]


def _split(of: Ints, member: Ints, count: int) -> list[list[int]]:
    lists: list[list[int]] = [[] for _ in range(count)]
    for group, row in zip(of.tolist(), member.tolist(), strict=True):
        lists[group].append(row)
    return lists


def group_errors(of: Memberships, events: Sequence[GroupEvent], fps: float) -> list[GroupError]:
    """Returns all errors of groups except wrong lineages, sorted by start; events: the truth's events."""
    found = [*_of_both_sides(_errors_of_groups(of)), *_false_groups(of)]
    named = [_named(error, of, events, AT_THE_EVENT * fps) for error in found]
    return sorted(named, key=lambda error: (error.start, error.end, error.kind))


def wrong_lineages(matched: Iterable[MatchedEvents]) -> list[GroupError]:
    """Returns an error for each matched merge and split whose true lineage is known and differs from the reported one,
    sorted by start."""
    pairs = [pair for one in matched if one.kind in HEADLINE for pair in one.pairs]
    return [
        GroupError(LINEAGE, a.start, max(a.start, b.emitted or a.start), None, tuple(sorted(a.members.people)))
        for a, b in sorted(pairs, key=lambda pair: pair[0].start)
        if a.members is not None and a.has_lineage and not same_lineage(a, b)
    ]


def _errors_of_groups(of: Memberships) -> Iterator[GroupError]:
    for id, kind, stretch in _stretches(of.true.rows, list(enumerate(of.states))):
        if kind in (FOUND, UNSEEN):
            continue
        rows = [int(of.track[row]) for i in stretch for row in of.true_members[i] if row >= 0 and of.track[row] >= 0]
        parts = [j for i in stretch for j in of.parts[i]]
        people = _ids(of, rows)
        others = tuple(id for id in _ids(of, (row for j in parts for row in of.members[j])) if id not in people)
        alone = tuple(k for j in parts for k in of.astray(j))
        yield GroupError(kind, *first_and_last(of.true.rows, stretch), id, people, others, tuple(rows), alone)


def _of_both_sides(errors: Iterable[GroupError]) -> list[GroupError]:
    """Returns the errors with those of groups that are engulfed with each other, at the same time, as one."""
    found = list[GroupError]()
    for error in errors:
        both = [other for other in found if _engulfs(error, other)]
        if both:
            found = [other for other in found if other not in both]
            error = _joined([*both, error])
        found.append(error)
    return found


def _engulfs(a: GroupError, b: GroupError) -> bool:
    meet = set(a.people) & set(b.others) and set(b.people) & set(a.others)
    return a.kind == b.kind == ENGULFED and bool(meet) and a.start <= b.end and b.start <= a.end


def _joined(errors: Sequence[GroupError]) -> GroupError:
    first, start, end = errors[0], min(e.start for e in errors), max(e.end for e in errors)
    others, alone, groups = ({x for e in errors for x in one(e)} for one in (_both, lambda e: e.alone, _groups_of))
    rows = tuple(dict.fromkeys(row for e in errors for row in e.rows))
    return replace(
        first, start=start, end=end, others=tuple(sorted(others - {*first.people})), rows=rows,
        alone=tuple(sorted(alone)), engulfed=tuple(sorted(groups)),
    )  # fmt: skip


def _both(error: GroupError) -> tuple[int, ...]:
    return (*error.people, *error.others)


def _groups_of(error: GroupError) -> tuple[int, ...]:
    return error.engulfed or (() if error.group is None else (error.group,))


def _false_groups(of: Memberships) -> Iterator[GroupError]:
    explained = set(of.finders)
    for i, state in enumerate(of.states):
        explained |= set() if state == FOUND else set(of.parts[i])
    false = [(j, FALSE) for j in range(len(of.est)) if j not in explained]
    for _, kind, stretch in _stretches(of.est.rows, false):
        people = _ids(of, (row for j in stretch for row in of.members[j]))
        yield GroupError(kind, *first_and_last(of.est.rows, stretch), None, people, false=tuple(stretch))


def _ids(of: Memberships, rows: Iterable[int]) -> tuple[int, ...]:
    """Returns the ids of the true people of some tracked rows."""
    return tuple(sorted({int(of.people.id[of.person[row]]) for row in rows if row >= 0 and of.person[row] >= 0}))


def _stretches(rows: FrameRows, states: Iterable[tuple[int, str]]) -> Iterator[tuple[int, str, list[int]]]:
    """Yields id, state and rows of each stretch of frames in which a group is in one state; states: by row."""
    ordered = sorted((int(rows.id[row]), int(rows.frame[row]), row, state) for row, state in states)
    # in consecutive frames of one id, the frame less the place in the list is the same
    keyed = groupby(enumerate(ordered), key=lambda item: (item[1][0], item[1][3], item[1][1] - item[0]))
    for (id, state, _), stretch in keyed:
        yield id, state, [row for _, (_, _, row, _) in stretch]


def _named(error: GroupError, of: Memberships, events: Sequence[GroupEvent], reach: float) -> GroupError:
    """Returns the error with the name of the true event that it begins with, if there is one."""
    for event in events:
        if not event.start - 1 <= error.start <= event.start + reach or not _concerns(event, error):
            continue
        if event.kind in JOINS and error.kind in (MISSED, DIVIDED):
            return replace(error, kind=f"{_when(error, of)} merge")
        if event.kind in PARTS and error.kind in (ENGULFED, STRANGERS, FALSE):
            return replace(error, kind=f"{_when(error, of)} split")
    if error.group is None:
        return error
    first = int(of.true.rows.frame[of.true.rows.id == error.group][0])
    late = error.kind == MISSED and error.start <= first + reach and _when(error, of) == "late"
    return replace(error, kind=LATE_GROUP) if late else error


def _concerns(event: GroupEvent, error: GroupError) -> bool:
    """Returns True if an event is about the true group, or about all people of the false one."""
    if error.group is None:
        return len(error.people) > 1 and set(error.people) <= set(event.members)
    groups, people = {*event.before, *event.after}, set(event.members)
    return bool(groups & {*_groups_of(error)} or people & {*error.people})


def _when(error: GroupError, of: Memberships) -> str:
    """Returns "late" if a group of the error is found, or the false one gone, while its people are there; else
    "missed"."""
    if error.group is None:
        there = of.people.frame[np.isin(of.people.id, error.people)]
        return "late" if there.max() > error.end else "missed"
    later = np.flatnonzero(np.isin(of.true.rows.id, _groups_of(error)) & (of.true.rows.frame > error.end))
    return "late" if any(of.states[i] == FOUND for i in later.tolist()) else "missed"
