"""Merge, split, form, dissolve, enter and leave events of groups of tracked people: from changes of their groups.

Two sources: links that a grouping switched (`event_of_change`), or labels that a tracker gave (`LabelEvents`).
Changes that only correct what was believed are no events: who was not seen apart does not merge, and who was not seen
together, or is not apart, does not split (`TrackedMotion.onset`, `corrects`).
What a change is called follows from sim.truth.group_ids_and_changes, the same rule as in the truth. People are numbers,
such as ids of tracks; frames count from 0, in the returned events from 1.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from typing import Protocol

import numpy as np

from sim.truth.group_ids_and_changes import GroupChange, PersonSet, group_changes
from sim.truth.merge_split_events import connected
from sim.truth.merge_split_rules import HOLD_TIME, MERGE_DISTANCE, frames_of, separation, stretches
from sim.truth.motion_rows import frames_of_change
from sim.types import Array, Bools, GroupEvent, Ints

SEARCHED = 12.0  # s before the report in which people must have been seen to come together or to part.
REMEMBERED = 60.0  # s for which motion, and whoever is seen no more, is remembered at least.
ARRIVAL = 1.0  # s: who is there so soon after the first frame was there before it, and does not enter.
BRIDGED = 0.5  # s: gaps in a stretch that do not end it.
LOOK_BACK = 20  # Frames before an event's start in which its position is looked for.


class PastMotion(Protocol):
    """The motion of people up to now, such as a `MotionHistory`."""

    def window(self, people: Sequence[int], first: int, end: int) -> tuple[Array, Array, Ints]:
        """Returns positions, velocities (N, K, 2) and groups (N, K) of K people in the frames first … end - 1; nan and
        -1 where a person is absent."""

    def measured_count(self, people: Sequence[int], first: int, end: int) -> Ints:
        """Returns how many of some people are measured in each of the frames first … end - 1."""


@dataclass(frozen=True, slots=True, eq=False)
class TrackedMotion:
    """The motion of tracked people."""

    rows: PastMotion
    fps: float  # frames per second

    def onset(self, a: PersonSet, b: PersonSet, t: int, *, joins: bool) -> int | None:
        """Returns the frame in which two parts came together (joins True) or parted (False), as known in frame t. a, b:
        the parts, sets of people. Frames count from 0; only the 12 s before t are searched.

        It is None if the parts were not apart before they came together or are not near now, and if they were not
        together before they parted or are not apart now.
        """
        first = max(0, t + 1 - frames_of(SEARCHED, self.fps))
        pos, vel, _ = self.rows.window([*sorted(a), *sorted(b)], first, t + 1)
        found = separation(pos, vel, np.arange(len(a)), np.arange(len(a), len(a) + len(b)))
        there, apart = np.isfinite(found.distance), found.split_rule()
        # people more than 1.5 m apart may be in one group, too
        together = found.merge_rule() if joins else there & ~apart
        # while a part is hidden, what was seen last still holds
        seen = np.maximum.accumulate(np.where(there, np.arange(len(pos)), 0))
        near, *rules = (self._lasting(holds[seen]) for holds in (found.distance < MERGE_DISTANCE, apart, together))
        before, after = rules if joins else rules[::-1]
        if not before.any():
            return None
        begin = int(np.flatnonzero(before)[-1]) + 1
        held = np.flatnonzero(after[begin:])
        if len(held):
            return first + begin + int(held[0])
        # velocities are too rough to ask for the merge rule, too
        return t if joins and near[-1] else None

    def _lasting(self, holds: Bools) -> Bools:
        """Returns `holds` (N,) with gaps up to 0.5 s filled, without stretches shorter than 2 s that end earlier."""
        frame, gap = np.flatnonzero(holds), frames_of(BRIDGED, self.fps)
        out = np.zeros_like(holds)
        for _, low, high in zip(*stretches(np.zeros_like(frame), frame, 1, gap + 1), strict=True):
            out[low : high + 1] = high + 1 - low >= frames_of(HOLD_TIME, self.fps) or high + 1 + gap >= len(holds)
        return out


@dataclass(frozen=True, slots=True, eq=False)
class Parts:
    """The parts that a merge or enter joined, or that a split left: groups and people alone, as sets of people."""

    sets: Sequence[PersonSet]
    since: int  # frame (from 0) from which on a person of each has been present
    gone: PersonSet = frozenset()  # people of a divided group who are present no more


def event_of_change(
    change: GroupChange, t: int, parts: Parts, motion: TrackedMotion, *, late: bool = False, met: bool = True
) -> GroupEvent | None:
    """Returns the event of a change that became known in frame t.

    It is None for a merge or split that was not seen (`TrackedMotion.onset`), and for an enter in the first second.
    late: True if groups are known later than their people, so that people alone who form one and were never apart
    enter. met: False if people who come together were never apart by all evidence.
    """
    # a group leaves when its last two people were measured, or its last one: it may be predicted for longer
    if change.kind == "leave":
        first = max(0, t + 1 - frames_of(REMEMBERED, motion.fps))
        seen = motion.rows.measured_count(change.members, first, t + 1)
        start = first + int(np.flatnonzero(seen >= min(seen.max(), 2))[-1])
    elif change.kind != "enter":
        joins = change.kind not in ("split", "dissolve")
        # whoever held a group together may be gone
        pairs = list(combinations(parts.sets, 2))
        looked = met or not joins
        onsets = [motion.onset(a, b | parts.gone, t, joins=joins) if looked else None for a, b in pairs]
        unchanged = [pair for pair, onset in zip(pairs, onsets, strict=True) if onset is None]
        if len(set(connected(parts.sets, unchanged))) > 1:
            start = min(onset for onset in onsets if onset is not None)
        elif late and change.kind == "form" and parts.since > t - frames_of(SEARCHED, motion.fps):
            change = replace(change, kind="enter", before=())
        else:
            return None
    if change.kind == "enter":
        start = parts.since
        if start <= frames_of(ARRIVAL, motion.fps):
            return None
    end = start if change.kind in ("enter", "leave") else t
    return _event(change, start, end, t, motion.rows)


def corrects(change: GroupChange, parted: Mapping[PersonSet, bool]) -> bool:
    """Returns True if a group falls apart whose people were, by all evidence, never together: it is no event. parted:
    pairs that are in one group no more, True if the evidence, summed over the time in which they were, speaks for
    them."""
    sure = [together for pair, together in parted.items() if pair <= {*change.members}]
    return change.kind in ("split", "dissolve") and bool(sure) and not any(sure)


def were_apart(change: GroupChange, joined: Mapping[PersonSet, bool]) -> bool:
    """Returns False if people come into one group who were, by all evidence, never apart. joined: pairs that are in one
    group from now on, True if the evidence before, summed over some time, speaks against them."""
    sure = [apart for pair, apart in joined.items() if pair <= {*change.members}]
    return not sure or any(sure)


class LabelEvents:
    """The events that follow from changes of the groups that a tracker names. State: groups, by id, and people of the
    last frame; end, number of frames."""

    def __init__(self) -> None:
        self.groups, self.people, self.end = dict[int, PersonSet](), frozenset[int](), 0

    def add(self, frame: Ints, id: Ints, group: Ints, motion: PastMotion, end: int) -> list[GroupEvent]:
        """Adds the frames up to `end`, and returns the events in them, sorted by time. frame, id, group (R,): one row
        per person of known position and frame, sorted by frame, then id. motion: of these frames, too."""
        events, first = list[GroupEvent](), self.end
        last = np.array(sorted(self.people), np.int64)
        group_of = {p: g for g, people in self.groups.items() for p in people}
        label = np.array([group_of.get(p, -1) for p in last.tolist()], np.int64)
        column = np.unique(np.append(last, id), return_inverse=True)[1]
        # the frame before counts as frame 0 here
        rows = np.append(np.zeros_like(last), frame - first + 1), column, np.append(label, group)
        for t in [first - 1 + k for k in frames_of_change(*rows, end - first + 1)]:
            now = slice(*np.searchsorted(frame, (t, t + 1)))
            new, there = _members(id[now], group[now]), frozenset(id[now].tolist())
            changes = group_changes(self.groups, new, self.people, there) if t else []
            for c in changes:
                begin = t - (c.kind == "leave")
                events.append(_event(c, begin, begin, t, motion))
            self.groups, self.people = new, there
        self.end = end
        return events


def _event(change: GroupChange, start: int, end: int, t: int, motion: PastMotion) -> GroupEvent:
    """Returns the event of a change, frames from 1; start, end, t count from 0."""
    first = max(start - LOOK_BACK, 0)
    places = motion.window(change.members, first, t + 1)[0]
    known = np.flatnonzero(np.isfinite(places[..., 0]).sum(axis=1))
    x = y = float("nan")
    if len(known):
        # at the start itself nobody may be seen
        x, y = np.nanmean(places[known[np.abs(known - (start - first)).argmin()]], axis=0)
    place = float(x), float(y)
    return GroupEvent(change.kind, start + 1, end + 1, t + 1, change.before, change.after, change.members, place)


def _members(id: Ints, group: Ints) -> dict[int, PersonSet]:
    found: dict[int, set[int]] = {}
    for p, g in zip(id.tolist(), group.tolist(), strict=True):
        found.setdefault(g, set()).add(p)
    return {g: frozenset(people) for g, people in found.items() if g >= 0 and len(people) > 1}
