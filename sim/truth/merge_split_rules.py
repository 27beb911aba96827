"""The rules that say when two parts of a crowd have merged or split: the one home of their distances, speeds and times.

`separation` measures two parts over time; its methods apply the rules frame by frame; `holds_for` finds the frames from
which a rule holds long enough.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from sim.types import Array, Bools, Ints

MERGE_DISTANCE = 1.5  # m between the nearest members: parts may merge below it
MERGE_VELOCITY = 0.5  # m/s between the mean velocities: parts may merge below it
SPLIT_DISTANCE = 2.5  # m between the nearest members: parts have split beyond it, whatever their velocities
SPLIT_VELOCITY = 0.7  # m/s between the mean velocities: beyond MERGE_DISTANCE, parts have split beyond it
HOLD_TIME = 2.0  # s for which either rule must hold


def frames_of(seconds: float, fps: float) -> int:
    """Returns the number of frames that last `seconds`, rounded up; at least 1."""
    return max(1, math.ceil(seconds * fps - 1e-9))


def holds_for(holds: Bools, frames: int) -> Bools:
    """Returns True in each frame from which `holds` (T, ...) is True for `frames` frames, that frame included.

    The last frames - 1 frames are always False: a stretch that the end of the recording cuts off does not count.
    """
    if len(holds) < frames:
        return np.zeros_like(holds)
    total = np.concatenate([np.zeros_like(holds[:1], np.int64), np.cumsum(holds, axis=0)])
    out = np.zeros_like(holds)
    out[: len(holds) - frames + 1] = total[frames:] - total[:-frames] == frames
    return out


@dataclass(frozen=True, slots=True, eq=False)
class Separation:
    """How far apart two parts of a crowd are in each frame.

    distance (T,): m between the nearest members; velocity_difference (T,): length in m/s of the difference of the mean
    velocities. Both are inf in frames in which a part is absent.
    """

    distance: Array
    velocity_difference: Array

    def merge_rule(self) -> Bools:
        """Returns True (T,) in each frame in which the parts are close enough, and alike enough in velocity, to
        merge.
        """
        return (self.distance < MERGE_DISTANCE) & (self.velocity_difference < MERGE_VELOCITY)

    def split_rule(self) -> Bools:
        """Returns True (T,) in each frame in which the parts are far enough apart to split; False if a part is
        absent.
        """
        leaving = (self.distance > MERGE_DISTANCE) & (self.velocity_difference > SPLIT_VELOCITY)
        return np.isfinite(self.distance) & ((self.distance > SPLIT_DISTANCE) | leaving)


def separation(pos: Array, vel: Array, a: Ints, b: Ints) -> Separation:
    """Returns the separation of the people in columns a from those in columns b.

    pos, vel (T, P, 2): m, m/s, nan where absent. Absent members are left out.
    """
    gap2 = ((pos[:, a, None] - pos[:, None, b]) ** 2).sum(axis=-1).reshape(len(pos), -1)
    gap2 = np.where(np.isnan(gap2), np.inf, gap2).min(axis=1, initial=np.inf)
    difference = np.hypot(*(mean_of_present(vel[:, a]) - mean_of_present(vel[:, b])).T)
    return Separation(np.sqrt(gap2), np.where(np.isnan(difference), np.inf, difference))


def mean_of_present(values: Array) -> Array:
    """Returns the mean (T, 2) of values (T, K, 2) over the K people who are present; nan where none is.

    A person with a nan counts as absent.
    """
    there = np.isfinite(values.sum(axis=-1))
    total = np.where(there[..., None], values, 0.0).sum(axis=1)
    with np.errstate(invalid="ignore"):
        return np.asarray(total / there.sum(axis=1)[:, None])
