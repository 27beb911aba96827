"""The rules that say when two parts of a crowd have merged or split: the one home of their distances, speeds and times.

Merged: nearest members less than 1.5 m apart, mean velocities differing by less than 0.5 m/s. Split: more than 2.5 m
apart, or 1.5 m with velocities differing by more than 0.7 m/s. Both must hold for 2 s. `separation` measures two parts
over time; its methods apply the rules frame by frame; `holds_for` finds the frames from which a rule holds long enough.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from sim.elementary import dot, length
from sim.types import Array, Bools, Ints

MERGE_DISTANCE = 1.5  # m between the nearest members: parts may merge below it
MERGE_VELOCITY = 0.5  # m/s between the mean velocities: parts may merge below it
SPLIT_DISTANCE = 2.5  # m between the nearest members: parts have split beyond it, whatever their velocities
SPLIT_VELOCITY = 0.7  # m/s between the mean velocities: beyond MERGE_DISTANCE, parts have split beyond it
HOLD_TIME = 2.0  # s for which either rule must hold


def frames_of(seconds: float, fps: float) -> int:
    """Returns the number of frames that last `seconds`, rounded up, at least 1."""
    # Rounding errors of a whole number of frames do not count.
    return max(1, math.ceil(seconds * fps - 1e-9))


def holds_for(holds: Bools, frames: int) -> Bools:
    """Returns for each frame whether `holds` (T, ...) is True in it and in the next frames - 1 frames."""
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
        """Returns the frames in which the merge rule holds (T,)."""
        return (self.distance < MERGE_DISTANCE) & (self.velocity_difference < MERGE_VELOCITY)

    def split_rule(self) -> Bools:
        """Returns the frames in which the split rule holds (T,)."""
        leaving = (self.distance > MERGE_DISTANCE) & (self.velocity_difference > SPLIT_VELOCITY)
        return np.isfinite(self.distance) & ((self.distance > SPLIT_DISTANCE) | leaving)


def separation(pos: Array, vel: Array, a: Ints, b: Ints) -> Separation:
    """Returns how far apart the people in columns a and those in columns b are in each frame.

    pos, vel (T, P, 2): m, m/s, nan while absent.
    """
    gap = pos[:, a, None] - pos[:, None, b]
    gap2 = dot(gap, gap).reshape(len(pos), -1)
    gap2 = np.where(np.isnan(gap2), np.inf, gap2).min(axis=1, initial=np.inf)
    difference = length(mean_of_present(vel[:, a]) - mean_of_present(vel[:, b]))
    return Separation(np.sqrt(gap2), np.where(np.isnan(difference), np.inf, difference))


def mean_of_present(values: Array) -> Array:
    """Returns the mean (T, 2) of values (T, K, 2) over the people with finite values; nan if none has."""
    there = np.isfinite(values.sum(axis=-1))
    total = np.where(there[..., None], values, 0.0).sum(axis=1)
    with np.errstate(invalid="ignore"):
        return np.asarray(total / there.sum(axis=1)[:, None])
