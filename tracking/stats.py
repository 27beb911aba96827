"""Confidence intervals of scores: bootstrap over sequences, paired differences, shares, moving blocks of one recording.

Neighbouring frames are alike, so single frames are never resampled: whole sequences are, or blocks of frames. All
intervals are 95 % intervals: mean or score, low end and high end, in the unit of the score. The random numbers are
fixed, so that the same input gives the same interval.
"""

from __future__ import annotations

from collections.abc import Callable
from math import ceil, sqrt

import numpy as np

from sim.types import Array, Ints

DRAWS = 2000
"""Bootstrap samples."""
LEVEL = 0.95
"""Confidence level of all intervals."""
NORMAL = 1.959963984540054
"""A standard normal variable lies within +- NORMAL with probability LEVEL."""
SHORTEST_BLOCK = 1.0
"""s: least length of a moving block."""
BLOCKS = 20
"""A resampled recording consists of at most so many blocks."""
SURE = 60.0
"""s: the interval of a shorter recording is only indicative."""


def bootstrap(values: Array, draws: int = DRAWS) -> tuple[Array, Array, Array]:
    """Return mean, low end and high end, (K,) each, of 95 % percentile intervals of the mean over S sequences; values
    (S, K).

    draws: number of bootstrap samples. nan and infinite values are left out, for each column by itself; a sample
    without any number of a column does not count for it. The ends of a column with fewer than two numbers are nan;
    without any number the mean is nan, too. Average several runs of one sequence (tracker seeds) before the call. The
    random numbers are fixed.
    """
    count, columns = values.shape
    known = np.isfinite(values)
    out = np.full((3, columns), np.nan)
    drawn = np.random.default_rng(0).multinomial(count, np.full(count, 1 / count), size=draws) if count else None
    for k in np.flatnonzero(known.any(axis=0)):
        rows = known[:, k]
        out[0, k] = values[rows, k].mean()
        if drawn is not None and rows.sum() > 1:
            times = drawn[:, rows]
            times = times[times.any(axis=1)]
            out[1:, k] = _ends(times @ values[rows, k] / times.sum(axis=1))
    return out[0], out[1], out[2]


def paired(first: Array, second: Array, draws: int = DRAWS) -> tuple[Array, Array, Array]:
    """Return mean, low end and high end, (K,) each, of second - first over the same S sequences; both (S, K).

    The interval is a 95 % bootstrap interval of the mean from `draws` samples. Pairs with a nan or infinity are left
    out, for each column by itself; with fewer than two pairs the ends are nan, without any the mean, too.
    """
    return bootstrap(second - first, draws)


def wilson(hits: int, count: int) -> tuple[float, float, float]:
    """Return the share of `hits` out of `count`, and the low and high end of its 95 % interval, within 0 to 1 (Wilson
    1927).

    hits: 0 to count. The interval holds all p with (share - p)^2 <= z^2 p (1 - p) / count, where z = 1.96 is the normal
    quantile. If count is 0: nan, 0 and 1.
    """
    if count == 0:
        return float("nan"), 0.0, 1.0
    share, z2 = hits / count, NORMAL**2 / count
    middle = (share + z2 / 2) / (1 + z2)
    half = sqrt(z2 * (share * (1 - share) + z2 / 4)) / (1 + z2)
    return share, max(0.0, middle - half), min(1.0, middle + half)


def moving_blocks(
    score: Callable[[Ints], Array], frames: int, fps: float, draws: int = DRAWS
) -> tuple[Array, Array, Array]:
    """Return the scores (K,) of one recording, and the low and the high ends (K,) of their 95 % intervals.

    score: takes indices (frames,) of frames, from 0, some more than once, and returns scores (K,), nan where undefined.
    It is called 1 + draws times (once without frames), first with every frame once. frames: number in the recording;
    fps: frames per second; draws: number of samples. Frames are resampled in moving blocks (Künsch 1989): whole
    stretches of consecutive frames. For an interval of a difference let `score` return the difference of two trackers
    in the same frames. nan and infinite scores of samples are left out; the ends are nan if none remains, and without
    frames. The random numbers are fixed. Under SURE = 60 seconds the intervals are indicative.
    """
    whole = np.asarray(score(np.arange(frames)), float)
    r = np.random.default_rng(0)
    drawn = np.array([score(draw_blocks(frames, block_length(frames, fps), r)) for _ in range(draws if frames else 0)])
    ends = np.full((2, len(whole)), np.nan)
    for k, column in enumerate(drawn.T):
        if np.isfinite(column).any():
            ends[:, k] = _ends(column[np.isfinite(column)])
    return whole, ends[0], ends[1]


def block_length(frames: int, fps: float) -> int:
    """Return the length of a block in frames: the longer of 1 s and a twentieth of the recording, rounded up, but at
    most all frames.

    frames: number in the recording, 0 gives 0; fps: frames per second.
    """
    return min(frames, max(1, ceil(SHORTEST_BLOCK * fps), ceil(frames / BLOCKS)))


def draw_blocks(frames: int, block: int, r: np.random.Generator) -> Ints:
    """Return indices (frames,) of frames, from 0: blocks of `block` consecutive frames from random starts, the last one
    cut.

    block: frames of a block, from 1 to `frames`; ZeroDivisionError for 0, ValueError for more. r: the generator, which
    is advanced.
    """
    starts = r.integers(0, frames - block + 1, -(-frames // block))
    return np.asarray((starts[:, None] + np.arange(block)).ravel()[:frames])


def _ends(drawn: Array) -> Array:
    """Returns the low and the high end (2,) of the 95 % interval of samples (N,): their 2.5 % and 97.5 % quantiles."""
    tail = (1 - LEVEL) / 2
    return np.asarray(np.quantile(drawn, (tail, 1 - tail)))
