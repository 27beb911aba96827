"""What tells whether two people belong together: distances, motion and surroundings of pairs over time, in steps.

`step_positions` averages positions over steps of at most 0.4 s, and `evidence` returns one row per pair and step with
the quantities of `QUANTITIES` averaged over the past (`TIMES`), and `NOW`. Nothing looks ahead. Only positions are
used: velocities are chords of positions over 0.8 s. Lengths are in m.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from sim.truth.merge_split_rules import MERGE_DISTANCE, MERGE_VELOCITY, SPLIT_VELOCITY, close_pairs
from sim.types import Array, Ints

STEP = 0.4  # s: longest step, unless one frame lasts longer.
CHORD = 0.8  # s over which velocities are measured: two frames of a recording with 2.5 frames/s.
REACH = 4.0  # m: pairs farther apart have no evidence.
AROUND = 3.0  # m: others nearer than this to one of the pair are counted.
STANDING = 0.3  # m/s.
TOUCHING = 0.1  # m: least distance by which the growth of the distance is divided.
TIMES = (0.8, 5.0, 15.0)  # s: means over the past have weights exp(-age / time).
# Averaged over the pair's rows, with weights exp(-age / time). Unknown velocities leave nan out of the means.
# velocity difference: of vectors, m/s. sideways, lengthwise: parts of the distance, m, across and along the mean
# velocity of the two where that is at least 0.3 m/s, else the whole distance and nan. others: mean of the two numbers
# of other people within 3 m. stream: of the people other than the pair within 4 m of one of them, the share whose
# velocity differs from that person's by less than 0.5 m/s. speed: mean of the two. rank: how many other people are
# nearer to the one than the other is, mean of both. growth: of the distance, m/s. turn: angle between the two
# velocities, rad, nan if one is slower than 0.3 m/s. common: third people less than 1.5 m from both, of velocities
# less than 0.7 m/s apart.
QUANTITIES = (
    "velocity difference", "sideways", "lengthwise", "others", "stream", "speed", "rank", "growth", "turn", "common",
)  # fmt: skip
# Not averaged: distance, m, of the row; arrival gap, s, between the steps in which the two were first seen; first
# distance, m, when both had been seen. The last two are nan if that was step 0: people were there before.
NOW = ("distance", "arrival gap", "first distance")
# Names of the columns of `PairRows.values`.
NAMES = (*(f"{name}, {time:g} s" for name in QUANTITIES for time in TIMES), *NOW)
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
    """Returns the number of frames in a step: as many as last at most 0.4 s, at least one. fps: frames per second."""
    return max(1, int(STEP * fps + 1e-9))


def step_positions(frame: Ints, column: Ints, pos: Array, length: int, people: int, fps: float) -> tuple[Array, Array]:
    """Returns each person's mean position (S, people, 2), m, and time (S, people), s, in each step; nan if not seen.

    Step s ends with the frame s `frames_per_step(fps)`: the first one is the first frame alone. Frames after the end of
    the last step are left out.
    """
    size = frames_per_step(fps)
    steps, step = -(-length // size), -(-frame // size)
    whole = step < steps
    key = (step * people + column)[whole]
    count = np.bincount(key, minlength=steps * people)
    total = np.stack([np.bincount(key, x[whole], steps * people) for x in (*pos.T, frame / fps)], axis=-1)
    mean = np.full(total.shape, np.nan)
    np.divide(total, count[:, None], out=mean, where=count[:, None] > 0)
    by_person = mean.reshape(steps, people, 3)
    return by_person[..., :2], by_person[..., 2]


def step_velocities(pos: Array, time: Array, seconds: float) -> Array:
    """Returns velocities (S, P, 2), m/s: chords from a person's earliest position within the last 0.8 s; else nan."""
    vel = np.full_like(pos, np.nan)
    for steps in range(1, min(max(1, round(CHORD / seconds)), len(pos) - 1) + 1):
        chord = (pos[steps:] - pos[:-steps]) / (time[steps:] - time[:-steps])[..., None]
        np.copyto(vel[steps:], chord, where=np.isfinite(chord))
    return vel


def evidence(pos: Array, time: Array, seconds: float) -> Iterator[PairRows]:
    """Yields the rows of all pairs in portions of whole steps; pos (S, P, 2), time (S, P): from `step_positions`."""
    vel = step_velocities(pos, time, seconds)
    step, column = np.nonzero(np.isfinite(pos[..., 0]))
    place, motion = pos[step, column], vel[step, column]
    i, j = close_pairs(step, place, REACH)
    people = pos.shape[1]
    pair = np.unique(column[i] * people + column[j], return_inverse=True)[1]
    count = int(pair.max(initial=-1)) + 1
    order = np.lexsort((pair, step[i]))
    i, j, pair = i[order], j[order], pair[order]
    first = np.full(people, len(pos), np.int64)
    np.minimum.at(first, column, step)
    came = np.stack([first[column[i]], first[column[j]]])
    late = came.max(axis=0)
    apart = np.hypot(*(pos[late, column[i]] - pos[late, column[j]]).T)
    gap = arrival_gap(came, seconds)
    apart = np.where(late > 0, apart, np.nan)
    means = ExponentialMeans(count, len(QUANTITIES), seconds)
    for r in _portions(step[i]):
        distance, quantities = instant_evidence(place, motion, i[r], j[r])
        averaged = means.add(step[i[r]], pair[r], quantities)
        values = np.column_stack([averaged, distance, gap[r], apart[r]])
        yield PairRows(step[i[r]], column[i[r]], column[j[r]], pair[r], values)


