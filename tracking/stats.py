"""Confidence intervals of scores: means over sequences, paired differences, shares, and scores of one recording.

Neighbouring frames are alike, so single frames are never resampled: whole sequences count as one value each, or blocks
of frames get weights. All intervals are 95 % intervals: mean or score, low end and high end, in the unit of the score.
The random numbers are fixed, so that the same input gives the same interval.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from math import ceil, sqrt
from typing import Any, Literal

import numpy as np

from sim.types import Array, Bools, Ints
from tracking.scoring.catalogue import Score

DRAWS = 2000  # Draws of weights, or bootstrap samples.
LEVEL = 0.95  # Confidence level of all intervals.
FEWEST = 6  # A difference over fewer sequences is never called sure.
SHORTEST_BLOCK = 1.0  # s: least length of a block of frames.
BLOCKS = (5, 20)  # Least and greatest number of blocks of a recording.
# A score that is unknown in a larger share of the draws gets no interval: too few blocks have what it counts.
UNKNOWN_DRAWS = 0.05
SURE = 60.0  # s: the interval of a shorter recording is only indicative.

# What values a score can have: 0 to 1; up to 1; numbers of things; above 0; any.
Scale = Literal["share", "below one", "count", "length", "plain"]


def mean_of_known(values: Iterable[float]) -> float:
    """Returns the mean of the values that are not nan, nan if there are none. Infinite values are kept."""
    known = [v for v in values if v == v]
    return sum(known) / len(known) if known else float("nan")


def mean_of_finite(values: Array) -> float:
    """Returns the mean of the values that are neither nan nor infinite, nan if there are none."""
    known = values[np.isfinite(values)]
    return float(known.mean()) if len(known) else float("nan")


def mean_interval(values: Array, level: float = LEVEL) -> tuple[Array, Array, Array]:
    """Returns mean, low end and high end, (K,) each, of Student's interval of the mean of each column of values (S, K).
    Values that are not finite are left out. Fewer than two values give an interval of nan. level: confidence level."""
    known = np.isfinite(values)
    count = known.sum(axis=0)
    some, two = np.maximum(count, 1), np.maximum(count, 2)
    mean = np.where(known, values, 0.0).sum(axis=0) / some
    spread = np.sqrt((np.where(known, values - mean, 0.0) ** 2).sum(axis=0) / (two - 1))
    half = np.where(count > 1, student(two - 1, level) * spread / np.sqrt(some), np.nan)
    mean = np.where(count > 0, mean, np.nan)
    return mean, mean - half, mean + half


def student(degrees: Array | float, level: Array | float = LEVEL) -> Array:
    """Returns the number t such that a Student-t variable lies between -t and t with probability `level`."""
    from scipy.special import stdtrit

    return np.asarray(stdtrit(degrees, (1 + np.asarray(level)) / 2))


def joint_level(count: int) -> float:
    """Returns the confidence level for each of `count` intervals so that all hold together at 95 % (Bonferroni)."""
    return 1 - (1 - LEVEL) / max(count, 1)


def paired(first: Array, second: Array) -> tuple[Array, Array, Array]:
    """Returns mean, low end and high end, (K,) each, of second - first over the same S sequences; both (S, K)."""
    return mean_interval(second - first)


def compared(differences: Array, comparisons: int = 1) -> tuple[Array, Array, Array, Ints]:
    """Returns mean, low end, high end and sure sign, (K,) each, of paired differences (S, K) over S sequences.

    The intervals of all comparisons hold together at 95 %. The sure sign is 1 or -1 if the interval lies above or below
    0 and at least `FEWEST` differences are finite, else 0.
    """
    mean, low, high = mean_interval(differences, joint_level(comparisons))
    return mean, low, high, np.where(few(np.isfinite(differences).sum(axis=0)), 0, sign_of(low, high))


def few(sequences: Ints | int) -> Bools:
    """Returns True where an interval of so many sequences is only indicative: where its side of 0 is never sure."""
    return np.asarray(sequences) < FEWEST


def sign_of(low: Array, high: Array) -> Ints:
    """Returns 1 where an interval lies above 0, -1 where it lies below 0, else 0; ends that are nan give 0."""
    return (low > 0).astype(np.int64) - (high < 0)


def block_intervals(
    score: Callable[[Array], Array],
    frames: int,
    fps: float,
    likeness: float = 1.0,
    draws: int = DRAWS,
    scales: Sequence[Scale] | None = None,
    levels: Array | float = LEVEL,
) -> tuple[Array, Array, Array]:
    """Returns the K scores of one recording, and the low and high ends of their intervals, (K,) each.

    score: a function from weights of frames (D, frames) to scores (D, K). frames, fps: length and rate of the
    recording. likeness: number of frames over which frames are alike. draws: number of weights drawn. scales: scale of
    each score, None for "plain". levels: confidence levels. Ends are nan for a recording of fewer than two blocks.
    """
    whole = np.asarray(score(np.ones((1, frames))), float)[0]
    ends = np.full((2, len(whole)), np.nan)
    block = block_length(frames, fps, likeness)
    blocks = frames / block if block else 0.0
    if blocks < 2 or draws < 2:
        return whole, ends[0], ends[1]
    drawn = np.asarray(score(block_weights(frames, block, draws, np.random.default_rng(0))), float)
    known = np.isfinite(drawn)
    t = np.broadcast_to(student(blocks - 1, levels) * sqrt(blocks / (blocks - 1)), whole.shape)
    for k in np.flatnonzero(np.isfinite(whole) & (known.mean(axis=0) >= 1 - UNKNOWN_DRAWS)).tolist():
        error = float(drawn[known[:, k], k].std(ddof=1))
        if error > 1e-12 * max(1.0, abs(whole[k])):
            ends[:, k] = _ends(whole[k], float(t[k]) * error, scales[k] if scales else "plain")
    return whole, ends[0], ends[1]


def _ends(x: float, half: float, scale: Scale) -> tuple[float, float]:
    """Returns the ends of the interval of a score x: g(x) +- half |g'(x)|, taken back by the inverse of g."""
    if scale == "share":
        if not 0 < x < 1:
            return float("nan"), float("nan")
        middle, reach = np.log(x / (1 - x)), half / (x * (1 - x))
        return 1 / (1 + np.exp(reach - middle)), 1 / (1 + np.exp(-reach - middle))
    if scale == "below one":
        reach = half / (1 - x) if x < 1 else float("nan")
        return 1 - (1 - x) * np.exp(reach), 1 - (1 - x) * np.exp(-reach)
    if scale == "length":
        reach = half / x if x > 0 else float("nan")
        return x * np.exp(-reach), x * np.exp(reach)
    if scale == "count":
        reach = half / (2 * sqrt(x)) if x > 0 else float("nan")
        return max(0.0, sqrt(max(x, 0.0)) - reach) ** 2, (sqrt(max(x, 0.0)) + reach) ** 2
    return x - half, x + half


