"""What tells whether two people belong together: their distance and motion over time, in steps.

`step_rows` averages positions over steps of at most 0.4 s, and `evidence` returns one row per pair and step with
the quantities of `QUANTITIES` averaged over the past (`TIMES`), and `NEAR`. Nothing looks ahead. Only positions are
used: velocities are chords of positions over 0.8 s. Lengths are in m.

When and where people were first seen is no evidence, nor how many are around: it tells who belongs together in
simulated scenes, and misleads in others. What the nearest others do (`OTHERS`) is evidence for events only: it misleads
about who is together now. For how long two have been near (`NEAR`) is none for events: who has just met has no past.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from sim.truth.merge_split_rules import MERGE_DISTANCE, SPLIT_VELOCITY, close_pairs
from sim.types import Array, Bools, Ints

STEP = 0.4  # s: longest step, unless one frame lasts longer.
CHORD = 0.8  # s over which velocities are measured: two frames of a recording with 2.5 frames/s.
REACH = 4.0  # m: pairs farther apart have no evidence.
STANDING = 0.3  # m/s.
TOUCHING = 0.1  # m: least distance by which the growth of the distance is divided.
TIMES = (0.8, 5.0, 15.0)  # s: means over the past have weights exp(-age / time).
LONGEST = 20.0  # s: longer times near each other tell no more.
# Averaged over the pair's rows, with weights exp(-age / time). Unknown velocities leave nan out of the means.
# velocity difference: of vectors, m/s. sideways, lengthwise: parts of the distance, m, across and along the mean
# velocity of the two where that is at least 0.3 m/s, else the whole distance and nan. growth: of the distance, m/s.
# turn: angle between the two velocities, rad, nan if one is slower than 0.3 m/s. walking difference: the velocity
# difference, m/s, nan where turn is, so that its means outlast a stop. one walks: 1 if exactly one of the two is slower
# than 0.3 m/s, else 0. nearer others: how many other people are nearer to the one than the other is, mean of both.
# common neighbours: third people less than 1.5 m from both, of velocities less than 0.7 m/s apart.
OTHERS = ("nearer others", "common neighbours")
QUANTITIES = (
    "distance", "velocity difference", "sideways", "lengthwise", "growth", "turn", "walking difference", "one walks",
    *OTHERS,
)  # fmt: skip
NEAR = ("time near",)  # Not averaged: the time of the pair's rows so far, s.
# Names of the columns of `PairRows.values`.
NAMES = (*(f"{name}, {time:g} s" for name in QUANTITIES for time in TIMES), *NEAR)
PORTION = 100_000  # Rows worked on together: bounds memory.


@dataclass(frozen=True, slots=True, eq=False)
class PairRows:
    """Evidence about pairs of people, one row per pair and step in which both were seen less than 4 m apart."""

    step: Ints  # (R,): from 0, ascending
    # a, b (R,): columns of the two people, a < b
    a: Ints
    b: Ints
    pair: Ints  # (R,): number of the pair, from 0
    values: Array  # (R, len(NAMES)): columns `NAMES`, nan if unknown


def frames_per_step(fps: float) -> int:
    """Returns the number of frames in a step: the greatest number that lasts at most 0.4 s, and at least 1."""
    return max(1, int(STEP * fps + 1e-9))


@dataclass(frozen=True, slots=True, eq=False)
class StepRows:
    """Where people were seen, one row per person and step, sorted by step, then column."""

    step: Ints  # (R,): from 0
    column: Ints  # (R,): number of the person, from 0
    pos: Array  # (R, 2): mean position in the step, m
    time: Array  # (R,): mean time in the step, s


def step_rows(frame: Ints, column: Ints, pos: Array, length: int, fps: float) -> StepRows:
    """Returns each person's mean position and time in each step.

    frame, column (R,), from 0, pos (R, 2), m: one row per person and frame. With n = `frames_per_step(fps)`, step s
    ends with frame n s, so that step 0 is frame 0 alone. Frames after the last complete step are left out.
    """
    size = frames_per_step(fps)
    steps, step, people = -(-length // size), -(-frame // size), int(column.max(initial=0)) + 1
    whole = step < steps
    key, row, count = np.unique((step * people + column)[whole], return_inverse=True, return_counts=True)
    total = np.stack([np.bincount(row, x[whole], len(key)) for x in (*pos.T, frame / fps)], axis=-1)
    mean = total / count[:, None]
    known = np.isfinite(mean[:, 0])
    key, mean = key[known], mean[known]
    return StepRows(key // people, key % people, mean[:, :2], mean[:, 2])


def step_velocities(seen: StepRows, seconds: float) -> Array:
    """Returns velocities (R, 2), m/s, from a person's earliest position in the last 0.8 s to the present one. They are
    nan without such a position. seconds: per step."""
    vel, people = np.full_like(seen.pos, np.nan), int(seen.column.max(initial=0)) + 1
    key = seen.step * people + seen.column
    for steps in range(1, max(1, round(CHORD / seconds)) + 1):
        before = np.searchsorted(key, key - steps * people)
        now = np.flatnonzero(key[before] == key - steps * people)
        before = before[now]
        vel[now] = (seen.pos[now] - seen.pos[before]) / (seen.time[now] - seen.time[before])[:, None]
    return vel


def evidence(seen: StepRows, seconds: float) -> Iterator[PairRows]:
    """Yields the evidence of all pairs within 4 m, in portions of whole steps, steps ascending. seconds: length of a
    step."""
    motion, step, column, place = step_velocities(seen, seconds), seen.step, seen.column, seen.pos
    i, j = close_pairs(step, place, REACH)
    pair = np.unique(column[i] * (int(column.max(initial=0)) + 1) + column[j], return_inverse=True)[1]
    order = np.lexsort((pair, step[i]))
    i, j, pair = i[order], j[order], pair[order]
    means = ExponentialMeans(int(pair.max(initial=-1)) + 1, seconds)
    for r in _portions(step[i]):
        values = means.add(step[i[r]], pair[r], instant_evidence(place, motion, i[r], j[r]))
        yield PairRows(step[i[r]], column[i[r]], column[j[r]], pair[r], values)


def instant_evidence(pos: Array, vel: Array, i: Ints, j: Ints, *, others: bool = True) -> Array:
    """Returns the `QUANTITIES` (R, 10) of R pairs, for one moment each.

    pos, vel (N, 2), m, m/s: of N rows, one per person and step. i, j (R,): the two rows of each pair; all pairs within
    4 m must be given. others: False leaves the columns `OTHERS` nan, which only beliefs about events need.
    """
    apart, change, mean = pos[j] - pos[i], vel[j] - vel[i], (vel[i] + vel[j]) / 2
    distance, differ, pace = (np.hypot(*x.T) for x in (apart, change, mean))
    walks = pace >= STANDING  # False where nan
    unit = mean / np.where(walks, pace, 1.0)[:, None]
    across = np.abs(apart[:, 0] * unit[:, 1] - apart[:, 1] * unit[:, 0])
    along = np.abs((apart * unit).sum(axis=1))
    speed = np.hypot(*vel.T)
    first, second = speed[i] >= STANDING, speed[j] >= STANDING
    both = first & second
    cosine = (vel[i] * vel[j]).sum(axis=1) / np.where(both, speed[i] * speed[j], 1.0)
    near = np.full((2, len(i)), np.nan)
    if others:
        linked = (distance < MERGE_DISTANCE) & (differ < SPLIT_VELOCITY)
        near[:] = _nearer(i, j, distance), _common(i, j, linked)
    return np.column_stack([
        distance, differ, np.where(walks, across, distance), np.where(walks, along, np.nan),
        (apart * change).sum(axis=1) / np.maximum(distance, TOUCHING),
        np.where(both, np.arccos(np.clip(cosine, -1.0, 1.0)), np.nan),
        np.where(both, differ, np.nan), np.where(np.isfinite(differ), first != second, np.nan),
        *near,
    ])  # fmt: skip


def _nearer(i: Ints, j: Ints, distance: Array) -> Array:
    """Returns how many other rows are nearer to the one of a pair than the other is, mean of both, (R,)."""
    centre, far = np.concatenate([i, j]), np.concatenate([distance, distance])
    order = np.lexsort((far, centre))
    centre, far = centre[order], far[order]
    # who is equally far shares a rank
    further = np.append(True, (np.diff(centre) != 0) | (np.diff(far) > 0))[: len(order)]
    rank = np.empty(len(order))
    rank[order] = np.maximum.accumulate(np.arange(len(order)) * further) - np.searchsorted(centre, centre)
    return np.asarray((rank[: len(i)] + rank[len(i) :]) / 2)


def _common(i: Ints, j: Ints, linked: Bools) -> Array:
    """Returns how many third rows are linked with both of a pair, (R,)."""
    from scipy.sparse import coo_array

    if not len(i):
        return np.zeros(0)
    low, rows = int(i.min()), int(max(i.max(), j.max())) + 1
    near = np.concatenate([i[linked], j[linked]]) - low, np.concatenate([j[linked], i[linked]]) - low
    link = coo_array((np.ones(len(near[0])), near), (rows - low, rows - low)).tocsr()
    return np.asarray((link @ link)[i - low, j - low]).ravel()


def _portions(step: Ints) -> Iterator[slice]:
    low = 0
    while low < len(step):
        high = int(np.searchsorted(step, step[min(low + PORTION, len(step)) - 1], side="right"))
        yield slice(low, high)
        low = high


class ExponentialMeans:
    """Means of the quantities of pairs over their rows so far, weighted by exp(-age / time), for each of the `TIMES`.

    total, weight (K, 10, 3): sums by pair, quantity and time. last (K,): step of a pair's last row; rows (K,): number.
    """

    def __init__(self, pairs: int, seconds: float) -> None:
        self.seconds, self.times = seconds, np.array(TIMES)
        self.total = np.zeros((pairs, len(QUANTITIES), len(TIMES)))
        self.weight = np.zeros_like(self.total)
        self.last, self.rows = np.zeros(pairs, np.int64), np.zeros(pairs, np.int64)

    def add(self, step: Ints, pair: Ints, quantities: Array) -> Array:
        """Adds R rows, steps ascending, and returns the values (R, len(NAMES)) of each row's pair after this row. step,
        pair (R,): step and number of the pair; quantities (R, 10): from `instant_evidence`."""
        from tracking.grouping.belief_kernels import add_to_means

        out, count = np.empty((*quantities.shape, len(self.times))), np.empty(len(step), np.int64)
        times = self.times / self.seconds
        add_to_means(step, pair, quantities, times, self.total, self.weight, self.last, self.rows, out, count)
        return np.column_stack([out.reshape(len(step), -1), np.minimum(count * self.seconds, LONGEST)])

    def take(self, rows: Ints) -> None:
        """Renumbers the pairs: pair k becomes what was pair rows[k], or a new pair without past if rows[k] is -1."""
        new = rows < 0
        for name in ("total", "weight", "last", "rows"):
            table = getattr(self, name)
            taken = np.zeros((len(rows), *table.shape[1:]), table.dtype)
            taken[~new] = table[rows[~new]]
            setattr(self, name, taken)
