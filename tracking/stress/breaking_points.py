"""Where the curve of a score over an axis of difficulty breaks, with its interval.

A tracker breaks by two measures, at a limit such as 0.8:

    share of the oracle    the tracker's mean score / the oracle's mean score from the same detections. It falls to the
                           limit times its value at the easy end. What the detector loses, the oracle loses, too.
    score                  the mean score falls to the limit times its value at the easy end. What the detector loses
                           counts. The oracle breaks by this measure where the detections alone do not suffice.

Scores are paired: P scenes (scenario and seed), each played at the same values of the axis with the same random
numbers. T and B are the scores of tracker and oracle in a scene, r = mean T / mean B at the easy end, q the limit. The
*height* of the scene at a value v is

    T(v) - q r B(v) - q (mean B(v) / mean B(easy)) (T(easy) - r B(easy))

The last term has the mean 0; by it the spread of r counts in the interval. With B = 1 the height is T(v) - q T(easy),
which is the height by score. The mean height over scenes has a 95 % interval at each value, Student's. Between values
all three are linear, and the first value, from easy to hard, at which one falls to 0 is:

    of the mean            the breaking point
    of the lower end       the low end of its interval: the first value at which the curve may have broken
    of the upper end       the high end: the first value at which it surely has; unknown if there is none

The interval also holds the two values beside the breaking point, as the curve between them is not known. One scene
gives no interval. A scene counts at a value only if both scores are known. Where the oracle's mean score is 0 or
unknown, the share is unknown, and the value is left out; if this is the easy end, there is no breaking point by share.

Over two axes, a value of both is *above* or *below* the limit if the interval of its mean height lies above or below 0.
The intervals of all values together hold at 95 % (Bonferroni). All other values are unknown, and so are all if there
are fewer than 6 scenes. The *frontier* is where the mean height falls to 0 along the second axis.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sim.types import Array, Bools
from tracking.stats import few, joint_level, mean_interval

NEVER = np.inf


@dataclass(frozen=True)
class BreakingPoint:
    """Where a curve crosses a level, and the low and high end of its 95 % interval, as shares of the way from easy (0)
    to hard (1); inf means that there is no crossing."""

    at: float
    low: float
    high: float


def crossing(way: Array, height: Array) -> float:
    """Returns at which `way` a curve first falls to 0 or below, linear between its values; inf if it never does. way,
    height (V,): the curve; nan heights are left out."""
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


def shares(scores: Array, best: Array) -> tuple[Array, Array, Array]:
    """Returns the share of the oracle at each value, mean of scores / mean of best, and low and high end of its paired
    95 % interval, (V,) each; nan where the oracle's mean is not above 0. scores, best (P, V): of tracker and oracle."""
    known = np.isfinite(scores) & np.isfinite(best)
    (mean, *_), (top, *_) = (mean_interval(np.where(known, each, np.nan)) for each in (scores, best))
    top = np.where(top > 0, top, np.nan)
    share = mean / top
    _, low, high = mean_interval((scores - share * best) / top)  # the ratio's linear terms, of mean 0
    return share, np.maximum(share + low, 0.0), share + high


def heights(scores: Array, best: Array, limit: float) -> Array:
    """Returns the height of each scene at each value, (P, V), as in the head of this module."""
    easy = shares(scores, best)[0][0]
    known = np.isfinite(scores) & np.isfinite(best)
    top = mean_interval(np.where(known, best, np.nan))[0]
    top = np.where(top > 0, top, np.nan)
    spread = top / top[0] * (scores[:, :1] - easy * best[:, :1])
    return np.asarray(scores - limit * (easy * best + spread))


def breaking_point(way: Array, scores: Array, limit: float, best: Array | None = None) -> BreakingPoint:
    """Returns where the mean curve of scores (P, V), of P scenes at `way` (V,), falls to `limit` times its value at the
    easy end. way: ascending from 0. best: the oracle's scores (P, V), then the curve is the share of the oracle. All
    three numbers are inf if the curve at the easy end is not above 0."""
    best = np.ones_like(scores) if best is None else best
    if not shares(scores, best)[0][0] > 0:
        return BreakingPoint(NEVER, NEVER, NEVER)
    at, low, high = (crossing(way, end) for end in mean_interval(heights(scores, best, limit)))
    if not np.isfinite(at):
        return BreakingPoint(at, low, high)
    if len(scores) == 1:
        return BreakingPoint(at, float(way[0]), NEVER)
    k = int(np.clip(np.searchsorted(way, at), 1, len(way) - 1))
    return BreakingPoint(at, min(low, float(way[k - 1])), max(high, float(way[k])))


@dataclass(frozen=True, eq=False)
class Frontier:
    """Where the share of the oracle falls to the limit over two axes of A and B values.

    Attributes:
        sides: (A, B): 1 surely above the limit, -1 surely below it, 0 not known.
        above: (A, B): True where the mean is above the limit; False also where it is unknown.
        points: For each value of the first axis, the breaking point along the second one.
    """

    sides: Array
    above: Bools
    points: tuple[BreakingPoint, ...]


def frontier(way: Array, scores: Array, best: Array, limit: float) -> Frontier:
    """Returns the frontier of scores (P, A * B), of which the first column is the easy end of both axes. way (B,): the
    values of the second axis, as shares of the way from easy to hard."""
    height = heights(scores, best, limit)
    ends = mean_interval(height, joint_level(height.shape[1]))
    mean, low, high = (end.reshape(-1, len(way)) for end in ends)
    sides = np.where(low > 0, 1, np.where(high < 0, -1, 0))
    unsure = few(np.isfinite(height).sum(axis=0).reshape(mean.shape))
    points = tuple(BreakingPoint(*(crossing(way, end[k]) for end in (mean, low, high))) for k in range(len(mean)))
    return Frontier(np.where(unsure, 0, sides), mean > 0, points)
