"""Do ellipsoids of any dimension have a common point? (Gilitschenski & Hanebeck 2012)

"A robust computational test for overlap of two arbitrary-dimensional ellipsoids in fault-detection of Kalman filters",
2012: the ellipsoids y' A^-1 y <= 1 and (y - d)' B^-1 (y - d) <= 1 are disjoint if and only if f(s) = d' (A / (1 - s) +
B / s)^-1 d > 1 for some s in (0, 1). f is concave. With B = L L', A' = L^-1 A L^-T = U diag(l) U' and e = U' L^-1 d:
f(s) = sum of s (1 - s) e_k^2 / (1 - s + s l_k), with A and B exchanged where s and 1 - s are. Ellipses in the plane
have kernels of their own: tracking.filters.components_kernels.
"""

from __future__ import annotations

import numpy as np

from sim.types import Array

STEPS = 60
"""Halvings of the interval in which f has its maximum."""


def separation(d: Array, A: Array, B: Array) -> float:
    """Returns the largest f(s) of two ellipsoids A, B (D, D), centres d (D,) apart; they overlap if it is 1 or less."""
    # The result is also the squared factor by which both would have to be enlarged to touch.
    L = np.linalg.cholesky(B)
    inverse = np.linalg.inv(L)
    values, U = np.linalg.eigh(inverse @ A @ inverse.T)
    e2 = np.square(U.T @ (inverse @ d))

    def slope(s: float) -> float:
        m = s * values + (1 - s)  # f = sum e2 s (1 - s) / m
        return float((e2 * ((1 - 2 * s) * m - s * (1 - s) * (values - 1)) / m**2).sum())

    low, high = 0.0, 1.0
    # f is concave, so that its slope has one root
    for _ in range(STEPS):
        s = (low + high) / 2
        low, high = (s, high) if slope(s) > 0 else (low, s)
    s = (low + high) / 2
    return float((e2 * s * (1 - s) / (s * values + (1 - s))).sum())
