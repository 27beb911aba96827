"""Curves of a score over an axis, and breaking points with their intervals.

Scores are paired: P scenes (scenario and seed), each played at the same values of the axis with the same random
numbers. The curve is the mean over scenes. Its *breaking point* is the first value, from easy to hard, at which the
curve falls to a share of its value at the easy end, linear between values. The 95 % interval takes P scenes with
replacement, many times: the percentiles of the breaking points of their curves. Of few scenes such draws vary too
little, so the distances of both ends from the breaking point are multiplied by sqrt(P / (P - 1)) t / 1.96, where t is
the quantile of Student's distribution with P - 1 degrees of freedom: 1.87 for four scenes, 1.12 for 16. A draw that
never breaks counts as breaking beyond the hard end, so an end of the interval may be unknown. The interval also holds
the two values beside the breaking point, as the curve between them is not known.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from sim.types import Array
from tracking.stats import LEVEL, student

DRAWS = 1000
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


def breaking_point(way: Array, scores: Array, share: float, rng: np.random.Generator) -> BreakingPoint:
    """Returns where the curve of scores (P, V) at `way` (V,), ascending from 0, falls to a share of its easy value."""
    return _with_interval(way, scores, lambda mean: mean - share * mean[0] if mean[0] > 0 else mean + NEVER, rng)


def overtaking(way: Array, first: Array, second: Array, rng: np.random.Generator) -> BreakingPoint:
    """Returns where the first tracker, ahead at the easy end, falls behind the second; both (P, V), paired."""
    return _with_interval(way, first - second, lambda mean: mean, rng)


def _with_interval(
    way: Array, scores: Array, height: Callable[[Array], Array], rng: np.random.Generator
) -> BreakingPoint:
    at = crossing(way, height(curve(scores)))
    draws = rng.integers(0, len(scores), (DRAWS, len(scores)))
    found = np.sort([crossing(way, height(curve(scores[draw]))) for draw in draws])
    outside = int((1 - LEVEL) / 2 * DRAWS)
    low, high = float(found[outside]), float(found[-1 - outside])
    if not np.isfinite(at):
        return BreakingPoint(at, low, high)
    if len(scores) == 1:
        return BreakingPoint(at, float(way[0]), NEVER)
    low, high = (at + _widening(len(scores)) * (end - at) for end in (low, high))
    low, high = max(low, float(way[0])), high if high <= way[-1] else NEVER
    k = int(np.clip(np.searchsorted(way, at), 1, len(way) - 1))
    return BreakingPoint(at, min(low, float(way[k - 1])), max(high, float(way[k])))


def _widening(scenes: int) -> float:
    return float(np.sqrt(scenes / (scenes - 1)) * student(scenes - 1) / student(np.inf))
