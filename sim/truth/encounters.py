"""Encounters of groups: stretches of time in which two hulls are within 1.0 m, and the courses of who meets there.

Everything is worked on for all encounters at once. Ragged tables are flat: rows of one encounter after the other.
"""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np

from sim.geometry.footprints import FOOTPRINT_RADIUS, FOOTPRINT_SIDES, footprint_hulls, position_hulls
from sim.geometry.polygons import edge_distance_pairs, gap_pairs, pack
from sim.truth.merge_split_rules import frames_of
from sim.truth.proximity import close_pairs, runs, stretches
from sim.types import Array, Bools, Ints

CROSS_GAP = 1.0  # m between hulls
BRIDGE_TIME = 0.5  # s: an encounter may be interrupted for so long


@dataclass(frozen=True, slots=True, eq=False)
class Encounters:
    """E encounters ordered by time: first, last frame (from 0), groups a < b."""

    first: Ints
    last: Ints
    a: Ints
    b: Ints

    def __getitem__(self, rows: slice | Ints | Bools) -> Encounters:
        return Encounters(*(getattr(self, f.name)[rows] for f in fields(self)))

    def __len__(self) -> int:
        return len(self.first)


@dataclass(frozen=True, slots=True, eq=False)
class GroupRows:
    """Who is in which group when: G groups of a frame sorted by (frame t, name), member rows `first` … of `person`.

    key: t * width + name, ascending.
    """

    t: Ints
    name: Ints
    key: Ints
    width: int
    first: Ints
    count: Ints
    person: Ints

    def find(self, t: Ints, name: Ints) -> tuple[Ints, Ints]:
        """(first, count) of these groups in these frames; count 0 where there is no such group."""
        if not len(self.t):
            return np.zeros_like(t), np.zeros_like(t)
        key = t * self.width + name
        place = np.minimum(np.searchsorted(self.key, key), len(self.key) - 1)
        found = self.key[place] == key
        return self.first[place], np.where(found, self.count[place], 0)

    def members(self, t: int, name: int) -> Ints:
        """The people of one group in one frame."""
        first, count = self.find(np.array([t]), np.array([name]))
        return self.person[first[0] : first[0] + count[0]]


def group_rows(group: Ints) -> GroupRows:
    """The GroupRows of labels (T, P), -1 alone or absent."""
    t, person = np.nonzero(group >= 0)
    order = np.lexsort((person, group[t, person], t))
    t, person = t[order], person[order]
    name = group[t, person]
    first = np.flatnonzero((np.diff(t, prepend=-1) != 0) | (np.diff(name, prepend=-1) != 0))
    t, name, width = t[first], name[first], int(name.max(initial=0)) + 1
    return GroupRows(t, name, t * width + name, width, first, np.diff(np.append(first, len(person))), person)


