"""Values of a scenario that change while it is recorded."""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from sim.types import Array, Bools, Truth

if TYPE_CHECKING:
    from scenarios.schema.schedule import Schedule

ROUNDING = 1e-9  # frames: by so much a sum of steps may miss a whole number


def values_at(value: float | Schedule, t: Array) -> Array:
    """Returns a value of the scenario at the times t (N,), s after the first frame; before it, as in it. (N,)"""
    if isinstance(value, (int, float)):
        return np.full(len(t), float(value))
    found = np.full(len(t), float(value.value[0]))
    for at, (before, after) in zip(value.at[1:], pairwise(value.value), strict=True):
        share = np.clip((t - at) / value.ramp, 0.0, 1.0) if value.ramp else (t >= at).astype(float)
        # a sum of changes would miss the last value by its rounding, and could fall below 0
        found = np.where(t >= at, np.where(share < 1.0, before + share * (after - before), after), found)
    return found


def at_rows(value: float | Schedule, truth: Truth) -> Array:
    """Returns a value of the scenario in the frame of each row of a truth, (R,)."""
    return values_at(value, (truth.frame - 1) / truth.fps)


def looked_at(every: float | Schedule | None, length: int, fps: float) -> Bools:
    """Returns True (length,) for the frames at which a detector looks, of the frames 1 to `length`: the first, and then
    each `every`-th; None: all."""
    if every is None:
        return np.ones(length, bool)
    steps = 1.0 / values_at(every, np.arange(length) / fps)
    passed = np.floor(np.concatenate([[0.0], np.cumsum(steps)[:-1]]) + ROUNDING) if length else steps
    return np.diff(passed, prepend=-1.0) > 0
