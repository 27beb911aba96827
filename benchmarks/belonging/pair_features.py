"""Features of two people from which a grouping rule could tell who walks with whom. They never look ahead.

`pair_features` is the entry. Velocities are chords of positions over the last 0.5 s, rounded up to whole frames, as
tracks without velocities get them: over 0.8 s with 2.5 frames/s.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from sim.io.formats.velocity import chords
from sim.truth.proximity import close_pairs
from sim.types import Array, Ints
from tracking.grouping.pair_evidence import ExponentialMeans

REACH = 5.0  # m: pairs that are never nearer are left out
NEAR = 1.2  # m
AROUND = 3.0  # m
STANDING = 0.3  # m/s
TIMES = (0.8, 2.0, 5.0, 15.0)  # s
FAMILIES = ("distance", "velocity difference", "share near", "sideways")
ARRIVAL = ("time seen", "first distance", "arrival gap", "others", "speed")
NAMES = (*(f"{family}, {time:g} s" for family in FAMILIES for time in TIMES), *ARRIVAL)
"""Names of the columns of `Pairs.features`. Columns of one family have the family as the text before the comma."""


@dataclass(frozen=True)
class Pairs:
    """Pairs of people, one row per pair and frame in which both are present, sorted by frame, then a, then b.

    frame, a, b (R,): frame and the two ids, a < b. features (R, 21): columns `NAMES`.

    - distance (m), velocity difference (m/s), share near (distance < 1.2 m: 1, else 0) and sideways (m): means over
      the pair's rows up to this one, weighted by exp(-age / time). Frames without a velocity do not enter the mean of
      the velocity difference; it is nan if no frame has one. sideways: the part of the distance that is perpendicular
      to the mean velocity of the two; the whole distance where that velocity is unknown or slower than 0.3 m/s.
    - time seen (s): since the first frame of the one who came later. first distance (m): in the pair's first frame.
      arrival gap (s): between the first frames of the two.
    - others: number of other people less than 3 m from the middle of the pair. speed (m/s): mean of the two speeds,
      nan if one is unknown.
    """

    frame: Ints
    a: Ints
    b: Ints
    features: Array


def pair_features(frame: Ints, id: Ints, pos: Array, fps: float) -> Pairs:
    """Returns the features of all pairs of people that are less than 5 m apart in some frame.

    frame, id (R,), pos (R, 2): one row per person and frame, sorted by frame; pos in m. fps: frames per second.
    """
    i, j = close_pairs(frame, pos, np.inf)
    swap = id[i] > id[j]
    i, j = np.where(swap, j, i), np.where(swap, i, j)
    people, column = np.unique(id, return_inverse=True)
    pair = column[i] * len(people) + column[j]
    kept = np.isin(pair, pair[np.hypot(*(pos[i] - pos[j]).T) < REACH])
    i, j, pair = i[kept], j[kept], pair[kept]
    order = np.lexsort((pair, frame[i]))
    i, j = i[order], j[order]
    _, first_row, pair = np.unique(pair[order], return_index=True, return_inverse=True)
    t, vel = frame[i], chords(frame, id, pos, fps)
    now = _instant(pos[i] - pos[j], vel[i], vel[j])
    first = np.full(len(people), np.iinfo(np.int64).max)
    np.minimum.at(first, column, frame)
    came = np.stack([first[column[i]], first[column[j]]])
    speed = np.hypot(*vel.T)
    arrival = [
        (t - came.max(axis=0)) / fps,
        now[first_row[pair], 0],
        np.abs(came[0] - came[1]) / fps,
        _others(frame, pos, i, j),
        (speed[i] + speed[j]) / 2,
    ]
    means = ExponentialMeans(len(first_row), len(FAMILIES), 1 / fps, TIMES).add(t, pair, now)
    return Pairs(t, id[i], id[j], np.column_stack([means, *arrival]))


def _instant(apart: Array, vel_a: Array, vel_b: Array) -> Array:
    """Returns distance, velocity difference, share near and sideways of each row at its own frame, (R, 4)."""
    distance = np.hypot(*apart.T)
    mean = (vel_a + vel_b) / 2
    pace = np.hypot(*mean.T)
    across = np.abs(apart[:, 0] * mean[:, 1] - apart[:, 1] * mean[:, 0]) / np.where(pace > 0, pace, 1.0)
    sideways = np.where(pace >= STANDING, across, distance)  # False where nan
    return np.column_stack([distance, np.hypot(*(vel_a - vel_b).T), distance < NEAR, sideways])


def _others(frame: Ints, pos: Array, i: Ints, j: Ints) -> Ints:
    """Returns the number of people other than i and j less than AROUND from their middle, (R,)."""
    apart = np.abs(pos).max(initial=0.0) * 2 + 2 * AROUND  # frames lie this far apart along a third axis
    tree = cKDTree(np.column_stack([pos, frame * apart]))
    middle = np.column_stack([(pos[i] + pos[j]) / 2, frame[i] * apart])
    count = tree.query_ball_point(middle, AROUND, return_length=True)
    return np.asarray(count - 2 * (np.hypot(*(pos[i] - pos[j]).T) / 2 <= AROUND))