def encounters(pos: Array, roll: GroupRows, fps: float) -> Encounters:
    """All encounters of groups of 2 or more; pos (T, P, 2)."""
    if not len(roll.t):
        return Encounters(roll.t, roll.t, roll.t, roll.t)
    i, j = _within_reach(roll.t, pos[np.repeat(roll.t, roll.count), roll.person], roll.count)
    width = roll.width
    pair, when = roll.name[i] * width + roll.name[j], roll.t[i]  # sorted by group within a frame: name[i] < name[j]
    order = np.lexsort((when, pair))
    pair, first, last = stretches(pair[order], when[order], 1, frames_of(BRIDGE_TIME, fps))
    order = np.lexsort((pair, last, first))
    return Encounters(first[order], last[order], pair[order] // width, pair[order] % width)


def _within_reach(t: Ints, places: Array, count: Ints) -> tuple[Ints, Ints]:
    """Groups i < j of one frame t (G,) whose hulls are within 1.0 m; places (R, 2): members of group after group."""
    start = np.cumsum(count) - count
    middle = np.add.reduceat(places, start) / count[:, None]
    radius = np.maximum.reduceat(np.hypot(*(places - np.repeat(middle, count, axis=0)).T), start) + FOOTPRINT_RADIUS
    i, j = close_pairs(t, middle, CROSS_GAP + 2 * float(radius.max()))
    near = np.hypot(*(middle[i] - middle[j]).T) <= CROSS_GAP + radius[i] + radius[j]
    near &= (count[i] > 1) & (count[j] > 1)
    i, j = i[near], j[near]
    # The footprints' 16-gons lie between discs of 0.25 m and of their inner radius: mostly that settles it.
    bare = pack(position_hulls(places, count))
    between = edge_distance_pairs(bare, bare, i, j)
    close = between <= CROSS_GAP + 2 * FOOTPRINT_RADIUS * np.cos(np.pi / FOOTPRINT_SIDES)
    overlap = (bare.box[i, :2] <= bare.box[j, 2:]).all(axis=1) & (bare.box[j, :2] <= bare.box[i, 2:]).all(axis=1)
    doubt = np.flatnonzero(~close & ((between <= CROSS_GAP + 2 * FOOTPRINT_RADIUS) | overlap))
    whom, place = np.unique(np.concatenate([i[doubt], j[doubt]]), return_inverse=True)
    rows = np.isin(np.repeat(np.arange(len(count)), count), whom)
    hulls = pack(footprint_hulls(places[rows], count[whom]))
    close[doubt] = gap_pairs(hulls, hulls, *np.split(place, 2)) <= CROSS_GAP
    return i[close], j[close]


@dataclass(frozen=True, slots=True, eq=False)
class GroupPath:
    """One side of each encounter over the frames around it, R rows: middle and mean velocity of who is there of those
    who met (R, 2), nan where nobody is; kept: whether the group is still, or already, these people."""

    middle: Array
    vel: Array
    kept: Bools


def group_paths(
    pos: Array, vel: Array, group: Ints, roll: GroupRows, name: Ints, met: Ints, encounter: Ints, frame: Ints
) -> GroupPath:
    """Courses of groups name (E,) as they were in frames met (E,), in rows (encounter, frame) (R,)."""
    first, count = roll.find(met, name)
    row, place = runs(first[encounter], (first + count)[encounter])
    who, start = roll.person[place], np.cumsum(count[encounter]) - count[encounter]
    when = frame[row]
    places, speeds = pos[when, who], vel[when, who]
    there = np.isfinite(places[:, 0]) & np.isfinite(places[:, 1])
    own = group[when, who] == name[encounter[row]]
    present, still = (np.add.reduceat(x.astype(np.int64), start) if len(start) else start for x in (there, own & there))
    # One who stays while the others have left the scene is alone, and yet has changed nothing.
    same = (still == present) | (present < 2)
    others = roll.find(frame, name[encounter])[1] > still
    return GroupPath(_mean(places, there, start), _mean(speeds, there, start), same & ~others)


def _mean(values: Array, there: Bools, start: Ints) -> Array:
    """Means (R, 2) of runs of values (N, 2) that begin at `start`, of those who are there and known; nan of none."""
    known = there & np.isfinite(values[:, 0]) & np.isfinite(values[:, 1])
    if not len(start):
        return np.zeros((0, 2))
    total = [np.add.reduceat(np.where(known, values[:, k], 0.0), start) for k in (0, 1)]
    with np.errstate(invalid="ignore"):
        return np.asarray(np.stack(total, axis=1) / np.add.reduceat(known.astype(float), start)[:, None])


def net_crossings(a: Array, b: Array, encounter: Ints, count: int) -> Ints:
    """How often (count,) path b crosses path a, left to right minus right to left, at whatever times.

    a, b (R, 2): the paths of each encounter, one after the other; nan points are left out. The difference b(t) - a(s)
    goes round 0 once for each crossing as (s, t) goes round the square of times: the turns along its four sides are
    summed. Unlike cutting segments, that does not mind paths that meet in a vertex of both.
    """
    turns = _turns(a, b, encounter, count) - _turns(b, a, encounter, count)
    return np.asarray(np.round(turns / (2 * np.pi)), np.int64)


def _turns(path: Array, other: Array, encounter: Ints, count: int) -> Array:
    """How far the arm to `path` turns as seen from the first point of `other`, less as seen from its last (count,)."""
    known = np.isfinite(path).all(axis=1)
    point, whose = path[known], encounter[known]
    seen = np.flatnonzero(np.isfinite(other).all(axis=1))
    total = np.zeros(count)
    for sign, end in ((1.0, seen[::-1]), (-1.0, seen)):
        from_ = np.zeros((count, 2))
        from_[encounter[end]] = other[end]  # of several rows the last one stays: reversed, that is the first
        arm = point - from_[whose]
        a, b = arm[:-1], arm[1:]
        angle = np.arctan2(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0], (a * b).sum(axis=1))
        total += sign * np.bincount(whose[1:], np.where(whose[1:] == whose[:-1], angle, 0.0), minlength=count)
    return total
