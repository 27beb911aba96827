"""Merge, split, form, dissolve, enter and leave events of groups of tracked people: from changes of their groups.

Two sources: links that a grouping switched (`event_of_change`), or labels that a tracker gave (`events_of_labels`).
Changes that only correct what was believed are no events: `corrects`, and merges that become known late.
What a change is called follows from sim.truth.group_ids_and_changes, the same rule as in the truth. People are columns
of arrays, frames count from 0; in the returned events people are columns + 1, frames count from 1.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from sim.truth.group_ids_and_changes import GroupChange, PersonSet, group_changes
from sim.truth.merge_split_rules import HOLD_TIME, frames_of, separation, stretches
from sim.truth.motion_rows import MotionRows, frames_of_change
from sim.types import Bools, GroupEvent, Ints

# A switched link: its people a, b, True if switched on, first frame of the stretch that caused it.
LinkSwitch = tuple[int, int, bool, int]
SEARCHED = 20.0  # s before the report in which the onset of a change is looked for.
LAG = 6.0  # s after its onset in which a merge must become known: standing on near each other tells little new.
BRIDGED = 0.5  # s: gaps in a stretch that do not end it.
LOOK_BACK = 20  # Frames before an event's start in which its position is looked for.


@dataclass(frozen=True, slots=True, eq=False)
class TrackedMotion:
    """The motion of tracked people."""

    rows: MotionRows
    fps: float  # frames per second

    def onset(self, a: PersonSet, b: PersonSet, t: int, *, joins: bool) -> int:
        """Returns the frame in which two parts came together (joins True) or parted (False), as known in frame t. a, b:
        the parts, sets of columns. Frames count from 0; only the 20 s before t are searched."""
        first = max(0, t + 1 - frames_of(SEARCHED, self.fps))
        pos, vel, _ = self.rows.window([*sorted(a), *sorted(b)], first, t + 1)
        found = separation(pos, vel, *np.split(np.arange(len(a) + len(b)), [len(a)]))
        rules = [self._lasting(holds) for holds in (found.split_rule(), found.merge_rule())]
        before, after = rules if joins else rules[::-1]
        begin = int(np.flatnonzero(before)[-1]) + 1 if before.any() else 0
        held = np.flatnonzero(after[begin:])
        return first + begin + int(held[0]) if len(held) else t

    def _lasting(self, holds: Bools) -> Bools:
        """Returns `holds` (N,) with gaps up to 0.5 s filled, without stretches shorter than 2 s that end earlier."""
        frame, gap = np.flatnonzero(holds), frames_of(BRIDGED, self.fps)
        out = np.zeros_like(holds)
        for _, low, high in zip(*stretches(np.zeros_like(frame), frame, 1, gap + 1), strict=True):
            out[low : high + 1] = high + 1 - low >= frames_of(HOLD_TIME, self.fps) or high + 1 + gap >= len(holds)
        return out


@dataclass(frozen=True, slots=True, eq=False)
class Parts:
    """The parts that a merge or enter joined, or that a split left: groups and people alone, as sets of columns."""

    sets: Sequence[PersonSet]
    since: int  # frame (from 0) from which on a person of each has been present


def event_of_change(
    change: GroupChange, t: int, parts: Parts, motion: TrackedMotion, arrival: int
) -> GroupEvent | None:
    """Returns the event of a change that became known in frame t.

    It is None for a merge or form within `arrival` frames of the first frame with all parts, and for an enter as soon
    after the first frame of all: these people were together from the start. It is None also for a merge or form that
    became known more than 6 s after its onset.
    """
    # a group leaves when its last two people were seen, or its last one
    if change.kind == "leave":
        seen = motion.rows.count(change.members, t + 1)
        start = int(np.flatnonzero(seen >= min(seen.max(), 2))[-1])
    else:
        joins = change.kind not in ("split", "dissolve")
        start = min((motion.onset(a, b, t, joins=joins) for a, b in combinations(parts.sets, 2)), default=t)
    # people who were together when they were first seen neither met nor came: no event
    joined = max(parts.since + arrival, t - 1 - frames_of(LAG, motion.fps))
    known = {"enter": arrival, "merge": joined, "form": joined}
    if start <= known.get(change.kind, -1):
        return None
    end = start if change.kind in ("enter", "leave") else t
    return _event(change, start, end, t, motion.rows)


def corrects(change: GroupChange, parted: Mapping[PersonSet, bool]) -> bool:
    """Returns True if a group falls apart whose people were, by all evidence, never together: it is no event. parted:
    pairs that are in one group no more, True if the evidence, summed over the time in which they were, speaks for
    them."""
    sure = [together for pair, together in parted.items() if pair <= {*change.members}]
    return change.kind in ("split", "dissolve") and bool(sure) and not any(sure)


def events_of_labels(motion: MotionRows) -> list[GroupEvent]:
    """Returns the events that follow from changes of the groups of people, sorted by time."""
    order = np.lexsort((motion.column, motion.frame))
    frame, column, group = motion.frame[order], motion.column[order], motion.group[order]
    events, old, before = [], dict[int, PersonSet](), frozenset[int]()
    for t in [0, *frames_of_change(frame, column, group, motion.length)]:
        rows = slice(*np.searchsorted(frame, (t, t + 1)))
        new, now = _members(column[rows], group[rows]), frozenset(column[rows].tolist())
        changes = group_changes(old, new, before, now) if t else []
        events += [_event(c, t - (c.kind == "leave"), t - (c.kind == "leave"), t, motion) for c in changes]
        old, before = new, now
    return events


def _event(change: GroupChange, start: int, end: int, t: int, motion: MotionRows) -> GroupEvent:
    """Returns the event of a change, people as columns + 1, frames from 1; start, end, t count from 0."""
    first = max(start - LOOK_BACK, 0)
    places = motion.window(change.members, first, t + 1)[0]
    known = np.flatnonzero(np.isfinite(places[..., 0]).sum(axis=1))
    # at the start itself nobody may be seen
    nearest = known[np.abs(known - (start - first)).argmin()]
    x, y = np.nanmean(places[nearest], axis=0)
    members = tuple(p + 1 for p in change.members)
    return GroupEvent(
        change.kind, start + 1, end + 1, t + 1, change.before, change.after, members, (float(x), float(y))
    )


def _members(column: Ints, group: Ints) -> dict[int, PersonSet]:
    found: dict[int, set[int]] = {}
    for p, g in zip(column.tolist(), group.tolist(), strict=True):
        found.setdefault(g, set()).add(p)
    return {g: frozenset(people) for g, people in found.items() if g >= 0 and len(people) > 1}
