"""Converts events of the truth and of a tracker into `ComparableEvent`s, so that members on both sides are true people.

`true_events` converts events of the truth, `tracked_events` those that a tracker reports with members,
`events_of_hulls` events that name no members. An event belongs to the frame in which it starts.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence

import numpy as np

from sim.types import Array, Bools, GroupEvent, Ints, Tracks
from tracking.scoring.events import COUNTS_AS, HEADLINE, KINDS, LATE, ComparableEvent, EventMembers
from tracking.scoring.people_and_groups import GroupRows, PersonRows
from tracking.scoring.rows import FrameRows, RowLookup

HULL_TIME = 2.0  # s before and after an event in which hulls decide who is in a group: the time of the merge rule
CHANGES = frozenset(HEADLINE) | {kind for kind, counts_as in COUNTS_AS.items() if counts_as in HEADLINE}


def true_events(
    events: Iterable[GroupEvent], people: PersonRows, positions: Array | None, frames: Bools
) -> list[ComparableEvent]:
    """Returns the truth's events of known kinds that start in a frame f where frames[f] is true.

    people: true people; positions (R, 2): theirs on the surface of comparison, None if `GroupEvent.pos` is on it
    already. With positions, an event lies at the mean of its members at its start (nan if none is present). Parents are
    the groups of the members one frame before the start, children are the groups at the start. Both are None if the
    kind changes no groups or if parents and children are equal.
    """
    lookup, group = RowLookup(people.rows), _group_by_row(people.group)

    def comparable(event: GroupEvent) -> ComparableEvent:
        before = _by_group(event.members, lambda m: group[lookup.last(m, event.start - 1, 0)])
        after = _by_group(event.members, lambda m: group[lookup.next(m, event.start, 0)])
        pos = event.pos if positions is None else _mean_position(event, lookup, positions)
        members = EventMembers(frozenset(event.members))
        before, after = _by_kind(event, before, after)
        if event.kind not in CHANGES or sorted(before) == sorted(after):
            return ComparableEvent(event.kind, event.start, None, members, pos)
        parents, children = (tuple(EventMembers(frozenset(part)) for part in parts) for parts in (before, after))
        return ComparableEvent(event.kind, event.start, None, members, pos, parents, children)

    return [comparable(event) for event in events if _counts(event, frames)]


def _counts(event: GroupEvent, frames: Bools) -> bool:
    """True if the kind is scored and the event starts in a frame to be scored."""
    known = event.kind in KINDS or event.kind in COUNTS_AS
    return known and 0 <= event.start < len(frames) and bool(frames[event.start])


def _group_by_row(group: Ints) -> list[int]:
    """Returns the group of each row with -1 appended, so that index -1 (no row) means no group."""
    return [*group.tolist(), -1]


def _by_group(members: Sequence[int], group: Callable[[int], int]) -> list[list[int]]:
    """Returns the members as lists, one per group; a member without a group is a list of its own."""
    parts: dict[tuple[int, int], list[int]] = {}
    for m in members:
        g = group(m)
        parts.setdefault((g, -1) if g >= 0 else (-1, m), []).append(m)
    return list(parts.values())


def _by_kind(
    event: GroupEvent, before: list[list[int]], after: list[list[int]]
) -> tuple[list[list[int]], list[list[int]]]:
    """Returns parents and children, taken from the kind if the labels are the same before and after.

    Then `form` makes one group of single people, and `dissolve` single people of one group. This is so in data whose
    labels never change.
    """
    if sorted(before) != sorted(after):
        return before, after
    one, alone = [list(event.members)], [[m] for m in event.members]
    return {"form": (alone, one), "dissolve": (one, alone)}.get(event.kind, (before, after))


def _mean_position(event: GroupEvent, lookup: RowLookup, positions: Array) -> tuple[float, float]:
    """Returns the mean position of the members at the event's start, nan if none is present."""
    rows = [row for m in event.members if (row := lookup.nearest(m, event.start, 0)) >= 0]
    if not rows:
        return float("nan"), float("nan")
    x, y = positions[rows].mean(axis=0)
    return float(x), float(y)