def block_length(frames: int, fps: float, likeness: float = 1.0) -> int:
    """Returns the number of frames of a block: 2 `likeness`, but 1/20 to 1/5 of the recording, and at least 1 s."""
    few, many = BLOCKS
    wanted = min(max(ceil(2 * likeness), ceil(frames / many)), ceil(frames / few))
    return min(frames, max(1, ceil(SHORTEST_BLOCK * fps), wanted))


def block_weights(frames: int, block: int, draws: int, r: np.random.Generator) -> Array:
    """Returns how often each frame is drawn in each draw, (draws, frames), as blocks of `block` frames in a row. The
    sum of a draw is `frames`. The first frame follows the last one. r: source of the random numbers."""
    count = -(-frames // block)
    starts = r.integers(0, frames, (draws, count))
    length = np.full(count, block)
    length[-1] = frames - block * (count - 1)
    change = np.zeros((draws, 2 * frames + 1))
    rows = np.arange(draws)[:, None]
    np.add.at(change, (rows, starts), 1.0)
    np.add.at(change, (rows, starts + length), -1.0)
    # The first frame follows the last one, so that every frame is drawn equally often.
    weights = np.cumsum(change, axis=1)
    return np.asarray(weights[:, :frames] + weights[:, frames:-1])


def score_interval(score: Score, values: Array, difference: bool = False) -> dict[str, Any]:
    """Returns "mean", "low" and "high" as `mean_interval` does, cut at the range of the score, and "indicative", (K,)
    each.

    An interval is indicative if fewer than `FEWEST` sequences are known. values: (S, K). difference: True if values are
    differences of the score.
    """
    mean, low, high = (score.within(end, difference) for end in mean_interval(values))
    return {"mean": mean, "low": low, "high": high, "indicative": few(np.isfinite(values).sum(axis=0))}
