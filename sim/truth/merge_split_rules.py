"""The two rules that time changes of membership, and stretches of time in which a rule holds.

Distances are between nearest members, velocities are the parts' means. A stretch of k frames lasts k / fps.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from sim.types import Array, Bools, Ints

MERGE_DISTANCE = 1.5  # m: nearer than this can be a group
MERGE_VELOCITY = 0.5  # m/s: walking together
SPLIT_DISTANCE = 2.5  # m: further is apart, whatever the velocities
SPLIT_VELOCITY = 0.7  # m/s: beyond MERGE_DISTANCE and differing by more is apart
HOLD_TIME = 2.0  # s: how long either rule must hold


def frames_of(seconds: float, fps: float) -> int:
    """Frames that a stretch must have to last `seconds`; at least one."""
    return max(1, math.ceil(seconds * fps - 1e-9))


def holds_for(holds: Bools, frames: int) -> Bools:
    """Where `holds` (T, ...) is true in this and the next frames, `frames` in all; a stretch cut off does not count."""
    if len(holds) < frames:
        return np.zeros_like(holds)
    total = np.concatenate([np.zeros_like(holds[:1], np.int64), np.cumsum(holds, axis=0)])
    out = np.zeros_like(holds)
    out[: len(holds) - frames + 1] = total[frames:] - total[:-frames] == frames
    return out


@dataclass(frozen=True, slots=True, eq=False)
class Separation:
    """Two parts of a crowd over time (T,): distance of nearest members, difference of mean velocities; inf without."""

    distance: Array
    difference: Array

    def together(self) -> Bools:
        """Where the merge rule holds for the moment."""
        return (self.distance < MERGE_DISTANCE) & (self.difference < MERGE_VELOCITY)

    def apart(self) -> Bools:
        """Where the split rule holds for the moment; not where a part is gone."""
        away = (self.distance > MERGE_DISTANCE) & (self.difference > SPLIT_VELOCITY)
        return np.isfinite(self.distance) & ((self.distance > SPLIT_DISTANCE) | away)


def separation(pos: Array, vel: Array, a: Ints, b: Ints) -> Separation:
    """How parts with columns a and b meet; pos, vel (T, P, 2), nan where absent."""
    gap2 = ((pos[:, a, None] - pos[:, None, b]) ** 2).sum(axis=-1).reshape(len(pos), -1)
    gap2 = np.where(np.isnan(gap2), np.inf, gap2).min(axis=1, initial=np.inf)
    difference = np.hypot(*(mean_of_present(vel[:, a]) - mean_of_present(vel[:, b])).T)
    return Separation(np.sqrt(gap2), np.where(np.isnan(difference), np.inf, difference))


def mean_of_present(values: Array) -> Array:
    """Mean (T, 2) over people (T, K, 2) who are there; nan where nobody is."""
    there = np.isfinite(values.sum(axis=-1))
    total = np.where(there[..., None], values, 0.0).sum(axis=1)
    with np.errstate(invalid="ignore"):
        return np.asarray(total / there.sum(axis=1)[:, None])
