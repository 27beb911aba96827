"""Merge, split, form, dissolve, enter and leave events of groups of tracked people: from changes of their groups.

Two sources: links that the baseline rule switched (`event_of_change`, exact onsets), or labels that a tracker gave
(`events_of_labels`). What a change is called follows from sim.truth.identity.lineage, the same rule as in the truth.
People are columns of arrays, frames count from 0; in the returned events people are columns + 1, frames count from 1.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from sim.truth.identity import GroupChange, PersonSet, lineage
from sim.types import Array, GroupEvent, Ints

ABSENT = -2
"""Label of a person who is absent; -1 is a person alone."""
LOOK_BACK = 20
"""Frames before an event's start in which its position is looked for."""

LinkSwitch = tuple[int, int, bool, int]
"""A switched link: its people (columns a, b), True if switched on, first frame of the stretch that caused it."""


def event_of_change(
    change: GroupChange, t: int, switched: Iterable[LinkSwitch], pos: Array, arrival: int
) -> GroupEvent | None:
    """Return the event of one change of groups that became known in frame t (from 0), or None.

    change: of a group; its members are columns. switched: the links switched in frame t, as (a, b, True if set, first
    frame of the cause). pos (T, P, 2): x, y in m by frame and column, nan where absent. arrival: frames. In the event
    people are columns + 1, frames count from 1, the position is in m.

    `start` is the first onset among the switches that caused the change: links set (merge, form, enter) or removed
    (split, dissolve, leave) between two of its people; t if there is none. For a leave it is the last frame in which
    two of its people were seen, or one if there is none. `end` equals `start` for enter and leave, else t. Returns
    None for an enter that starts in frame `arrival` (from 0) or before: that group was there from the beginning. Raises
    ValueError if no member was seen from 20 frames before the start to t.

    Kinds: a merge joins groups, or groups and people alone; a split is its reverse. A form joins people who were all
    alone; a dissolve leaves all alone. At enter and leave a whole group comes or goes, at most one of it excepted, who
    is alone before or after.
    """
    start = onset_of_change(change, t, switched)
    if change.kind == "leave":
        seen = np.isfinite(pos[: t + 1, change.members, 0]).sum(axis=1)
        start = int(np.flatnonzero(seen >= min(seen.max(), 2))[-1])
    if change.kind == "enter" and start <= arrival:
        return None
    end = start if change.kind in ("enter", "leave") else t
    return _event(change, start, end, t, pos)


def onset_of_change(change: GroupChange, t: int, switched: Iterable[LinkSwitch]) -> int:
    """Return the first onset among the switches that caused the change of groups in frame t; t if there is none.

    They are the links set (merge, form, enter) or removed (split, dissolve, leave) between two of its people. switched:
    the links switched in frame t, as (a, b, True if set, first frame of the cause).
    """
    people = set(change.members)
    joins = change.kind in ("merge", "form", "enter")
    return min((since for a, b, on, since in switched if on == joins and a in people and b in people), default=t)


def events_of_labels(group: Ints, pos: Array) -> list[GroupEvent]:
    """Return the membership events (merge, split, form, dissolve, enter, leave) in a tracker's group labels, by time.

    group (T, P): label by frame and column, -1 for a person alone. pos (T, P, 2): x, y in m, nan where a person is
    absent. T is at least 1 (else IndexError). A label that only one person carries in a frame counts as alone. Groups
    of the first frame have no event. `start`, `end` and `emitted` are the frame of the change; a leave starts and ends
    in the frame before it. In the events people are columns + 1, frames count from 1.

    Kinds: a merge joins groups, or groups and people alone; a split is its reverse. A form joins people who were all
    alone; a dissolve leaves all alone. At enter and leave a whole group comes or goes, at most one of it excepted, who
    is alone before or after.
    """
    there = np.isfinite(pos).all(axis=2)
    state = np.where(there, group, ABSENT)
    changed = np.flatnonzero((np.diff(state, axis=0) != 0).any(axis=1)) + 1
    events, old, before = [], _members(state[0]), _present(state[0])
    for t in changed.tolist():
        new, now = _members(state[t]), _present(state[t])
        changes = lineage(old, new, before, now)
        events += [_event(c, t - (c.kind == "leave"), t - (c.kind == "leave"), t, pos) for c in changes]
        old, before = new, now
    return events


def _event(change: GroupChange, start: int, end: int, t: int, pos: Array) -> GroupEvent:
    """Returns the event of a change, with people as columns + 1 and frames from 1; start, end, t (emitted) count from
    0.

    Its position is the mean of its people, x, y in m, in the frame nearest to `start` in which one of them was seen.
    Searched are the frames from 20 before `start` to t; one of them must show a member (else ValueError). pos (T, P,
    2): m, nan where absent.
    """
    first = max(start - LOOK_BACK, 0)
    places = pos[first : t + 1, change.members]
    known = np.flatnonzero(np.isfinite(places[..., 0]).sum(axis=1))
    nearest = known[np.abs(known - (start - first)).argmin()]
    x, y = np.nanmean(places[nearest], axis=0)
    members = tuple(p + 1 for p in change.members)
    return GroupEvent(
        change.kind, start + 1, end + 1, t + 1, change.before, change.after, members, (float(x), float(y))
    )


def _members(state: Ints) -> dict[int, PersonSet]:
    """Returns a dict from label to the people (a frozenset of columns, from 0) of each group of two or more, in one
    frame.

    state (P,): label of each person. Labels below 0 (-1 alone, -2 absent) are no groups.
    """
    found: dict[int, set[int]] = {}
    for p in np.flatnonzero(state >= 0).tolist():
        found.setdefault(int(state[p]), set()).add(p)
    return {g: frozenset(people) for g, people in found.items() if len(people) > 1}


def _present(state: Ints) -> PersonSet:
    return frozenset(np.flatnonzero(state != ABSENT).tolist())
