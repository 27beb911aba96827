"""Makes cross events: two groups that pass through each other, or closely round each other, and stay the same groups.

First it finds encounters of groups, stretches in which two hulls are within 1.0 m (CROSS_GAP); a hull is the convex
outline of discs round the members. Then it follows the members of both groups before, during and after each encounter.
Both come from positions, velocities and group ids, for truth and trackers alike. The id of a person is the column + 1;
frames of events count from 1.
"""

from __future__ import annotations

from collections.abc import Sequence, Set
from dataclasses import replace
from typing import Protocol

import numpy as np

from sim.elementary import atan2, dot, length
from sim.geometry.polygons import FOOTPRINT_RADIUS, footprint_hulls, gap_pairs, pack
from sim.truth.group_hulls import member_rows
from sim.truth.merge_split_rules import close_pairs, frames_of, mean_of_present, stretches
from sim.truth.motion_rows import MotionRows
from sim.types import Array, GroupEvent, Ints

CROSS_GAP = 1.0  # m between hulls
BRIDGE_TIME = 0.5  # s for which hulls may be further apart within one encounter
CROSS_VELOCITY = 0.6  # m/s: least difference of the mean velocities over the encounter
SAME_BEFORE = 2.0  # s before and after the encounter in which the members stay the same


class Moments(Protocol):
    """The motion of people by number, as `MotionRows`."""

    def window(self, columns: Sequence[int], first: int, end: int) -> tuple[Array, Array, Ints]:
        """Returns positions, velocities (N, K, 2) and groups (N, K) of K people in the frames first … end - 1; nan and
        -1 where a person is absent."""


def crossings(motion: MotionRows, fps: float) -> list[GroupEvent]:
    """Returns a cross event for each crossing of two groups of two or more people, in order of time.

    An encounter is a stretch of time in which two groups' hulls are within 1.0 m; breaks of up to 0.5 s are ignored. It
    is a crossing if three conditions hold. The mean relative velocity is at least CROSS_VELOCITY (0.6 m/s). The groups
    change sides. From 2 s before to 2 s after the encounter both keep their members, except for members who leave the
    scene.
    """
    finder, rows = CrossingFinder(fps), (motion.frame, motion.column, motion.pos, motion.group)
    found = [*finder.add(*rows, motion, motion.length), *finder.rest(motion)]
    found = [replace(e, members=tuple(p + 1 for p in e.members)) for e in found]
    return sorted(found, key=lambda e: (e.start, e.end, e.before))


class CrossingFinder:
    """Finds crossings in frames that are added one after another; it does not matter how many at once.

    State: end, number of frames so far; people, who was ever in each group, by id of the group; open, first and last
    frame of the encounters that may go on or are not known yet, by the ids of both groups, in order of time.
    """

    def __init__(self, fps: float) -> None:
        self.margin, self.bridge = frames_of(SAME_BEFORE, fps), frames_of(BRIDGE_TIME, fps)
        self.end, self.people = 0, dict[int, set[int]]()
        self.open: dict[tuple[int, int], list[list[int]]] = {}

    def add(self, frame: Ints, id: Ints, pos: Array, group: Ints, motion: Moments, end: int) -> list[GroupEvent]:
        """Adds the frames up to `end`, and returns the crossings that are known now, in order of time; `emitted` is
        None.

        frame, from 0, id, group (R,), pos (R, 2), m: one row per person and frame. motion: of these frames and of those
        before, back to `first`.
        """
        grouped = np.flatnonzero((group >= 0) & np.isfinite(pos).all(axis=1))
        frame, id, pos, group = frame[grouped], id[grouped], pos[grouped], group[grouped]
        for name, person in np.unique(np.column_stack([group, id]), axis=0).tolist():
            self.people.setdefault(name, set()).add(person)
        for first, last, a, b in encounters(frame, id, pos, group, self.bridge):
            known = self.open.setdefault((a, b), [])
            if known and first - known[-1][1] <= self.bridge:
                known[-1][1] = last
            else:
                known.append([first, last])
        self.end = end
        return self._crossed(motion, end)

    def rest(self, motion: Moments) -> list[GroupEvent]:
        """Returns the crossings that are not known yet when the recording ends."""
        return self._crossed(motion, self.end + self.margin + 1)

    @property
    def first(self) -> int:
        """The first frame whose motion is needed still."""
        begun = [met[0][0] for met in self.open.values()]
        return max(0, min([self.end, *begun]) - self.margin - 1)

    def forget(self, groups: Set[int]) -> None:
        """Forgets the people of all groups but these and those that meet."""
        kept = groups | {g for pair in self.open for g in pair}
        self.people = {g: people for g, people in self.people.items() if g in kept}

    def _crossed(self, motion: Moments, end: int) -> list[GroupEvent]:
        """Removes the encounters that are known before frame `end`, and returns those that are crossings."""
        found = []
        for (a, b), met in list(self.open.items()):
            over = [k for k in met if k[1] + self.margin < end]
            self.open[a, b] = met[len(over) :]
            if not self.open[a, b]:
                del self.open[a, b]
            found += [(first, last, a, b) for first, last in over]
        events = (
            _crossed(motion, sorted(self.people[a] | self.people[b]), first, last, a, b, self.margin, self.end)
            for first, last, a, b in sorted(found)
        )
        return [event for event in events if event is not None]