def tracked_events(
    tracks: Sequence[Tracks], people: PersonRows, mapping: Ints, true: FrameRows, frames: Bools, fps: float
) -> list[ComparableEvent]:
    """Returns a tracker's events with members, of known kinds, that start in a frame f where frames[f] is true.

    people: tracked people; mapping (R,): the row of `true` that each is mapped to, -1 none. A member becomes the person
    it is mapped to at the event's start, or in the nearest frame within 1 s of it. A member that is never mapped in
    this time, or to a person already listed, is unmatched. Parents are the groups of the members in the frame before
    the report, children those in the frame of the report. If both are equal, parents are those of the frame before the
    event's start.
    """
    reach = round(LATE * fps)
    mapped, lookup, group = RowLookup(people.rows, mapping >= 0), RowLookup(people.rows), _group_by_row(people.group)
    person = np.append(true.id, -1)[mapping].tolist()

    def groups_until(event: GroupEvent, frame: int) -> list[list[int]]:
        return _by_group(event.members, lambda m: group[lookup.last(m, frame, reach)])

    def comparable(event: GroupEvent, reported: int) -> ComparableEvent:
        after = _by_group(event.members, lambda m: group[lookup.next(m, reported, reach)])
        before = groups_until(event, reported - 1)
        before = groups_until(event, event.start - 1) if sorted(before) == sorted(after) else before
        before, after = _by_kind(event, before, after)
        rows = {m: mapped.nearest(m, event.start, reach) for m in event.members}
        known = {m: person[row] for m, row in rows.items() if row >= 0}
        parents, children = (tuple(_true_members(p, known) for p in parts) for parts in (before, after))
        members = _true_members(event.members, known)
        return ComparableEvent(event.kind, event.start, reported, members, event.pos, parents, children)

    return [comparable(event, reported) for event, reported in _reports(tracks, frames) if event.members]


def _true_members(members: Sequence[int], known: Mapping[int, int]) -> EventMembers:
    """Returns the people that these tracks are mapped to; known: person of each mapped track."""
    people = frozenset(known[m] for m in members if m in known)
    return EventMembers(people, len(members) - len(people))


def events_of_hulls(
    tracks: Sequence[Tracks], groups: GroupRows, true: FrameRows, frames: Bools, fps: float, without_members: bool
) -> list[ComparableEvent]:
    """Returns a tracker's events, of known kinds, that start in a frame f where frames[f] is true; members are None.

    without_members: return only the events that name no members. groups: the tracker's, with rows of `true` as members
    (`people_inside`). Parents and children are the people whom the hulls of the event's `before` and `after` groups
    contain. Children are judged in the 2 s from the report on. Parents are judged in the 2 s before the event's start,
    or before the report if a parent appears only at the start or later.
    """
    span, person = round(HULL_TIME * fps), true.id[groups.member]

    def comparable(event: GroupEvent, reported: int) -> ComparableEvent:
        end = event.start if _last_appearance(groups.rows, event.before) < event.start else reported
        parents = _contained(groups, person, event.before, range(end - span, end))
        children = _contained(groups, person, event.after, range(reported, reported + span))
        return ComparableEvent(event.kind, event.start, reported, None, event.pos, parents, children)

    found = _reports(tracks, frames)
    return [comparable(event, reported) for event, reported in found if not (without_members and event.members)]


def _last_appearance(rows: FrameRows, ids: Sequence[int]) -> int:
    """Returns the latest of the first frames of these ids, 0 if none has a row; rows sorted by frame."""
    frames = [rows.frame[rows.id == id] for id in ids]
    return max((int(own[0]) for own in frames if len(own)), default=0)


def _contained(groups: GroupRows, person: Ints, ids: Sequence[int], span: range) -> tuple[EventMembers, ...]:
    """Returns the people of each of these groups during a span of frames; person (K,): true id of each membership.

    A person belongs to the one group that contained the person in most frames (of equals the lowest id), and only if
    these are more than half of the frames in which the group was reported. One frame is not enough, because the hulls
    of people behind each other overlap in the image.
    """
    rows, now = groups.rows, (groups.rows.frame >= span.start) & (groups.rows.frame < span.stop)
    reported = Counter(rows.id[now].tolist())
    inside = now[groups.of]
    pairs, times = np.unique(np.stack([person[inside], rows.id[groups.of[inside]]]), axis=1, return_counts=True)
    best: dict[int, tuple[int, int]] = {}  # person: (number of frames, minus the group's id)
    for p, group, n in zip(*pairs.tolist(), times.tolist(), strict=True):
        best[p] = max(best.get(p, (0, 0)), (n, -group))
    return tuple(
        EventMembers(frozenset(p for p, (n, minus) in best.items() if -minus == id and 2 * n > reported[id]))
        for id in ids
    )


def _reports(tracks: Sequence[Tracks], frames: Bools) -> list[tuple[GroupEvent, int]]:
    """Returns the events that count, with the frame of the `Tracks` that contains each, whatever its `emitted` is."""
    return [(event, t.index) for t in tracks for event in t.events if _counts(event, frames)]
