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
    """Return the event of a change of groups that became known in frame t, caused by the links switched in that frame.

    pos (T, P, 2) in m, nan where absent. `start` is the first onset among the links switched between the change's
    people, or t if there is none; of a leave it is the last frame in which two of them were seen. `end` equals
    `start` for enter and leave, else t.
    Returns None for an enter that starts in the first `arrival` frames: that group was there from the beginning.
    """
    people = set(change.members)
    joins = change.kind in ("merge", "form", "enter")
    onsets = [since for a, b, on, since in switched if on == joins and a in people and b in people]
    start = min(onsets, default=t)
    if change.kind == "leave":
        seen = np.isfinite(pos[: t + 1, change.members, 0]).sum(axis=1)
        start = int(np.flatnonzero(seen > 1)[-1])
    if change.kind == "enter" and start <= arrival:
        return None
    end = start if change.kind in ("enter", "leave") else t
    return _event(change, start, end, t, pos)


def events_of_labels(group: Ints, pos: Array) -> list[GroupEvent]:
    """Return the membership events in group labels (T, P) that a tracker gave; -1 is a person alone.

    pos (T, P, 2) in m, nan where a person is absent. A label that only one person carries counts as alone. `start`,
    `end` and `emitted` are the frame of the change; a leave starts and ends in the frame before it.
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
    """The event emitted in frame t. Its position is the mean of its people in the frame nearest to `start`."""
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
    """The people of each group of two or more in one frame's labels (P,)."""
    found: dict[int, set[int]] = {}
    for p in np.flatnonzero(state >= 0).tolist():
        found.setdefault(int(state[p]), set()).add(p)
    return {g: frozenset(people) for g, people in found.items() if len(people) > 1}


def _present(state: Ints) -> PersonSet:
    return frozenset(np.flatnonzero(state != ABSENT).tolist())
