"""Slow, obvious oracles of the tracking stage: filterpy one by one, the Riccati solver, brute-force pairing."""

from __future__ import annotations

from itertools import permutations

import numpy as np
from filterpy.common import Q_discrete_white_noise
from filterpy.kalman import KalmanFilter
from scipy.linalg import block_diag, solve_discrete_are


def filterpy_bank(place, var, rate_var, dt, sigma, noise):
    """One 2D-state filterpy filter per row of place (N, D), states ordered (place, rate) per coordinate."""
    return [_filter(row, var, rate_var, dt, sigma, noise) for row in place]


def _filter(place, var, rate_var, dt, sigma, noise):
    d = len(place)
    f = KalmanFilter(2 * d, d)
    f.F = np.kron(np.eye(d), [[1.0, dt], [0.0, 1.0]])
    f.H = np.kron(np.eye(d), [[1.0, 0.0]])
    f.Q = block_diag(*[Q_discrete_white_noise(2, dt, s**2) for s in sigma])
    f.R = np.diag(noise)
    f.P = np.diag(np.column_stack([var, rate_var]).ravel())
    f.x[::2, 0] = place
    return f


def riccati_innovation(dt, sigma, noise):
    """S in the steady state of one block, from scipy's DARE (its solution is the predicted covariance)."""
    a, c = np.array([[1.0, dt], [0.0, 1.0]]), np.array([[1.0, 0.0]])
    p = solve_discrete_are(a.T, c.T, Q_discrete_white_noise(2, dt, sigma**2), np.array([[noise]]))
    return float(p[0, 0] + noise)


def best_pairing(cost, unassigned):
    """Least total cost over all one-to-one pairings; each row left out costs `unassigned`."""
    n, m = cost.shape
    best = np.inf
    for columns in permutations(range(m + n), n):
        total = sum(cost[i, j] if j < m else unassigned for i, j in enumerate(columns))
        best = min(best, total)
    return best
