"""Crossings and queues, measured from motion: one function for the truth and for anybody's tracks.

Dense arrays (T, P, ...), nan or not present = absent; person ids are column + 1. Frames of events are 1-based.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from sim.footprints import footprint_hulls, place_hulls
from sim.geometry import FOOTPRINT, SIDES, edge_distance_pairs, gap_pairs, pack
from sim.lines import Line, lines
from sim.near import close_pairs, stretches
from sim.rules import frames_of, mean
from sim.types import Array, Bools, GroupEvent, Ints

CROSS_GAP = 1.0  # m between hulls
CROSS_SPEED = 0.6  # m/s, least difference of velocities over the encounter
SAME_BEFORE = 2.0  # s before and after, in which memberships are equal
BRIDGE = 0.5  # s: an encounter may be interrupted for so long


def crossings(pos: Array, vel: Array, present: Bools, group: Ints, fps: float) -> list[GroupEvent]:
    """Two groups (of 2 or more) that pass through, or closely round, each other and stay who they are.

    An encounter is a stretch with hulls within 1.0 m. The mean of their relative velocity over it must be at least
    0.6 m/s, and each must get to the other's other side: the way from one middle to the other turns by more than 90°
    meanwhile, or the paths of their middles cross between 2 s before and 2 s after (who bounces back, or passes by in
    a lane beside, does neither). Members are the same 2 s before and after.
    """
    met = _encounters(pos, np.where(present, group, -1), fps)
    found = (_crossing(pos, vel, group, present, fps, *one) for one in met)
    return [event for event in found if event is not None]


def _encounters(pos: Array, group: Ints, fps: float) -> Iterator[tuple[int, int, int, int]]:
    """(first, last frame from 0, group, group) of each stretch with hulls within reach, ordered by time."""
    t, p = np.nonzero(group >= 0)
    order = np.lexsort((p, group[t, p], t))
    t, p = t[order], p[order]
    name = group[t, p]
    start = np.flatnonzero((np.diff(t, prepend=-1) != 0) | (np.diff(name, prepend=-1) != 0))
    count = np.diff(np.append(start, len(t)))
    if not len(start):
        return
    places, t, name = pos[t, p], t[start], name[start]
    i, j = _within_reach(t, places, count)
    width = int(name.max()) + 1
    pair, when = name[i] * width + name[j], t[i]  # rows are sorted by group within a frame: name[i] < name[j]
    order = np.lexsort((when, pair))
    found = zip(*stretches(pair[order], when[order], 1, frames_of(BRIDGE, fps)), strict=True)
    for first, last, g in sorted((int(a), int(b), int(k)) for k, a, b in found):
        yield first, last, g // width, g % width


def _within_reach(t: Ints, places: Array, count: Ints) -> tuple[Ints, Ints]:
    """Groups i < j of one frame t (G,) whose hulls are within 1.0 m; places (R, 2): members of group after group."""
    start = np.cumsum(count) - count
    middle = np.add.reduceat(places, start) / count[:, None]
    radius = np.maximum.reduceat(np.hypot(*(places - np.repeat(middle, count, axis=0)).T), start) + FOOTPRINT
    i, j = close_pairs(t, middle, CROSS_GAP + 2 * float(radius.max()))
    near = np.hypot(*(middle[i] - middle[j]).T) <= CROSS_GAP + radius[i] + radius[j]
    near &= (count[i] > 1) & (count[j] > 1)
    i, j = i[near], j[near]
    # The footprints' 16-gons lie between discs of 0.25 m and of their inner radius: mostly that settles it.
    bare = pack(place_hulls(places, count))
    between = edge_distance_pairs(bare, bare, i, j)
    close = between <= CROSS_GAP + 2 * FOOTPRINT * np.cos(np.pi / SIDES)
    overlap = (bare.box[i, :2] <= bare.box[j, 2:]).all(axis=1) & (bare.box[j, :2] <= bare.box[i, 2:]).all(axis=1)
    doubt = np.flatnonzero(~close & ((between <= CROSS_GAP + 2 * FOOTPRINT) | overlap))
    whom, place = np.unique(np.concatenate([i[doubt], j[doubt]]), return_inverse=True)
    rows = np.isin(np.repeat(np.arange(len(count)), count), whom)
    hulls = pack(footprint_hulls(places[rows], count[whom]))
    close[doubt] = gap_pairs(hulls, hulls, *np.split(place, 2)) <= CROSS_GAP
    return i[close], j[close]


def _crossing(
    pos: Array, vel: Array, group: Ints, present: Bools, fps: float, first: int, last: int, g: int, h: int
) -> GroupEvent | None:
    """The event of an encounter, if it is a crossing."""
    a, b = (np.flatnonzero(present[first] & (group[first] == name)) for name in (g, h))
    if not (_stays(group, present, a, first, last, fps) and _stays(group, present, b, first, last, fps)):
        return None
    window = slice(first, last + 1)
    apart = mean(pos[window][:, b]) - mean(pos[window][:, a])
    relative = np.nanmean(mean(vel[window][:, b]) - mean(vel[window][:, a]), axis=0)
    if np.hypot(*relative) < CROSS_SPEED:
        return None
    margin = frames_of(SAME_BEFORE, fps)
    around = slice(max(first - margin, 0), last + margin + 1)
    if apart[0] @ apart[-1] >= 0 and not _paths_cross(mean(pos[around][:, a]), mean(pos[around][:, b])):
        return None
    closest = int(np.nanargmin(np.hypot(*apart.T)))
    x, y = (mean(pos[window][:, a])[closest] + mean(pos[window][:, b])[closest]) / 2
    people = tuple(sorted(int(p) + 1 for p in (*a, *b)))
    return GroupEvent("cross", first + 1, last + 1, None, (g, h), (g, h), people, (float(x), float(y)))


def _paths_cross(a: Array, b: Array) -> bool:
    """Whether two polylines (T, 2) cross each other, at whatever times; nan points are left out."""
    a, b = a[np.isfinite(a).all(axis=1)], b[np.isfinite(b).all(axis=1)]

    def left(line: Array, points: Array) -> Bools:
        along, to = np.diff(line, axis=0)[:, None], points[None] - line[:-1, None]
        return np.asarray(along[..., 0] * to[..., 1] > along[..., 1] * to[..., 0])

    of_a, of_b = left(a, b), left(b, a).T
    return bool(((of_a[:, 1:] != of_a[:, :-1]) & (of_b[1:] != of_b[:-1])).any())


def _stays(group: Ints, present: Bools, people: Ints, first: int, last: int, fps: float) -> bool:
    """Whether these people are one group, and nobody else in it, from 2 s before to 2 s after, as far as they are
    there."""
    margin = frames_of(SAME_BEFORE, fps)
    window = slice(max(first - margin, 0), last + margin + 1)
    inside, there = group[window], present[window]
    name = group[first, people[0]]
    others = (inside == name) & there
    others[:, people] = False
    own = (inside[:, people] == name) | ~there[:, people]
    # One who stays while the others have left the scene is alone, and yet has changed nothing.
    own |= there[:, people].sum(axis=1, keepdims=True) < 2
    return bool(own.all() and not others.any())


def queue_lines(pos: Array, vel: Array, present: Bools, fps: float) -> list[Line]:
    """The queues of `queues`, with who stood in which order and who left when."""
    there = present & np.isfinite(pos).all(axis=2)
    return lines(pos, vel, there, fps)


def queues(pos: Array, vel: Array, present: Bools, fps: float) -> list[GroupEvent]:
    """Three or more people waiting in line for 3 s or longer; the event lasts until less than two do.

    Spacing along the line 0.4-1.5 m, nobody more than 0.5 m off it, slower than 0.4 m/s except when advancing.
    start is the onset, members all who stood in the line for a second or more, pos its
    middle then.
    """
    return [
        GroupEvent("queue", q.first + 1, q.last + 1, None, (), (), tuple(p + 1 for p in sorted(q.order)), q.middle)
        for q in queue_lines(pos, vel, present, fps)
    ]
