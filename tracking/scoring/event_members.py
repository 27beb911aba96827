"""Events of the truth and of a tracker with their members, parents and children as true people: `ComparableEvent`.

`true_events` converts events of the truth, `tracked_events` those that a tracker reports with members,
`events_of_hulls` events judged by who is inside the hulls of groups, for trackers that name no members. An event
belongs to the frame in which it starts.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from sim.types import Array, Bools, GroupEvent, Ints, Tracks
from tracking.scoring.group_rows import GroupRows
from tracking.scoring.people import PersonRows
from tracking.scoring.rows import FrameRows, RowLookup

KINDS = ("merge", "split", "cross", "queue", "enter", "leave")
COUNTS_AS = {"form": "merge", "dissolve": "split"}
HEADLINE = ("merge", "split")
HULL_TIME = 2.0  # s before and after an event in which hulls decide who is in a group: the time of the merge rule
CHANGES = frozenset(HEADLINE) | {kind for kind, counts_as in COUNTS_AS.items() if counts_as in HEADLINE}


@dataclass(frozen=True, slots=True)
class EventMembers:
    """The members of an event, or of one group before or after it, as true people."""

    people: frozenset[int]  # ids of true people
    unmatched: int = 0  # number of further members that are mapped to no true person, or to one already in `people`

    def jaccard(self, other: EventMembers) -> float:
        """Returns the number of common people / the number of all members of both, 0 if both are empty. Each unmatched
        member counts in the denominator only."""
        common = len(self.people & other.people)
        whole = len(self.people | other.people) + self.unmatched + other.unmatched
        return common / whole if whole else 0.0


@dataclass(frozen=True, slots=True)
class ComparableEvent:
    """An event whose members are true people, so that a true and a tracker's event can be compared."""

    kind: str  # "merge", "split", "cross", "queue", "enter", "leave", "form" or "dissolve"
    start: int  # frame number from 1 in which the event begins
    emitted: int | None  # frame number of the `Tracks` that report it; None in the truth
    members: EventMembers | None  # the people concerned; None if the tracker names no people
    pos: tuple[float, float]  # x, y, in m on the ground or px in the image; nan unknown
    # parents, children: one `EventMembers` per group (or single person) before and after the event; None if unknown
    parents: tuple[EventMembers, ...] | None = None
    children: tuple[EventMembers, ...] | None = None

    @property
    def has_lineage(self) -> bool:
        """True if parents and children are known."""
        return self.parents is not None and self.children is not None


def true_events(
    events: Iterable[GroupEvent], people: PersonRows, positions: Array | None, frames: Bools, step: int
) -> list[ComparableEvent]:
    """Returns the truth's events of known kinds that start in a frame f where frames[f] is true.

    positions (R, 2): of the true people on the surface where events are compared; None uses `GroupEvent.pos`. The
    parents divide the members by their groups before the start: each member's group in the last of the `step` frames
    before the start in which the member is there. The children divide them by their groups at the start. A member who
    is alone or absent is a part alone.
    """
    lookup, parts_of = RowLookup(people.rows), _parts_of(people)

    def comparable(event: GroupEvent) -> ComparableEvent:
        before, after = parts_of(event, event.start, step - 1, 0)
        pos = event.pos if positions is None else _mean_position(event, lookup, positions)
        members = EventMembers(frozenset(event.members))
        if event.kind not in CHANGES or sorted(before) == sorted(after):
            return ComparableEvent(event.kind, event.start, None, members, pos)
        parents, children = (tuple(EventMembers(frozenset(part)) for part in parts) for parts in (before, after))
        return ComparableEvent(event.kind, event.start, None, members, pos, parents, children)

    return [comparable(event) for event in events if _counts(event, frames)]


def _counts(event: GroupEvent, frames: Bools) -> bool:
    known = event.kind in KINDS or event.kind in COUNTS_AS
    return known and 0 <= event.start < len(frames) and bool(frames[event.start])


def _parts_of(people: PersonRows) -> Callable[[GroupEvent, int, int, int], tuple[list[list[int]], list[list[int]]]]:
    """Returns a function that divides the members of an event by their groups before and after a report."""
    lookup, group = RowLookup(people.rows), [*people.group.tolist(), -1]

    def parts_of(event: GroupEvent, reported: int, back: int, ahead: int) -> tuple[list[list[int]], list[list[int]]]:
        def until(frame: int) -> list[list[int]]:
            return _by_group(event.members, lambda m: group[lookup.nearest(m, frame, back, 0)])

        before = until(reported - 1)
        after = _by_group(event.members, lambda m: group[lookup.nearest(m, reported, 0, ahead)])
        if sorted(before) == sorted(after):
            before = until(event.start - 1)
        if sorted(before) != sorted(after):
            return before, after
        # data whose labels never change: a form joins people alone, a dissolve leaves them alone
        one, alone = [list(event.members)], [[m] for m in event.members]
        return {"form": (alone, one), "dissolve": (one, alone)}.get(event.kind, (before, after))

    return parts_of


