"""The rules that say when two parts of a crowd have merged or split: the one home of their distances, speeds and times.

Merged: nearest members less than 1.5 m apart, mean velocities differing by less than 0.5 m/s. Split: more than 2.5 m
apart, or 1.5 m with velocities differing by more than 0.7 m/s. Both must hold for 2 s. Where a wall is between two
people, their distance is that of walking round it. `separation` measures two parts over time; its methods apply the
rules frame by frame; `holds_for` finds the frames from which a rule holds long enough.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from sim.elementary import dot, length
from sim.geometry.walls import distances_round
from sim.truth.motion_rows import MotionRows
from sim.types import Array, Bools, Ints, Near

MERGE_DISTANCE = 1.5  # m between the nearest members: parts may merge below it
MERGE_VELOCITY = 0.5  # m/s between the mean velocities: parts may merge below it
SPLIT_DISTANCE = 2.5  # m between the nearest members: parts have split beyond it, whatever their velocities
SPLIT_VELOCITY = 0.7  # m/s between the mean velocities: beyond MERGE_DISTANCE, parts have split beyond it
HOLD_TIME = 2.0  # s for which either rule must hold


def frames_of(seconds: float, fps: float) -> int:
    """Returns the number of frames that last `seconds` s at fps frames/s, rounded up, at least 1."""
    # Rounding errors of a whole number of frames do not count.
    return max(1, math.ceil(seconds * fps - 1e-9))


def holds_for(holds: Bools, frames: int) -> Bools:
    """Returns flags (T, ...): True where `holds` (T, ...) is True in this frame and the next `frames` - 1."""
    if len(holds) < frames:
        return np.zeros_like(holds)
    total = np.concatenate([np.zeros_like(holds[:1], np.int64), np.cumsum(holds, axis=0)])
    out = np.zeros_like(holds)
    # A stretch that the end of the recording cuts off does not count.
    out[: len(holds) - frames + 1] = total[frames:] - total[:-frames] == frames
    return out


@dataclass(frozen=True, slots=True, eq=False)
class Separation:
    """How far apart two parts of a crowd are in each of T frames; or pairs of parts, arrays of any shape."""

    distance: Array  # (T,) m between the nearest members
    # (T,) length in m/s of the difference of the mean velocities. Both are inf in frames in which a part is absent.
    velocity_difference: Array

    def merge_rule(self) -> Bools:
        """Returns flags (T,): True in the frames in which the merge rule holds."""
        return (self.distance < MERGE_DISTANCE) & (self.velocity_difference < MERGE_VELOCITY)

    def split_rule(self) -> Bools:
        """Returns flags (T,): True in the frames in which the split rule holds; False if a part is absent."""
        leaving = (self.distance > MERGE_DISTANCE) & (self.velocity_difference > SPLIT_VELOCITY)
        return np.isfinite(self.distance) & ((self.distance > SPLIT_DISTANCE) | leaving)


def separation(
    pos: Array, vel: Array, a: Ints, b: Ints, walls: tuple[tuple[int, Array], ...] = (), first: int = 0
) -> Separation:
    """Returns the Separation of two parts of a crowd, the people in columns a and those in columns b, in each frame.

    pos, vel (T, P, 2): m, m/s, nan while absent, from frame `first` on. walls: as of MotionRows; the distance is that
    of walking round them.
    """
    gap = pos[:, a, None] - pos[:, None, b]
    gap2 = dot(gap, gap)
    gap2 = np.where(np.isnan(gap2), np.inf, gap2)
    for k, (since, there) in enumerate(walls):
        if not len(there):
            continue
        until = walls[k + 1][0] if k + 1 < len(walls) else first + len(pos)
        near = gap2 < SPLIT_DISTANCE * SPLIT_DISTANCE
        near[: max(since - first, 0)] = near[max(until - first, 0) :] = False
        t, i, j = np.nonzero(near)
        way = distances_round(pos[t, a[i]], pos[t, b[j]], there)
        gap2[near] = way * way
    gap2 = gap2.reshape(len(pos), -1).min(axis=1, initial=np.inf)
    difference = length(mean_of_present(vel[:, a]) - mean_of_present(vel[:, b]))
    return Separation(np.sqrt(gap2), np.where(np.isnan(difference), np.inf, difference))


def mean_of_present(values: Array) -> Array:
    """Returns the mean (T, 2) of values (T, K, 2) over those of K people whose values are finite; nan without any."""
    there = np.isfinite(values.sum(axis=-1))
    total = np.where(there[..., None], values, 0.0).sum(axis=1)
    with np.errstate(invalid="ignore"):
        return np.asarray(total / there.sum(axis=1)[:, None])


def close_pairs(frame: Ints, pos: Array, reach: float) -> tuple[Ints, Ints]:
    """Returns the indices i and j, (K,) each, of all pairs of rows in the same frame that are less than `reach` apart.

    i < j, and pairs are sorted by i, then j. frame (R,): ascending. pos (R, 2): finite, in the unit of `reach`.
    """
    from scipy.spatial import cKDTree

    # One tree for all frames, which lie further apart than `reach` along its first axis. It only proposes pairs: the
    # result is the same on every processor.
    tree = cKDTree(np.column_stack([frame * (2 * reach), pos]))
    i, j = tree.query_pairs(reach * (1 + 1e-9), output_type="ndarray").T
    apart = pos[i] - pos[j]
    close = dot(apart, apart) < reach * reach
    i, j = i[close], j[close]
    order = np.lexsort((j, i))
    return i[order], j[order]


def runs(first: Ints, end: Ints) -> tuple[Ints, Ints]:
    """Returns all pairs (k, first[k]), (k, first[k] + 1) … (k, end[k] - 1) for k = 0, 1, …, as two arrays."""
    n = np.maximum(end - first, 0)
    i = np.repeat(np.arange(len(n)), n)
    return i, np.arange(len(i)) - np.repeat(np.cumsum(n) - n, n) + first[i]


def stretches(pair: Ints, frame: Ints, least: int, bridge: int = 1) -> tuple[Ints, Ints, Ints]:
    """Returns pair, first frame and last frame, (S,) each, of all stretches of at least `least` frames.

    pair, frame (K,): rows sorted by pair, then frame. A stretch has rows of one pair; the difference of one frame to
    the next is at most `bridge`. The result is sorted by pair, then frame.
    """
    if not len(pair):
        return pair, frame, frame
    new = np.concatenate([[True], (np.diff(pair) != 0) | (np.diff(frame) > bridge)])
    start = np.flatnonzero(new)
    end = np.append(start[1:], len(pair)) - 1
    long = frame[end] - frame[start] + 1 >= least
    return pair[start[long]], frame[start[long]], frame[end[long]]


def longest_time(holds: Bools, rate: float, bridge: float = 0.0) -> float:
    """Returns the longest time in s for which flags (T,) are True. rate: flags per s. bridge: longest gap to bridge."""
    frame = np.flatnonzero(holds)
    _, first, last = stretches(np.zeros_like(frame), frame, 1, max(1, frames_of(bridge, rate)))
    return float((last - first + 1).max(initial=0)) / rate


def strangers(motion: MotionRows, group: Ints, fps: float) -> Near:
    """Returns the stretches of time in which two people satisfy the merge rule but do not belong together.

    They do not belong together where their intents differ and they are not in one group. motion: with the intents as
    `group`. group (R,): the measured group ids of its rows, -1 = alone.
    """
    rows = np.lexsort((motion.column, motion.frame))
    i, j = (rows[k] for k in close_pairs(motion.frame[rows], motion.pos[rows], MERGE_DISTANCE))
    differ = length(motion.vel[i] - motion.vel[j])
    # Two people of one group that has not split yet are no strangers.
    same_group = (group[i] >= 0) & (group[i] == group[j])
    kept = (differ < MERGE_VELOCITY) & (motion.group[i] != motion.group[j]) & ~same_group
    i, j, people = i[kept], j[kept], int(motion.column.max(initial=0)) + 1
    t, pair = motion.frame[i], motion.column[i] * people + motion.column[j]
    order = np.lexsort((t, pair))
    pair, first, last = stretches(pair[order], t[order], frames_of(HOLD_TIME, fps))
    order = np.lexsort((pair, first))
    pair, first, last = pair[order], first[order], last[order]
    return Near(first + 1, last + 1, pair // people + 1, pair % people + 1)
