"""Numba kernel of the fit of the belief: its loss, the mean log loss of all rows, and the gradient."""

from __future__ import annotations

import numpy as np

from sim.compiler import njit
from sim.types import Array, Bools


@njit(cache=True)
def loss_and_gradient(
    place: np.ndarray, part: np.ndarray, standing: Array, gap: Array, together: Bools, weight: Array,
    walk: Array, stand: Array, rest: Array, log_odds: Array, gradient: Array,
) -> float:  # fmt: skip
    """Returns the weighted log loss of R rows; fills log_odds (R,) and adds to `gradient` (2 K + 3,).

    place (R, Q): index of the knot below each quantity's value, -1 if unknown; part (R, Q): how far the value is to the
    next knot, 0 to 1. standing (R,): 0 walking to 1 standing. gap (R,): s since the pair's row before, below 0 in its
    first row. together (R,), weight (R,). walk, stand (K,): log-odds at all knots. rest (3,): bias, logarithms of the
    times of walking and standing. gradient: in the order walk, stand, rest.
    """
    rows, quantities = place.shape
    knots = len(walk)
    stay, slope = np.zeros(rows), np.zeros(rows)
    loss, before = 0.0, 0.0
    for r in range(rows):
        s, target = standing[r], rest[0]
        for q in range(quantities):
            k = place[r, q]
            if k >= 0:
                u = part[r, q]
                target += (1 - s) * ((1 - u) * walk[k] + u * walk[k + 1]) + s * ((1 - u) * stand[k] + u * stand[k + 1])
        if gap[r] >= 0:
            late = gap[r] * np.exp(-(1 - s) * rest[1] - s * rest[2])
            stay[r] = np.exp(-late)
            slope[r] = stay[r] * late * (before - target)  # with respect to the logarithm of the time
        before = log_odds[r] = target + stay[r] * (before - target)
        loss += weight[r] * (np.log1p(np.exp(-abs(before))) + max(before, 0.0) - (before if together[r] else 0.0))
    back = 0.0
    for r in range(rows - 1, -1, -1):
        back = back * stay[r + 1] if r + 1 < rows else 0.0
        back += weight[r] * (1 / (1 + np.exp(-log_odds[r])) - (1.0 if together[r] else 0.0))
        s, here = standing[r], back * (1 - stay[r])
        for q in range(quantities):
            k = place[r, q]
            if k >= 0:
                u = part[r, q]
                gradient[k] += here * (1 - s) * (1 - u)
                gradient[k + 1] += here * (1 - s) * u
                gradient[knots + k] += here * s * (1 - u)
                gradient[knots + k + 1] += here * s * u
        gradient[2 * knots] += here
        gradient[2 * knots + 1] += back * slope[r] * (1 - s)
        gradient[2 * knots + 2] += back * slope[r] * s
    return loss
