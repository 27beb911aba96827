"""Onsets of merges of `group-pda`: when a merge that is known now began (ours).

A merge is known when the filters' velocities have settled. Afterwards the onset can be measured better: from chords
through earlier and later centroids, which do not lag. Distances are metres on the ground (in an image depth is
stretched to it). The distance of the truth's rule comes from sim.truth.merge_split_rules.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from sim.truth.merge_split_rules import MERGE_DISTANCE
from sim.types import Array

MERGE_CHORD = 0.7
"""s before and after a moment over which a velocity is a chord."""
MERGE_CHORD_MARGIN = 1.2
"""Factor on the velocity at which groups merge: a chord across the onset still contains motion from before it."""


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
        """Return when, in s, the groups came to be near with like velocities, and where (2,), in the points' unit:
        half-way between the centroids.

        merge_velocity: m/s. The onset is the moment after the last one in which the pair was not yet near and alike;
        the first moment if there is none, the last moment at the latest. Not near: the gap between nearest people is
        above 1.5 m. Not alike: the velocity difference, by chords from 0.7 s before to 0.7 s after, is above 1.2
        merge_velocity; only moments up to `alike_since` count. There must be a moment (else TypeError).
        """
        t, d = np.array([m.t for m in self.moments]), np.array([m.difference for m in self.moments])
        before = (chords(t, d, MERGE_CHORD) > MERGE_CHORD_MARGIN * merge_velocity) & (t <= self.alike_since)
        before |= np.array([m.gap for m in self.moments]) > MERGE_DISTANCE
        k = min(int(np.flatnonzero(before)[-1]) + 1 if before.any() else 0, len(t) - 1)
        return float(t[k]), self.moments[k].middle


def chords(t: Array, d: Array, half: float) -> Array:
    """Return speeds (K,) of the positions d (K, 2) at the times t (K,), s, ascending: chords from `half` s before to
    after.

    Unit: that of d per s. A chord spans at least one frame to each side if there is one. At both ends of the series
    chords are shorter. A single position has speed 0. None give an empty array.
    """
    k = np.arange(len(t))
    first = np.minimum(np.searchsorted(t, t - half - 1e-9), np.maximum(k - 1, 0))
    last = np.maximum(np.searchsorted(t, t + half + 1e-9) - 1, np.minimum(k + 1, len(t) - 1))
    return np.asarray(np.hypot(*(d[last] - d[first]).T) / np.maximum(t[last] - t[first], 1e-9))