def arrival_gap(came: Array | Ints, seconds: float) -> Array:
    """Returns the time, s, (R,) between the steps (2, R) in which two were first seen; nan if one was in step 0."""
    return np.where(came.min(axis=0) > 0, np.abs(came[0] - came[1]) * seconds, np.nan)


def instant_evidence(pos: Array, vel: Array, i: Ints, j: Ints) -> tuple[Array, Array]:
    """Returns the distance (R,) and `QUANTITIES` (R, 10) of each pair of rows i, j at its own step.

    pos, vel (N, 2): m, m/s, one row per person and step. i, j (R,): all pairs within 4 m in some steps.
    """
    from tracking.grouping.belief_kernels import common_neighbours

    low = int(min(i.min(), j.min()))
    rows = slice(low, int(max(i.max(), j.max())) + 1)
    i, j, pos, vel = i - low, j - low, pos[rows], vel[rows]
    apart, change, mean = pos[j] - pos[i], vel[j] - vel[i], (vel[i] + vel[j]) / 2
    distance, differ, pace = (np.hypot(*x.T) for x in (apart, change, mean))
    walks = pace >= STANDING  # False where nan
    unit = mean / np.where(walks, pace, 1.0)[:, None]
    across = np.abs(apart[:, 0] * unit[:, 1] - apart[:, 1] * unit[:, 0])
    along = np.abs((apart * unit).sum(axis=1))
    around, alike = distance < AROUND, differ < MERGE_VELOCITY
    within, near, same = (_per_row(i, j, x, len(pos)) for x in (np.ones_like(alike), around, alike))
    others = within[i] + within[j] - 2
    stream = np.full(len(i), np.nan)
    np.divide(same[i] + same[j] - 2 * alike, others, out=stream, where=others > 0)
    speed = np.hypot(*vel.T)
    both = (speed[i] >= STANDING) & (speed[j] >= STANDING)
    cosine = (vel[i] * vel[j]).sum(axis=1) / np.where(both, speed[i] * speed[j], 1.0)
    linked = (distance < MERGE_DISTANCE) & (differ < SPLIT_VELOCITY)
    return distance, np.column_stack([
        differ, np.where(walks, across, distance), np.where(walks, along, np.nan), (near[i] + near[j]) / 2 - around,
        stream, (speed[i] + speed[j]) / 2, _rank(i, j, distance),
        (apart * change).sum(axis=1) / np.maximum(distance, TOUCHING),
        np.where(both, np.arccos(np.clip(cosine, -1.0, 1.0)), np.nan), common_neighbours(i, j, linked, len(pos)),
    ])  # fmt: skip


def _per_row(i: Ints, j: Ints, flag: Array, rows: int) -> Array:
    return np.asarray(np.bincount(i[flag], minlength=rows) + np.bincount(j[flag], minlength=rows))


def _rank(i: Ints, j: Ints, distance: Array) -> Array:
    """Returns for each pair how many other rows are nearer to the one than the other is, mean of both, (R,)."""
    centre, far = np.concatenate([i, j]), np.concatenate([distance, distance])
    order = np.lexsort((far, centre))
    centre, far = centre[order], far[order]
    other = np.ones(len(order), bool)
    other[1:] = (np.diff(centre) != 0) | (np.diff(far) > 0)
    nearest = np.maximum.accumulate(np.where(other, np.arange(len(order)), 0))
    rank = np.empty(len(order))
    rank[order] = nearest - np.searchsorted(centre, centre)
    return np.asarray((rank[: len(i)] + rank[len(i) :]) / 2)


def _portions(step: Ints) -> Iterator[slice]:
    low = 0
    while low < len(step):
        high = int(np.searchsorted(step, step[min(low + PORTION, len(step)) - 1], side="right"))
        yield slice(low, high)
        low = high


class ExponentialMeans:
    """Means of the values of pairs over their rows so far, weighted by exp(-age / time), for each of the T `TIMES`."""

    def __init__(self, pairs: int, values: int, seconds: float) -> None:
        self.seconds, self.times = seconds, np.array(TIMES)
        self.total = np.zeros((pairs, values, len(TIMES)))
        self.weight, self.last = np.zeros_like(self.total), np.zeros(pairs, np.int64)

    def add(self, step: Ints, pair: Ints, values: Array) -> Array:
        """Adds rows, steps ascending, and returns the means of their pairs (R, V * T), times varying fastest."""
        from tracking.grouping.belief_kernels import add_to_means

        out = np.empty((*values.shape, len(self.times)))
        add_to_means(step, pair, values, self.times / self.seconds, self.total, self.weight, self.last, out)
        return out.reshape(len(step), values.shape[1] * len(self.times))

    def take(self, rows: Ints) -> None:
        """Makes the pairs those of the rows (K',), -1 for a new one."""
        new = rows < 0
        for name in ("total", "weight", "last"):
            table = getattr(self, name)
            taken = np.zeros((len(rows), *table.shape[1:]), table.dtype)
            taken[~new] = table[rows[~new]]
            setattr(self, name, taken)
