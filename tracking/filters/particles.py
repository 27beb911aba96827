"""Resampling of weighted particles by given uniforms, and how many particles the weights are worth.

The schemes are those of filterpy.monte_carlo, which draws from the global generator. Here the uniforms are arguments,
so that the result is repeatable and can be tested at their ends. Weights (P,) are not negative and sum to 1.
"""

from __future__ import annotations

import numpy as np

from sim.types import Array, Ints


def effective_number(weights: Array) -> float:
    """Return the effective number of particles, 1 / sum(w^2): P for equal weights, 1 if one particle has all."""
    return float(1.0 / np.square(weights).sum())


def residual_resample(weights: Array, uniforms: Array) -> Ints:
    """Return the indices (P,) of the particles that replace the old ones, ascending: residual sampling (Liu & Chen).

    weights (P,): sum 1. uniforms (P,) in [0, 1). A particle of weight w is taken floor(P w) times; the rest is drawn
    with the remainders P w - floor(P w) as weights, from as many of the first uniforms. Equal weights keep every
    particle. filterpy's function takes w - floor(P w) as remainders, which are negative; its copies are these.
    """
    count = len(weights)
    expected = count * weights
    copies = np.floor(expected + 1e-9).astype(np.int64)
    rest = np.maximum(expected - copies, 0.0)
    missing = count - int(copies.sum())
    if missing > 0:
        drawn = np.searchsorted(_cumulative(rest), uniforms[:missing], side="right")
        copies += np.bincount(drawn, minlength=count)
    return np.repeat(np.arange(count), copies)[:count]


def systematic_resample_rows(weights: Array, uniforms: Array) -> Ints:
    """Return the indices (R, P) that replace the old particles of R sets, ascending in each row: systematic sampling.

    weights (R, P): sum 1 in each row. uniforms (R,) in [0, 1), one for each set.
    """
    rows, count = weights.shape
    total = np.cumsum(weights, axis=1)
    total /= total[:, -1:]
    below_one = np.minimum(uniforms, 1 - 1e-9)  # count less the largest number below 1 is rounded to count - 1
    reached = np.ceil(count * total - below_one[:, None]).astype(np.int64)
    copies = np.diff(reached, axis=1, prepend=0)
    return np.repeat(np.tile(np.arange(count), rows), copies.ravel()).reshape(rows, count)


def _cumulative(weights: Array) -> Array:
    """Returns the cumulated weights (P,), divided by their sum; inf from the last particle with a weight on."""
    total = np.cumsum(weights)
    total /= total[-1]
    total[np.flatnonzero(weights)[-1] :] = np.inf
    return total
