"""Numba kernel of the fit of the belief: its loss, the mean log loss of all rows, and the gradient."""

from __future__ import annotations

import numpy as np

from sim.compiler import njit
from sim.types import Array, Bools


@njit(cache=True)
def loss_and_gradient(
    place: np.ndarray, part: np.ndarray, mix: Array, together: Bools, weight: Array, heights: Array, bias: float,
    gradient: Array,
) -> tuple[float, float]:  # fmt: skip
    """Returns the weighted log loss of R rows and its slope with respect to the bias; adds to gradient (M, K).

    place, part (R, Q): knot below each value, -1 if unknown, and how far it is to the next. mix (R, M): weights of the
    M columns of the tables, whose log-odds at all knots are heights (M, K).
    """
    rows, quantities = place.shape
    loss, slopes = 0.0, 0.0
    for r in range(rows):
        log_odds = bias
        for q in range(quantities):
            k = place[r, q]
            if k >= 0:
                u = part[r, q]
                for m in range(len(heights)):
                    log_odds += mix[r, m] * ((1 - u) * heights[m, k] + u * heights[m, k + 1])
        true = 1.0 if together[r] else 0.0
        loss += weight[r] * (np.log1p(np.exp(-abs(log_odds))) + max(log_odds, 0.0) - true * log_odds)
        slope = weight[r] * (1 / (1 + np.exp(-log_odds)) - true)
        slopes += slope
        for q in range(quantities):
            k = place[r, q]
            if k >= 0:
                u = part[r, q]
                for m in range(len(heights)):
                    gradient[m, k] += slope * mix[r, m] * (1 - u)
                    gradient[m, k + 1] += slope * mix[r, m] * u
    return loss, slopes
