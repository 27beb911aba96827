"""Resampling of weighted particles by given uniforms.

The schemes are those of filterpy.monte_carlo, which draws from the global generator. Here the uniforms are arguments,
so that the result is repeatable and can be tested at their ends. Weights (P,) are not negative and sum to 1.
"""

from __future__ import annotations

import numpy as np

from sim.types import Array, Ints


def residual_resample(weights: Array, uniforms: Array) -> Ints:
    """Returns the indices (P,), ascending, of the particles to copy by residual sampling (Liu & Chen). weights (P,):
    sum 1; uniforms (P,) in [0, 1), of which the first are used."""
    count = len(weights)
    expected = count * weights
    # filterpy takes w - floor(P w) as remainders, which are negative; its copies are these. Equal weights must keep
    # every particle, so that rounding below a whole number is raised.
    copies = np.floor(expected + 1e-9).astype(np.int64)
    rest = np.maximum(expected - copies, 0.0)
    missing = count - int(copies.sum())
    if missing > 0:
        drawn = np.searchsorted(_cumulative(rest), uniforms[:missing], side="right")
        copies += np.bincount(drawn, minlength=count)
    return np.repeat(np.arange(count), copies)[:count]


def systematic_resample_rows(weights: Array, uniforms: Array) -> Ints:
    """Returns the indices (R, P) of the particles to copy in each of R sets by systematic sampling. weights (R, P);
    uniforms (R,) in [0, 1)."""
    rows, count = weights.shape
    total = np.cumsum(weights, axis=1)
    total /= total[:, -1:]
    below_one = np.minimum(uniforms, 1 - 1e-9)  # count less the largest number below 1 is rounded to count - 1
    reached = np.ceil(count * total - below_one[:, None]).astype(np.int64)
    copies = np.diff(reached, axis=1, prepend=0)
    return np.repeat(np.tile(np.arange(count), rows), copies.ravel()).reshape(rows, count)


def _cumulative(weights: Array) -> Array:
    total = np.cumsum(weights)
    total /= total[-1]
    # rounding may leave the last sum below a uniform close to 1; a particle without weight must not be drawn
    total[np.flatnonzero(weights)[-1] :] = np.inf
    return total
