"""When it began: onsets of merges and splits, looked at afterwards (ours).

A split is known when its parts have long been apart, a merge when velocities have settled in the filters. What a group
was then is known better now: chords through the centroids before and after do not lag, and of a group that fell into
parts it can be told whose its earlier points were. Distances are on the ground (depth is foreshortened in an image).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sim.types import Array

MEETING, LEAVING = 0.7, 0.4
"""s before and after, over which a velocity is a chord: whole groups turn slowly, and bodies hide each other as they
meet; a part leaves at once."""
ALIKE = 1.2
"""Of the velocities that may differ: chords across a meeting are still those of before in part."""
APART, FAR_APART, PARTING = 1.5, 2.5, 0.7
"""m between the nearest, with and without velocities that differ by so many m/s, from which on parts of a group count
as apart (docs/formats.md, split)."""
REACH = 1.1
"""From the middle of people in a row to the last one, in standard deviations: 1 for two, 1.2 for three."""


@dataclass
class Encounter:
    """Two groups near each other: since when they have been equally fast, too (inf: they are not), and how they stood
    to each other, (time, difference of centroids on the ground, middle between them, distance of the nearest people).
    """

    since: float
    path: list[tuple[float, Array, Array, float]]

    def onset(self, speed: float) -> tuple[float, Array]:
        """When they became near and equally fast, and where; speed: by which groups that merge may differ."""
        t, d = np.array([p[0] for p in self.path]), np.array([p[1] for p in self.path])
        fast = (chords(t, d, MEETING) > ALIKE * speed) & (t <= self.since)
        fast |= np.array([p[3] for p in self.path]) > APART
        k = min(int(np.flatnonzero(fast)[-1]) + 1 if fast.any() else 0, len(t) - 1)
        return float(t[k]), self.path[k][2]


def chords(t: Array, d: Array, half: float, *, whole: bool = False) -> Array:
    """(K,) speeds over `half` s before and after each of the times t (K,), one frame at least, of places d (K, 2).

    At the ends chords are shorter, and so noisier; whole: they are as long as elsewhere, but not about their times.
    """
    k, middle = np.arange(len(t)), t
    if whole:
        middle = np.clip(t, min(t[0] + half, t[-1]), max(t[-1] - half, t[0]))
    first = np.minimum(np.searchsorted(t, middle - half - 1e-9), np.maximum(k - 1, 0))
    last = np.maximum(np.searchsorted(t, middle + half + 1e-9) - 1, np.minimum(k + 1, len(t) - 1))
    return np.asarray(np.hypot(*(d[last] - d[first]).T) / np.maximum(t[last] - t[first], 1e-9))


def parting(
    past: list[tuple[float, Array]], parts: list[Array], ground: Array, person: Array, since: float
) -> tuple[float, Array]:
    """When a group whose points were `past` began to fall into two sets of points, and where it was.

    Back from `since`, the points of each moment go to the nearer of the two middles, which follow them; the nearest
    people of the parts are taken to have been as much nearer than the middles as they are now. person (2, 2): the
    covariance of one person's points.
    """
    before = [(t, y * ground) for t, y in past if t <= since + 1e-9]
    if len(before) < 2:
        t, y = before[0] if before else (since, parts[0] * ground)
        return since, y.mean(0) / ground
    middle = np.array([p.mean(0) for p in parts]) * ground
    way = middle[1] - middle[0]
    way = ground * way / max(float(np.hypot(*way)), 1e-9)
    spread = [max(float(way @ (np.cov(p.T, bias=True) - person) @ way), 0.0) if len(p) > 1 else 0.0 for p in parts]
    reach = REACH * float(np.sqrt(spread).sum())
    times, apart = [], []
    for t, y in reversed(before):
        side = np.square(y[:, None] - middle).sum(2).argmin(1)
        middle = np.array([y[side == k].mean(0) if (side == k).any() else middle[k] for k in range(2)])
        times.append(t)
        apart.append(middle[1] - middle[0])
    when, d = np.array(times[::-1]), np.array(apart[::-1])
    gap = np.hypot(*d.T) - reach
    together = (gap <= APART) | ((gap <= FAR_APART) & (chords(when, d, LEAVING, whole=True) < PARTING))
    k = min(int(np.flatnonzero(together)[-1]) + 1 if together.any() else 0, len(when) - 1)
    return float(when[k]), before[k][1].mean(0) / ground
