"""Converts events of the truth and of a tracker into `ComparableEvent`s, so that members on both sides are true people.

`true_events` converts events of the truth, `tracked_events` those that a tracker reports with members,
`events_of_hulls` events judged by who is inside the hulls of groups, for trackers that name no members. An event
belongs to the frame in which it starts.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence

import numpy as np

from sim.types import Array, Bools, GroupEvent, Ints, Tracks
from tracking.scoring.events import COUNTS_AS, HEADLINE, KINDS, ComparableEvent, EventMembers
from tracking.scoring.people_and_groups import GroupRows, PersonRows
from tracking.scoring.rows import FrameRows, RowLookup

HULL_TIME = 2.0  # s before and after an event in which hulls decide who is in a group: the time of the merge rule
CHANGES = frozenset(HEADLINE) | {kind for kind, counts_as in COUNTS_AS.items() if counts_as in HEADLINE}


def true_events(
    events: Iterable[GroupEvent], people: PersonRows, positions: Array | None, frames: Bools, step: int
) -> list[ComparableEvent]:
    """Returns the truth's events of known kinds that start in a frame f where frames[f] is true, in the order given.

    Known kinds are merge, split, cross, queue, enter, leave, form and dissolve. frames (length + 1,): bool by frame
    number. people: the R true people in frames. positions (R, 2): their x, y on the surface of comparison, in m or px;
    None if `GroupEvent.pos` is on it already. With positions, an event lies at the mean of its members at its start
    (nan if none is present).

    Parents are the groups of the members before the start, each in the last frame, of the `step` frames before it, in
    which the member is. Children are the groups at the start. A member alone or absent is a part of its own. If both
    are equal, form and dissolve take parents and children from the kind.
    Both are None if they are still equal, or if the kind is none of merge, split, form, dissolve. `emitted` is None.
    """
    lookup, group = RowLookup(people.rows), _group_by_row(people.group)

    def comparable(event: GroupEvent) -> ComparableEvent:
        before = _by_group(event.members, lambda m: group[lookup.last(m, event.start - 1, step - 1)])
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
    """True if the event's kind is scored, and frames[event.start] is true; False if the start is outside `frames`.

    Scored kinds are merge, split, cross, queue, enter, leave, form and dissolve. frames: bool by frame number.
    """
    known = event.kind in KINDS or event.kind in COUNTS_AS
    return known and 0 <= event.start < len(frames) and bool(frames[event.start])


def _group_by_row(group: Ints) -> list[int]:
    """Returns group (R,) as a list with -1 appended, so that row index -1 (no row) has group -1 (no group)."""
    return [*group.tolist(), -1]


def _by_group(members: Sequence[int], group: Callable[[int], int]) -> list[list[int]]:
    """Returns the members (person ids) as lists, one per group, in the order of the groups' first member.

    group(id): the member's group, -1 for none. A member without a group is a list of its own. No members give [].
    """
    parts: dict[tuple[int, int], list[int]] = {}
    for m in members:
        g = group(m)
        parts.setdefault((g, -1) if g >= 0 else (-1, m), []).append(m)
    return list(parts.values())


def _by_kind(
    event: GroupEvent, before: list[list[int]], after: list[list[int]]
) -> tuple[list[list[int]], list[list[int]]]:
    """Returns parents and children of an event, each a list of parts, a part being a list of member ids.

    before, after: parts by the group labels before and after the event. If they differ they are returned. If they are
    equal (data whose labels never change), `form` turns all members from single people into one group, and `dissolve`
    does the reverse. Other kinds keep `before` and `after`.
    """
    if sorted(before) != sorted(after):
        return before, after
    one, alone = [list(event.members)], [[m] for m in event.members]
    return {"form": (alone, one), "dissolve": (one, alone)}.get(event.kind, (before, after))


def _mean_position(event: GroupEvent, lookup: RowLookup, positions: Array) -> tuple[float, float]:
    """Returns the mean x, y of the event's members who are present at its start; (nan, nan) if none is.

    positions (R, 2): of the rows that `lookup` finds; the result has their unit.
    """
    rows = [row for m in event.members if (row := lookup.nearest(m, event.start, 0)) >= 0]
    if not rows:
        return float("nan"), float("nan")
    x, y = positions[rows].mean(axis=0)
    return float(x), float(y)


def tracked_events(
    tracks: Sequence[Tracks], people: PersonRows, mapping: Ints, true: FrameRows, frames: Bools, reach: int
) -> list[ComparableEvent]:
    """Returns a tracker's events with members, of known kinds, that start in a frame f where frames[f] is true.

    Known kinds are merge, split, cross, queue, enter, leave, form and dissolve. tracks: of the scored frames. people:
    the R tracked people in frames. mapping (R,): the row of `true` that each is mapped to, -1 none. true: rows of the
    true people. frames (length + 1,): bool by frame number. reach: number of frames.

    A member becomes the person it is mapped to at the event's start, or in the nearest frame within reach of it. A
    member that is never mapped there, or to a person already listed, is unmatched. Parents are the groups of the
    members in the frame before the report, children those in the frame of the report, each within reach if a member is
    absent. If both are equal, parents are those of the frame before the event's start. If both are still equal, form
    and dissolve take them from the kind. `emitted` is the frame of the `Tracks` that hold the event.
    """
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
    """Returns the true people that an event's members (track ids) are mapped to.

    known: true id of each mapped track id. Members without one, or mapped to the same person as another, count as
    unmatched.
    """
    people = frozenset(known[m] for m in members if m in known)
    return EventMembers(people, len(members) - len(people))


def events_of_hulls(
    tracks: Sequence[Tracks], groups: GroupRows, true: FrameRows, frames: Bools, span: int, without_members: bool
) -> list[ComparableEvent]:
    """Returns a tracker's events of known kinds that start in a frame f where frames[f] is true; `members` is None.

    Known kinds are merge, split, cross, queue, enter, leave, form and dissolve. without_members: if True, only events
    that name no members; else all. tracks: of the scored frames. groups: the tracker's groups, whose members are rows
    of `true` (from `people_inside`). true: rows of the true people. frames (length + 1,): bool by frame number. span:
    number of frames. `emitted` is the frame of the `Tracks` that hold the event.

    Parents are the people inside the hulls of the groups in `event.before`, children those inside the groups in
    `event.after`. Children are judged in `span` frames from the report on. Parents are judged in `span` frames before
    the event's start, or before the report if a parent group appears only at the start or later. A group counts a
    person who is inside it longer than inside other groups, and in more than half of its frames.
    """
    person = true.id[groups.member]

    def comparable(event: GroupEvent, reported: int) -> ComparableEvent:
        end = event.start if _last_appearance(groups.rows, event.before) < event.start else reported
        parents = _contained(groups, person, event.before, range(end - span, end))
        children = _contained(groups, person, event.after, range(reported, reported + span))
        return ComparableEvent(event.kind, event.start, reported, None, event.pos, parents, children)

    found = _reports(tracks, frames)
    return [comparable(event, reported) for event, reported in found if not (without_members and event.members)]


def _last_appearance(rows: FrameRows, ids: Sequence[int]) -> int:
    """Returns the frame number in which the last of these group ids appears for the first time; 0 if none has a row.

    rows: groups in frames, sorted by frame. Ids without a row are ignored.
    """
    frames = [rows.frame[rows.id == id] for id in ids]
    return max((int(own[0]) for own in frames if len(own)), default=0)


def _contained(groups: GroupRows, person: Ints, ids: Sequence[int], span: range) -> tuple[EventMembers, ...]:
    """Returns the people of each group id in `ids` during the frames `span`, one `EventMembers` per id, in order.

    groups: the tracker's groups in frames; person (K,): true id of each of their memberships; span: frame numbers, only
    its start and stop (excluded) count. A person belongs to the one group that contained the person in most frames (of
    equals the one that contained the fewest people, then the lowest id), and only if these are more than half of the
    frames in which the group was reported. One frame is not enough, because the hulls of people behind each other
    overlap in the image. A group without people gives an empty `EventMembers`.
    """
    rows, now = groups.rows, (groups.rows.frame >= span.start) & (groups.rows.frame < span.stop)
    reported = Counter(rows.id[now].tolist())
    inside = now[groups.of]
    pairs, times = np.unique(np.stack([person[inside], rows.id[groups.of[inside]]]), axis=1, return_counts=True)
    people = Counter(pairs[1].tolist())
    best: dict[int, tuple[int, int, int]] = {}  # person: (number of frames, minus the group's people, minus its id)
    for p, group, n in zip(*pairs.tolist(), times.tolist(), strict=True):
        best[p] = max(best.get(p, (0, 0, 0)), (n, -people[group], -group))
    return tuple(
        EventMembers(frozenset(p for p, (n, _, minus) in best.items() if -minus == id and 2 * n > reported[id]))
        for id in ids
    )


def _reports(tracks: Sequence[Tracks], frames: Bools) -> list[tuple[GroupEvent, int]]:
    """Returns pairs (event, frame number of the `Tracks` that hold it), whatever the event's `emitted` is.

    tracks: one tracker's; the pairs keep their order. Events of unknown kinds, or that start in a frame f where
    frames[f] is false or outside `frames`, are left out.
    """
    return [(event, t.index) for t in tracks for event in t.events if _counts(event, frames)]