def _by_group(members: Sequence[int], group: Callable[[int], int]) -> list[list[int]]:
    """Returns the members as lists, one per group in order of first members; -1 is no group."""
    parts: dict[tuple[int, int], list[int]] = {}
    for m in members:
        g = group(m)
        parts.setdefault((g, -1) if g >= 0 else (-1, m), []).append(m)
    return list(parts.values())


def _mean_position(event: GroupEvent, lookup: RowLookup, positions: Array) -> tuple[float, float]:
    rows = [row for m in event.members if (row := lookup.nearest(m, event.start, 0, 0)) >= 0]
    if not rows:
        return float("nan"), float("nan")
    x, y = positions[rows].mean(axis=0)
    return float(x), float(y)


def tracked_events(
    tracks: Sequence[Tracks], people: PersonRows, mapping: Ints, true: FrameRows, frames: Bools, reach: int
) -> list[ComparableEvent]:
    """Returns those of a tracker's events that name members and start in a frame f where frames[f] is true.

    mapping (R,): the row of `true` that each row of `people` (the tracked people) is mapped to, -1 none. A member
    becomes the true person that it is mapped to in the frame nearest to the start, at most `reach` frames away. Parents
    divide the members by their groups before the report, or before the start if both divisions are the same; children
    divide them by their groups at the report.
    """
    mapped, parts_of = RowLookup(people.rows, mapping >= 0), _parts_of(people)
    person = np.append(true.id, -1)[mapping].tolist()

    def comparable(event: GroupEvent, reported: int) -> ComparableEvent:
        before, after = parts_of(event, reported, reach, reach)
        rows = {m: mapped.nearest(m, event.start, reach, reach) for m in event.members}
        known = {m: person[row] for m, row in rows.items() if row >= 0}
        parents, children = (tuple(_true_members(p, known) for p in parts) for parts in (before, after))
        members = _true_members(event.members, known)
        return ComparableEvent(event.kind, event.start, reported, members, event.pos, parents, children)

    return [comparable(event, reported) for event, reported in _reports(tracks, frames) if event.members]


def _true_members(members: Sequence[int], known: Mapping[int, int]) -> EventMembers:
    people = frozenset(known[m] for m in members if m in known)
    return EventMembers(people, len(members) - len(people))


def events_of_hulls(
    tracks: Sequence[Tracks], groups: GroupRows, true: FrameRows, frames: Bools, span: int, without_members: bool
) -> list[ComparableEvent]:
    """Returns a tracker's events with parents and children by who is inside the hulls of its groups.

    `members` of the results are None. Members of `groups` are row indices of `true`. Children are judged in `span`
    frames from the report on. Parents are judged in `span` frames before the start, or before the report if a parent
    group appears only at the start or later. without_members: if True, events that name members are left out.
    """
    person = true.id[groups.member]

    def comparable(event: GroupEvent, reported: int) -> ComparableEvent:
        end = event.start if _last_appearance(groups.rows, event.before) < event.start else reported
        parents = _contained(groups, person, event.before, range(end - span, end))
        children = _contained(groups, person, event.after, range(reported, reported + span))
        return ComparableEvent(event.kind, event.start, reported, None, event.pos, parents, children)

    return [comparable(*report) for report in _reports(tracks, frames) if not (without_members and report[0].members)]


def _last_appearance(rows: FrameRows, ids: Sequence[int]) -> int:
    """Returns the frame in which the last of these group ids appears for the first time; 0 if none has a row."""
    frames = [rows.frame[rows.id == id] for id in ids]
    return max((int(own[0]) for own in frames if len(own)), default=0)


def _contained(groups: GroupRows, person: Ints, ids: Sequence[int], span: range) -> tuple[EventMembers, ...]:
    """Returns the people of each group id in `ids` in the frames `span`; person (K,): of each membership."""
    # One frame is not enough: the hulls of people behind each other overlap in the image. A person belongs to the group
    # that contained the person in most frames, of equals to the smaller one, then to the lowest id.
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
    return [(event, t.index) for t in tracks for event in t.events if _counts(event, frames)]
