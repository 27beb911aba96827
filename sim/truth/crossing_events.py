"""Crossings and queues, measured from motion: one function for the truth and for anybody's tracks.

Dense arrays (T, P, ...), nan or not present = absent; person ids are column + 1. Frames of events are 1-based.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from sim.truth.encounters import Encounters, GroupPath, GroupRows, encounters, group_paths, group_rows, net_crossings
from sim.truth.merge_split_rules import frames_of, mean_of_present
from sim.truth.proximity import runs
from sim.types import Array, Bools, GroupEvent, Ints

CROSS_SPEED = 0.6  # m/s, least difference of velocities over the encounter
SAME_BEFORE = 2.0  # s before and after, in which groups_and_events are equal
ROWS = 500_000  # encounters times frames looked at together: bounds memory


def crossings(pos: Array, vel: Array, present: Bools, group: Ints, fps: float) -> list[GroupEvent]:
    """Two groups (of 2 or more) that pass through, or closely round, each other and stay who they are.

    An encounter is a stretch with hulls within 1.0 m. The mean of their relative velocity over it must be at least
    0.6 m/s, and each must get to the other's other side: the way from one middle to the other turns by more than 90°
    meanwhile, or the paths of their middles cross between 2 s before and 2 s after, and not back again (who bounces
    back, or passes by in a lane beside, does neither). Members are the same 2 s before and after.
    """
    there = present & np.isfinite(pos).all(axis=2)
    places, label = np.where(there[..., None], pos, np.nan), np.where(there, group, -1)
    roll = group_rows(label)
    met = encounters(places, roll, fps)
    found: list[GroupEvent] = []
    for some in _portions(met, len(pos), frames_of(SAME_BEFORE, fps)):
        found += _crossed(places, vel, label, roll, some, frames_of(SAME_BEFORE, fps))
    return found


def _portions(met: Encounters, frames: int, margin: int) -> Iterator[Encounters]:
    total = np.cumsum(met.last - met.first + 1 + 2 * margin)
    return (met[total // ROWS == k] for k in np.unique(total // ROWS))


def _crossed(pos: Array, vel: Array, group: Ints, roll: GroupRows, met: Encounters, margin: int) -> list[GroupEvent]:
    """The events of those encounters that are crossings."""
    low, high = np.maximum(met.first - margin, 0), np.minimum(met.last + margin + 1, len(pos))
    k, frame = runs(low, high)
    a, b = (group_paths(pos, vel, group, roll, name, met.first, k, frame) for name in (met.a, met.b))
    during = (frame >= met.first[k]) & (frame <= met.last[k])
    changed = np.bincount(k, ~(a.kept & b.kept), minlength=len(met)) > 0
    good = ~changed & (_speed(a, b, k, during, len(met)) >= CROSS_SPEED)
    start = np.cumsum(high - low) - (high - low)
    apart = b.middle - a.middle
    turned = (apart[start + met.first - low] * apart[start + met.last - low]).sum(axis=1) < 0
    good &= turned | (net_crossings(a.middle, b.middle, k, len(met)) != 0)
    closest = _closest(apart, k, during)
    found = []
    for e in np.flatnonzero(good).tolist():
        names, t = (int(met.a[e]), int(met.b[e])), int(frame[closest[e]])
        sides = [roll.members(int(met.first[e]), name) for name in names]
        x, y = sum(mean_of_present(pos[t : t + 1, side])[0] for side in sides) / 2
        people = tuple(sorted(int(p) + 1 for p in np.concatenate(sides)))
        first, last = int(met.first[e]) + 1, int(met.last[e]) + 1
        found.append(GroupEvent("cross", first, last, None, names, names, people, (float(x), float(y))))
    return found


def _speed(a: GroupPath, b: GroupPath, k: Ints, during: Bools, count: int) -> Array:
    """How fast (count,) two groups move on average relative to each other during an encounter; nan if unknown."""
    relative = b.vel - a.vel
    known = during & np.isfinite(relative).all(axis=1)
    total = [np.bincount(k[known], relative[known, axis], minlength=count) for axis in (0, 1)]
    with np.errstate(invalid="ignore"):
        return np.asarray(np.hypot(*total) / np.bincount(k[known], minlength=count))


def _closest(apart: Array, k: Ints, during: Bools) -> Ints:
    """The row of each encounter in which the middles are closest."""
    distance = np.where(during & np.isfinite(apart).all(axis=1), np.hypot(*apart.T), np.inf)
    order = np.lexsort((distance, k))
    return order[np.flatnonzero(np.diff(k, prepend=-1))]
