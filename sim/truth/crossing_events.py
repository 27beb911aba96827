"""Makes cross events: two groups that pass through each other, or closely round each other, and stay the same groups.

First it finds encounters of groups, stretches in which two hulls are within 1.0 m (CROSS_GAP), and the paths of the
groups that meet; a hull is the convex outline of discs round the members. They are found from positions, velocities
and group ids, for truth and trackers alike. Arrays are dense, (T, P, ...), one column for each person. A person is
absent where a position is nan or `present` is False. The id of a person is the column + 1; frames of events count from
1. All encounters are handled at once, in flat tables: the rows of one encounter follow those of another.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, fields

import numpy as np

from sim.elementary import atan2, dot, length
from sim.geometry.polygons import FOOTPRINT_RADIUS, footprint_hulls, gap_pairs, pack
from sim.truth.merge_split_rules import close_pairs, frames_of, mean_of_present, runs, stretches
from sim.types import Array, Bools, GroupEvent, Ints

CROSS_GAP = 1.0  # m between hulls
BRIDGE_TIME = 0.5  # s for which hulls may be further apart within one encounter


@dataclass(frozen=True, slots=True, eq=False)
class Encounters:
    """E stretches in which two groups are near each other, sorted by first frame, last frame and group ids."""

    # first, last (E,): frames from 0, both inclusive
    first: Ints
    last: Ints
    # a, b (E,): group ids, a < b. Indexing with a slice, indices or flags gives Encounters of these rows; len() gives
    # E.
    a: Ints
    b: Ints

    def __getitem__(self, rows: slice | Ints | Bools) -> Encounters:
        return Encounters(*(getattr(self, f.name)[rows] for f in fields(self)))

    def __len__(self) -> int:
        return len(self.first)


@dataclass(frozen=True, slots=True, eq=False)
class MembersByFrame:
    """The members of each group in each frame: G rows, one for each group and frame, sorted by (frame, group id)."""

    t: Ints  # (G,) frame from 0
    name: Ints  # (G,) group id
    key: Ints  # (G,) t * width + name, ascending, for look-ups
    width: int  # greatest group id + 1; 1 without groups
    # first, count (G,): the members of a row are person[first : first + count]
    first: Ints
    count: Ints
    person: Ints  # (R,) columns (person id - 1) of the members of row after row, ascending within a row

    def find(self, t: Ints, name: Ints) -> tuple[Ints, Ints]:
        """Returns (first, count), both (K,), of the groups name (K,) in frames t (K,); count is 0 if there is none."""
        if not len(self.t):
            return np.zeros_like(t), np.zeros_like(t)
        key = t * self.width + name
        place = np.minimum(np.searchsorted(self.key, key), len(self.key) - 1)
        found = self.key[place] == key
        return self.first[place], np.where(found, self.count[place], 0)

    def members(self, t: int, name: int) -> Ints:
        """Returns the columns (person id - 1), ascending, of the members of a group in frame t (from 0)."""
        first, count = self.find(np.array([t]), np.array([name]))
        return self.person[first[0] : first[0] + count[0]]


def members_by_frame(group: Ints) -> MembersByFrame:
    """Returns the members of all groups in all frames. group (T, P): group ids, -1 = alone or absent."""
    t, person = np.nonzero(group >= 0)
    order = np.lexsort((person, group[t, person], t))
    t, person = t[order], person[order]
    name = group[t, person]
    first = np.flatnonzero((np.diff(t, prepend=-1) != 0) | (np.diff(name, prepend=-1) != 0))
    t, name, width = t[first], name[first], int(name.max(initial=0)) + 1
    return MembersByFrame(t, name, t * width + name, width, first, np.diff(np.append(first, len(person))), person)


def encounters(pos: Array, rows: MembersByFrame, fps: float) -> Encounters:
    """Returns all encounters of two groups of two or more people.

    pos (T, P, 2): m, finite for all members. rows: the members of all groups by frame.
    """
    if not len(rows.t):
        return Encounters(rows.t, rows.t, rows.t, rows.t)
    i, j = _within_reach(rows.t, pos[np.repeat(rows.t, rows.count), rows.person], rows.count)
    width = rows.width
    pair, when = rows.name[i] * width + rows.name[j], rows.t[i]  # sorted by group within a frame: name[i] < name[j]
    order = np.lexsort((when, pair))
    pair, first, last = stretches(pair[order], when[order], 1, frames_of(BRIDGE_TIME, fps))
    order = np.lexsort((pair, last, first))
    return Encounters(first[order], last[order], pair[order] // width, pair[order] % width)


def _within_reach(t: Ints, places: Array, count: Ints) -> tuple[Ints, Ints]:
    """Returns the pairs (i, j), i < j, of rows of one frame whose hulls are within CROSS_GAP, (K,) each."""
    start = np.cumsum(count) - count
    middle = np.add.reduceat(places, start) / count[:, None]
    radius = np.maximum.reduceat(length(places - np.repeat(middle, count, axis=0)), start) + FOOTPRINT_RADIUS
    i, j = close_pairs(t, middle, CROSS_GAP + 2 * float(radius.max()))
    near = length(middle[i] - middle[j]) <= CROSS_GAP + radius[i] + radius[j]
    near &= (count[i] > 1) & (count[j] > 1)
    i, j = i[near], j[near]
    group, place = np.unique(np.concatenate([i, j]), return_inverse=True)
    rows = np.isin(np.repeat(np.arange(len(count)), count), group)
    hulls = pack(footprint_hulls(places[rows], count[group]))
    close = gap_pairs(hulls, hulls, *np.split(place, 2)) <= CROSS_GAP
    return i[close], j[close]


@dataclass(frozen=True, slots=True, eq=False)
class GroupPath:
    """The path of one of the two groups of each encounter: R rows, frames in and around the encounters."""

    # middle, vel (R, 2): mean position x, y, m, and mean velocity, m/s, of the members at the meeting who are present
    # in the row's frame; nan if none of them is
    middle: Array
    vel: Array
    # (R,) True if the group has no other members than at the meeting, and the present ones all belong to it. One who
    # alone is still present need not belong to it.
    same_members: Bools


def group_paths(
    pos: Array, vel: Array, group: Ints, rows: MembersByFrame, name: Ints, met: Ints, encounter: Ints, frame: Ints
) -> GroupPath:
    """Returns the path of one group of each encounter, as means over its members in frame `met` (E,).

    pos, vel (T, P, 2): m, m/s, nan while absent. name (E,): group ids. encounter, frame (R,): the rows, frames from 0.
    """
    first, count = rows.find(met, name)
    row, place = runs(first[encounter], (first + count)[encounter])
    person, start = rows.person[place], np.cumsum(count[encounter]) - count[encounter]
    when = frame[row]
    places, speeds = pos[when, person], vel[when, person]
    there = np.isfinite(places[:, 0]) & np.isfinite(places[:, 1])
    own = group[when, person] == name[encounter[row]]
    present, still = (np.add.reduceat(x.astype(np.int64), start) if len(start) else start for x in (there, own & there))
    # A member who stays while the others have left the scene is alone, but the group has not changed.
    same = (still == present) | (present < 2)
    others = rows.find(frame, name[encounter])[1] > still
    return GroupPath(_mean(places, there, start), _mean(speeds, there, start), same & ~others)


def _mean(values: Array, there: Bools, start: Ints) -> Array:
    """Returns the means (R, 2) of consecutive runs of the finite values (N, 2) that are there; nan without any."""
    known = there & np.isfinite(values[:, 0]) & np.isfinite(values[:, 1])
    if not len(start):
        return np.zeros((0, 2))
    total = [np.add.reduceat(np.where(known, values[:, k], 0.0), start) for k in (0, 1)]
    with np.errstate(invalid="ignore"):
        return np.asarray(np.stack(total, axis=1) / np.add.reduceat(known.astype(float), start)[:, None])


def net_crossings(a: Array, b: Array, encounter: Ints, count: int) -> Ints:
    """Returns how often path b crosses path a from left to right, minus right to left, in each encounter.

    a, b (R, 2): points of both paths, m. encounter (R,): of each row, from 0, ascending. Let s and t be times on a and
    b. The difference b(t) - a(s) winds round zero once for each crossing as (s, t) goes round the square of all times.
    The turns along the four sides are summed. Paths that meet in a vertex of both are then no special case.
    """
    turns = _turns(a, b, encounter, count) - _turns(b, a, encounter, count)
    return np.asarray(np.round(turns / (2 * np.pi)), np.int64)


def _turns(path: Array, other: Array, encounter: Ints, count: int) -> Array:
    """Returns how far `path` turns, rad, seen from the first point of `other`, minus the same from its last point."""
    known = np.isfinite(path).all(axis=1)
    point, own = path[known], encounter[known]
    seen = np.flatnonzero(np.isfinite(other).all(axis=1))
    total = np.zeros(count)
    for sign, end in ((1.0, seen[::-1]), (-1.0, seen)):
        from_ = np.zeros((count, 2))
        from_[encounter[end]] = other[end]  # of several rows the last one stays: reversed, that is the first
        arm = point - from_[own]
        a, b = arm[:-1], arm[1:]
        angle = atan2(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0], dot(a, b))
        total += sign * np.bincount(own[1:], np.where(own[1:] == own[:-1], angle, 0.0), minlength=count)
    return total


CROSS_VELOCITY = 0.6  # m/s: least difference of the mean velocities over the encounter
SAME_BEFORE = 2.0  # s before and after the encounter in which the members stay the same
ROWS = 500_000  # frames of encounters handled together: bounds memory


def crossings(pos: Array, vel: Array, present: Bools, group: Ints, fps: float) -> list[GroupEvent]:
    """Returns a cross event for each crossing of two groups of two or more people, in order of time.

    pos, vel (T, P, 2): m, m/s. present (T, P). group (T, P): group ids, -1 = alone or absent. An encounter is a stretch
    in which two groups' hulls are within 1.0 m, but for breaks of up to 0.5 s. It is a crossing if their mean relative
    velocity is at least CROSS_VELOCITY long, they change sides, and both keep their members, but for those who leave
    the scene, from SAME_BEFORE before it to SAME_BEFORE after it.
    """
    there = present & np.isfinite(pos).all(axis=2)
    places, label = np.where(there[..., None], pos, np.nan), np.where(there, group, -1)
    rows = members_by_frame(label)
    met = encounters(places, rows, fps)
    found: list[GroupEvent] = []
    for some in _portions(met, frames_of(SAME_BEFORE, fps)):
        found += _crossed(places, vel, label, rows, some, frames_of(SAME_BEFORE, fps))
    return found


def _portions(met: Encounters, margin: int) -> Iterator[Encounters]:
    """Yields the encounters in portions of about ROWS frames."""
    total = np.cumsum(met.last - met.first + 1 + 2 * margin)
    return (met[total // ROWS == k] for k in np.unique(total // ROWS))


def _crossed(
    pos: Array, vel: Array, group: Ints, rows: MembersByFrame, met: Encounters, margin: int
) -> list[GroupEvent]:
    low, high = np.maximum(met.first - margin, 0), np.minimum(met.last + margin + 1, len(pos))
    k, frame = runs(low, high)
    a, b = (group_paths(pos, vel, group, rows, name, met.first, k, frame) for name in (met.a, met.b))
    during = (frame >= met.first[k]) & (frame <= met.last[k])
    changed = np.bincount(k, ~(a.same_members & b.same_members), minlength=len(met)) > 0
    good = ~changed & (_relative_speed(a, b, k, during, len(met)) >= CROSS_VELOCITY)
    start = np.cumsum(high - low) - (high - low)
    apart = b.middle - a.middle
    # Sides change if the direction from one middle to the other turns by more than 90°, or if the paths of the middles
    # cross, not counting crossings back.
    turned = (apart[start + met.first - low] * apart[start + met.last - low]).sum(axis=1) < 0
    good &= turned | (net_crossings(a.middle, b.middle, k, len(met)) != 0)
    closest = _closest(apart, k, during)
    found = []
    for e in np.flatnonzero(good).tolist():
        names, t = (int(met.a[e]), int(met.b[e])), int(frame[closest[e]])
        both = [rows.members(int(met.first[e]), name) for name in names]
        x, y = sum(mean_of_present(pos[t : t + 1, members])[0] for members in both) / 2
        people = tuple(sorted(int(p) + 1 for p in np.concatenate(both)))
        first, last = int(met.first[e]) + 1, int(met.last[e]) + 1
        found.append(GroupEvent("cross", first, last, None, names, names, people, (float(x), float(y))))
    return found


def _relative_speed(a: GroupPath, b: GroupPath, k: Ints, during: Bools, count: int) -> Array:
    relative = b.vel - a.vel
    known = during & np.isfinite(relative).all(axis=1)
    total = [np.bincount(k[known], relative[known, axis], minlength=count) for axis in (0, 1)]
    with np.errstate(invalid="ignore"):
        return np.asarray(length(np.stack(total, axis=-1)) / np.bincount(k[known], minlength=count))


def _closest(apart: Array, k: Ints, during: Bools) -> Ints:
    """Returns the row of each encounter in which the middles are closest; of several the first."""
    distance = np.where(during & np.isfinite(apart).all(axis=1), length(apart), np.inf)
    order = np.lexsort((distance, k))
    return order[np.flatnonzero(np.diff(k, prepend=-1))]
