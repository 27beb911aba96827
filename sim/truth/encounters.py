"""Finds encounters of groups, stretches in which two hulls are within 1.0 m (CROSS_GAP), and the paths of the groups
that meet.

They are computed from people's positions and group ids. A hull is the convex outline of discs round the members. All
encounters are handled at once. Ragged tables are flat: the rows of one encounter follow those of another.
"""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np

from sim.elementary import atan2, cos, dot, length
from sim.geometry.footprints import FOOTPRINT_RADIUS, FOOTPRINT_SIDES, footprint_hulls, position_hulls
from sim.geometry.polygons import edge_distance_pairs, gap_pairs, pack
from sim.truth.merge_split_rules import frames_of
from sim.truth.proximity import close_pairs, runs, stretches
from sim.types import Array, Bools, Ints

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
    # A footprint lies between its circumscribed and its inscribed disc. In most cases these two decide; only the cases
    # between them need the hulls of the footprints.
    bare = pack(position_hulls(places, count))
    between = edge_distance_pairs(bare, bare, i, j)
    close = between <= CROSS_GAP + 2 * FOOTPRINT_RADIUS * float(cos(np.pi / FOOTPRINT_SIDES))
    overlap = (bare.box[i, :2] <= bare.box[j, 2:]).all(axis=1) & (bare.box[j, :2] <= bare.box[i, 2:]).all(axis=1)
    doubt = np.flatnonzero(~close & ((between <= CROSS_GAP + 2 * FOOTPRINT_RADIUS) | overlap))
    group, place = np.unique(np.concatenate([i[doubt], j[doubt]]), return_inverse=True)
    rows = np.isin(np.repeat(np.arange(len(count)), count), group)
    hulls = pack(footprint_hulls(places[rows], count[group]))
    close[doubt] = gap_pairs(hulls, hulls, *np.split(place, 2)) <= CROSS_GAP
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
