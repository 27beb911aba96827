"""Onsets of merges and splits of `group-pda`: when an event that is known now began (ours).

A split is known when its parts have long been apart, a merge when the filters' velocities have settled. Afterwards the
onset can be measured better: from chords through earlier and later centroids, which do not lag, and from the group's
earlier points, divided among the parts. Distances are metres on the ground (in an image depth is stretched to it).
The distances and velocities of the truth's rules come from sim.truth.merge_split_rules.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from sim.truth.merge_split_rules import MERGE_DISTANCE, SPLIT_DISTANCE, SPLIT_VELOCITY
from sim.types import Array

# s before and after a moment over which a velocity is a chord. For a merge it is longer, as whole groups turn slowly
# and bodies hide each other; a part leaves at once.
MERGE_CHORD, SPLIT_CHORD = 0.7, 0.4
# Factor on the velocity at which groups merge: a chord across the onset still contains motion from before it.
MERGE_CHORD_MARGIN = 1.2
# Distance of the last person in a row from its middle, in standard deviations: 1 for two people, 1.2 for three.
REACH = 1.1


class PairMoment(NamedTuple):
    """Two groups a and b at one time; a has the smaller id.

    t: s. difference (2,): centroid of b less that of a, m on the ground. middle (2,): point half-way between the
    centroids, in the unit of the points. gap: distance of their nearest people, m; negative if, from pixels, they
    overlap.
    """

    t: float
    difference: Array
    middle: Array
    gap: float


@dataclass
class PairHistory:
    """The past of two groups that are near each other.

    alike_since: time, s, since which they have also had like velocities; inf if the velocities differ now. moments: a
    `PairMoment` (distances and places) for each frame of the last 5 s in which the two were near, oldest first.
    """

    alike_since: float
    moments: list[PairMoment]

    def merge_onset(self, merge_velocity: float) -> tuple[float, Array]:
        """Returns when, in s, the groups came to be near with like velocities, and where (2,), in the points' unit:
        half-way between the centroids."""
        t, d = np.array([m.t for m in self.moments]), np.array([m.difference for m in self.moments])
        before = (chords(t, d, MERGE_CHORD) > MERGE_CHORD_MARGIN * merge_velocity) & (t <= self.alike_since)
        before |= np.array([m.gap for m in self.moments]) > MERGE_DISTANCE
        k = min(int(np.flatnonzero(before)[-1]) + 1 if before.any() else 0, len(t) - 1)
        return float(t[k]), self.moments[k].middle


def chords(t: Array, d: Array, half: float, *, full_length: bool = False) -> Array:
    """Returns speeds (K,) of the positions d (K, 2) at the times t (K,), s, ascending: chords from `half` s before to
    after."""
    k, middle = np.arange(len(t)), t
    if full_length:
        middle = np.clip(t, min(t[0] + half, t[-1]), max(t[-1] - half, t[0]))
    first = np.minimum(np.searchsorted(t, middle - half - 1e-9), np.maximum(k - 1, 0))
    last = np.maximum(np.searchsorted(t, middle + half + 1e-9) - 1, np.minimum(k + 1, len(t) - 1))
    return np.asarray(np.hypot(*(d[last] - d[first]).T) / np.maximum(t[last] - t[first], 1e-9))


def split_onset(
    recent: list[tuple[float, Array]], parts: list[Array], metres_per_unit: Array, body_cov: Array, known: float
) -> tuple[float, Array]:
    """Returns when, in s, a group began to divide into two parts, and its centroid (2,) at that time, in the points'
    unit."""
    before = [(t, y * metres_per_unit) for t, y in recent if t <= known + 1e-9]
    if len(before) < 2:
        t, y = before[0] if before else (known, parts[0] * metres_per_unit)
        return known, y.mean(0) / metres_per_unit
    middle = np.array([p.mean(0) for p in parts]) * metres_per_unit
    way = middle[1] - middle[0]
    way = metres_per_unit * way / max(float(np.hypot(*way)), 1e-9)
    spread = [max(float(way @ (np.cov(p.T, bias=True) - body_cov) @ way), 0.0) if len(p) > 1 else 0.0 for p in parts]
    reach = REACH * float(np.sqrt(spread).sum())
    times, apart = [], []
    for t, y in reversed(before):
        side = np.square(y[:, None] - middle).sum(2).argmin(1)
        middle = np.array([y[side == k].mean(0) if (side == k).any() else middle[k] for k in range(2)])
        times.append(t)
        apart.append(middle[1] - middle[0])
    when, d = np.array(times[::-1]), np.array(apart[::-1])
    gap = np.hypot(*d.T) - reach
    slow = chords(when, d, SPLIT_CHORD, full_length=True) < SPLIT_VELOCITY
    together = (gap <= MERGE_DISTANCE) | ((gap <= SPLIT_DISTANCE) & slow)
    k = min(int(np.flatnonzero(together)[-1]) + 1 if together.any() else 0, len(when) - 1)
    return float(when[k]), before[k][1].mean(0) / metres_per_unit
