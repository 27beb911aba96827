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
    """Returns a cross event for each crossing of two groups of two or more people, in order of first and last frame.

    pos, vel (T, P, 2): x, y in m and m/s. present (T, P): flags. group (T, P): group ids, -1 = alone or absent. fps:
    frames per s. A person with a nan position counts as absent. The id of a person is the column + 1; frames of events
    count from 1. No frames or no groups give [].

    An encounter is a stretch in which the hulls of two groups (of discs of 0.25 m round the members) are within 1.0 m;
    breaks of at most 0.5 s do not end it. It is a crossing if all of this holds:

    - the mean over the encounter of their relative velocity is known, and at least CROSS_VELOCITY (0.6 m/s) long;
    - they change sides: the direction from one middle to the other turns by more than 90° from the first to the last
      frame, or the paths of the middles cross, not counting crossings back, from SAME_BEFORE (2 s) before the encounter
      to SAME_BEFORE after it, as far as recorded;
    - in that time both groups keep their members; members who leave the scene do not matter.

    The event lasts as long as the encounter. Its `before` and `after` are both group ids, its members those in the
    first frame. Its position is the mean of both middles where these are closest.
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
    """Yields the encounters `met` in portions, in their order, so that the frames of a portion add up to about ROWS
    (500,000).

    An encounter is a stretch of frames in which two groups are close. `margin` frames before and after each count, too.
    An encounter is never divided. Nothing is yielded without encounters.
    """
    total = np.cumsum(met.last - met.first + 1 + 2 * margin)
    return (met[total // ROWS == k] for k in np.unique(total // ROWS))


def _crossed(
    pos: Array, vel: Array, group: Ints, rows: MembersByFrame, met: Encounters, margin: int
) -> list[GroupEvent]:
    """Returns a cross event for each of the encounters `met` that is a crossing, in their order.

    A crossing: mean relative velocity of at least 0.6 m/s, a change of sides, and the same members all the time. pos,
    vel (T, P, 2): m, m/s, nan while absent. group (T, P): group ids, -1 = alone or absent. rows: members of all groups
    by frame. margin: number of frames before and after the encounter, as far as there are, that count, too.
    """
    low, high = np.maximum(met.first - margin, 0), np.minimum(met.last + margin + 1, len(pos))
    k, frame = runs(low, high)
    a, b = (group_paths(pos, vel, group, rows, name, met.first, k, frame) for name in (met.a, met.b))
    during = (frame >= met.first[k]) & (frame <= met.last[k])
    changed = np.bincount(k, ~(a.same_members & b.same_members), minlength=len(met)) > 0
    good = ~changed & (_relative_speed(a, b, k, during, len(met)) >= CROSS_VELOCITY)
    start = np.cumsum(high - low) - (high - low)
    apart = b.middle - a.middle
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
    """Returns the length in m/s of the mean relative velocity during each of `count` encounters, shape (count,).

    An encounter is a stretch of frames in which two groups are close. a, b: paths of the two groups; their R rows are
    frames of encounters. k (R,): encounter of each row, ascending. during (R,): True for rows that count. nan for an
    encounter in which no velocity is known.
    """
    relative = b.vel - a.vel
    known = during & np.isfinite(relative).all(axis=1)
    total = [np.bincount(k[known], relative[known, axis], minlength=count) for axis in (0, 1)]
    with np.errstate(invalid="ignore"):
        return np.asarray(length(np.stack(total, axis=-1)) / np.bincount(k[known], minlength=count))


def _closest(apart: Array, k: Ints, during: Bools) -> Ints:
    """Returns for each encounter that has rows the index of the row in which the middles are closest; of several the
    first.

    An encounter is a stretch of frames in which two groups are close; a row is one frame in or near it. apart (R, 2):
    vector between the two groups' middles, m, nan if unknown. k (R,): encounter of each row, ascending. during (R,):
    rows outside the encounter are False and are chosen only if no row of it is known.
    """
    distance = np.where(during & np.isfinite(apart).all(axis=1), length(apart), np.inf)
    order = np.lexsort((distance, k))
    return order[np.flatnonzero(np.diff(k, prepend=-1))]