def encounters(frame: Ints, id: Ints, pos: Array, group: Ints, bridge: int) -> list[tuple[int, int, int, int]]:
    """Returns (first frame, last frame, id a, id b) of each encounter of two groups; frames from 0, a < b, sorted.

    frame, id, group (R,), pos (R, 2), m: one row per person and frame. bridge: longest step from one frame of an
    encounter to the next.
    """
    rows, start = member_rows(frame, id, group)
    t = frame[rows][start]
    if not (t[1:] == t[:-1]).any():
        return []
    names, name = np.unique(group[rows][start], return_inverse=True)  # ids may be too large for their products
    i, j = _within_reach(t, pos[rows], start)
    pair, when = name[i] * len(names) + name[j], t[i]  # sorted by group within a frame: name[i] < name[j]
    order = np.lexsort((when, pair))
    pair, first, last = stretches(pair[order], when[order], 1, bridge)
    ids = (names[k] for k in divmod(pair, len(names)))
    return sorted(zip(*(x.tolist() for x in (first, last, *ids)), strict=True))


def _within_reach(t: Ints, places: Array, start: Ints) -> tuple[Ints, Ints]:
    """Returns the pairs (i, j), i < j, of groups of one frame whose hulls are within CROSS_GAP, (K,) each.

    t (G,): frames. places (N, 2) m: of the members of one group after the other. start (G,): where each group begins.
    """
    count = np.diff(np.append(start, len(places)))
    middle = np.add.reduceat(places, start) / count[:, None]
    radius = np.maximum.reduceat(length(places - np.repeat(middle, count, axis=0)), start) + FOOTPRINT_RADIUS
    i, j = close_pairs(t, middle, CROSS_GAP + 2 * float(radius.max()))
    near = length(middle[i] - middle[j]) <= CROSS_GAP + radius[i] + radius[j]
    i, j = i[near], j[near]
    group, place = np.unique(np.concatenate([i, j]), return_inverse=True)
    rows = np.isin(np.repeat(np.arange(len(count)), count), group)
    hulls = pack(footprint_hulls(places[rows], count[group]))
    close = gap_pairs(hulls, hulls, *np.split(place, 2)) <= CROSS_GAP
    return i[close], j[close]


def _crossed(
    motion: Moments, people: Sequence[int], first: int, last: int, a: int, b: int, margin: int, end: int
) -> GroupEvent | None:
    """Returns the event of one encounter of groups a and b, from frame `first` to `last` (from 0); None: no crossing.

    people: all who are ever in group a or b. margin: frames of SAME_BEFORE. end: frames so far.
    """
    begin = max(first - margin, 0)
    pos, vel, group = motion.window(people, begin, min(last + margin + 1, end))
    members = [np.flatnonzero(group[first - begin] == name) for name in (a, b)]
    if not all(_same_members(pos, group, g, who) for g, who in zip((a, b), members, strict=True)):
        return None
    path, other = (mean_of_present(pos[:, who]) for who in members)
    during = slice(first - begin, last + 1 - begin)
    apart = other - path
    relative = mean_of_present(vel[during, members[1]]) - mean_of_present(vel[during, members[0]])
    relative = relative[np.isfinite(relative).all(axis=1)]
    if not len(relative) or length(relative.sum(axis=0)) / len(relative) < CROSS_VELOCITY:
        return None
    # Sides change if the direction from one middle to the other turns by more than 90°, or if the paths of the middles
    # cross, not counting crossings back.
    if not dot(apart[during][0], apart[during][-1]) < 0 and net_crossings(path, other) == 0:
        return None
    k = during.start + int(np.nanargmin(length(apart[during])))
    x, y = (path[k] + other[k]) / 2
    crossed = tuple(people[p] for p in sorted(np.concatenate(members).tolist()))
    return GroupEvent("cross", first + 1, last + 1, None, (a, b), (a, b), crossed, (float(x), float(y)))


def _same_members(pos: Array, group: Ints, name: int, columns: Ints) -> bool:
    """Returns True if in all frames (T,) those of the columns who are present belong to this group, and nobody else."""
    there, own = np.isfinite(pos[:, columns, 0]).sum(axis=1), (group[:, columns] == name).sum(axis=1)
    # A member who stays while the others have left the scene is alone, but the group has not changed.
    same = (own == there) | (there < 2)
    return bool((same & ((group == name).sum(axis=1) == own)).all())


def net_crossings(a: Array, b: Array) -> int:
    """Returns how often path b crosses path a from left to right, minus how often from right to left.

    a, b (R, 2): points of both paths, m, nan where unknown. Let s and t be times on a and b. The difference b(t) - a(s)
    winds round zero once for each crossing as (s, t) goes round the square of all times. The turns along the four sides
    are summed. Paths that meet in a vertex of both are then no special case.
    """
    a, b = a[np.isfinite(a).all(axis=1)], b[np.isfinite(b).all(axis=1)]
    if not len(a) or not len(b):
        return 0
    return round((_turn(a, b[0]) - _turn(a, b[-1]) - _turn(b, a[0]) + _turn(b, a[-1])) / (2 * np.pi))


def _turn(path: Array, point: Array) -> float:
    """Returns how far a path (R, 2) turns, rad, seen from a point (2,)."""
    a, b = path[:-1] - point, path[1:] - point
    return float(atan2(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0], dot(a, b)).sum())
