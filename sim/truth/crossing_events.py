"""Makes cross events: two groups that pass through each other, or closely round each other, and stay the same groups.

They are found from positions, velocities and group ids, for truth and trackers alike. Arrays are dense, (T, P, ...),
one column for each person. A person is absent where a position is nan or `present` is False. The id of a person is the
column + 1; frames of events count from 1.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from sim.elementary import length
from sim.truth.encounters import (
    Encounters,
    GroupPath,
    MembersByFrame,
    encounters,
    group_paths,
    members_by_frame,
    net_crossings,
)
from sim.truth.merge_split_rules import frames_of, mean_of_present
from sim.truth.proximity import runs
from sim.types import Array, Bools, GroupEvent, Ints

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
