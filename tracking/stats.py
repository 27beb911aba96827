"""How sure a figure is: bootstrap over sequences and of differences, shares, one recording in moving blocks.

Frames of a recording resemble their neighbours, so they are never drawn one by one: whole sequences are, or blocks of
frames. Every interval is of 95 % and the same whenever it is asked for.
"""

from __future__ import annotations

from collections.abc import Callable
from math import ceil, sqrt

import numpy as np

from sim.types import Array, Ints

DRAWS = 2000
LEVEL = 0.95
NORMAL = 1.959963984540054  # the standard normal stays within +- this with probability LEVEL
SHORTEST_BLOCK = 1.0  # s
BLOCKS = 20  # a recording is drawn in at most so many
SURE = 60.0  # s: the interval of a shorter recording is indicative only


def bootstrap(values: Array, draws: int = DRAWS) -> tuple[Array, Array, Array]:
    """Mean, low and high (K,) of percentile intervals over sequences, values (S, K); nan rows of a column are left out.

    Several runs of one sequence (filter seeds) are to be averaged before. Fewer than two sequences: nan for the ends.
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
    """Mean, low and high (K,) of second - first over the same sequences, (S, K) each; pairs with a nan are left out."""
    return bootstrap(second - first, draws)


def wilson(hits: int, count: int) -> tuple[float, float, float]:
    """Share, low and high of `hits` out of `count` (Wilson 1927): where (share - p)^2 <= z^2 p (1 - p) / count."""
    if count == 0:
        return float("nan"), 0.0, 1.0
    share, z2 = hits / count, NORMAL**2 / count
    middle = (share + z2 / 2) / (1 + z2)
    half = sqrt(z2 * (share * (1 - share) + z2 / 4)) / (1 + z2)
    return share, max(0.0, middle - half), min(1.0, middle + half)


def moving_blocks(
    score: Callable[[Ints], Array], frames: int, fps: float, draws: int = DRAWS
) -> tuple[Array, Array, Array]:
    """Scores of one recording and their low and high ends (K,), frames drawn in moving blocks (Künsch 1989).

    score: takes places of frames 0 … frames - 1, some more than once, and gives scores (K,), nan where there is none.
    Under SURE seconds the ends are indicative. Differences: let score give them, of both trackers in the same frames.
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
    """Frames of a block: at least a second and a twentieth of the recording, at most all of it."""
    return min(frames, max(1, ceil(SHORTEST_BLOCK * fps), ceil(frames / BLOCKS)))


def draw_blocks(frames: int, block: int, r: np.random.Generator) -> Ints:
    """Places of frames (frames,): blocks of neighbours from random starts, the last one cut off."""
    starts = r.integers(0, frames - block + 1, -(-frames // block))
    return np.asarray((starts[:, None] + np.arange(block)).ravel()[:frames])


def _ends(drawn: Array) -> Array:
    tail = (1 - LEVEL) / 2
    return np.asarray(np.quantile(drawn, (tail, 1 - tail)))
