"""Curves of a score over an axis, and breaking points with their intervals.

Scores are paired: P scenes (scenario and seed), each played at the same values of the axis with the same random
numbers. The *height* of a scene is its score less a share of its score at the easy end. Its mean over scenes has a
95 % interval at each value, Student's. Between values all three are linear, and the first value, from easy to hard, at
which one falls to 0 is:

    of the mean            the breaking point
    of the lower end       the low end of its interval: the first value at which the curve may have broken
    of the upper end       the high end: the first value at which it surely has; unknown if there is none

The interval also holds the two values beside the breaking point, as the curve between them is not known. One scene
gives no interval.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sim.types import Array
from tracking.stats import mean_interval

NEVER = np.inf


@dataclass(frozen=True)
class BreakingPoint:
    """Where a curve crosses a level, as a share of the way from easy (0) to hard (1); inf: it does not."""

    at: float
    low: float
    high: float


def curve(scores: Array) -> Array:
    """Returns the mean over scenes (V,) of scores (P, V), nan where unknown; nan for a value without any."""
    known = np.isfinite(scores)
    count = known.sum(axis=0)
    return np.where(count > 0, np.where(known, scores, 0.0).sum(axis=0) / np.maximum(count, 1), np.nan)


def crossing(way: Array, height: Array) -> float:
    """Returns where a curve first falls to 0, linear between its values (V,); inf if it does not."""
    known = np.isfinite(height)
    way, height = way[known], height[known]
    below = np.flatnonzero(height <= 0)
    if not len(below):
        return NEVER
    k = int(below[0])
    if k == 0:
        return float(way[0])
    a, b = height[k - 1], height[k]
    return float(way[k - 1] + (way[k] - way[k - 1]) * a / (a - b))


def breaking_point(way: Array, scores: Array, share: float) -> BreakingPoint:
    """Returns where the curve of scores (P, V) at `way` (V,), ascending from 0, falls to a share of its easy value."""
    easy = scores[:, :1]
    if not curve(easy) > 0:
        return BreakingPoint(NEVER, NEVER, NEVER)
    at, low, high = (crossing(way, end) for end in mean_interval(scores - share * easy))
    if not np.isfinite(at):
        return BreakingPoint(at, low, high)
    if len(scores) == 1:
        return BreakingPoint(at, float(way[0]), NEVER)
    k = int(np.clip(np.searchsorted(way, at), 1, len(way) - 1))
    return BreakingPoint(at, min(low, float(way[k - 1])), max(high, float(way[k])))
