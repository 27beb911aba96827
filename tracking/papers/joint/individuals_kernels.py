"""Kernels of the individuals' distributions: log p(X_{t+1} | X_t, Z_t) for all partitions of all particles (eq. 5)."""

from __future__ import annotations

import numpy as np

from sim.compiler import njit
from sim.types import Array, Ints
from tracking.papers.joint.partition_kernels import same_row

PLACE, CROSS, RATE = range(3)
"""Slots of a covariance or precision (3,) of one axis of a state: of the place, place and velocity, the velocity."""


@njit(cache=True)
def log_normal(residual: Array, precision: Array, log_scale: float) -> float:
    """Returns log N(residual; 0, Sigma) of a state's residual (4,) x, y, vx, vy; log_scale: of the density at 0."""
    total = 0.0
    for d in range(2):
        place, rate = residual[d], residual[d + 2]
        total += precision[PLACE] * place * place + 2 * precision[CROSS] * place * rate + precision[RATE] * rate * rate
    return log_scale - total / 2


@njit(cache=True)
def group_dynamics(
    new: Array, old: Array, label: Ints, precision: Array, log_scale: float, dt: float, out: Array
) -> None:
    """Writes log p(X_{t+1} | X_t, Z_t) of each partition, (N_x, N_z), eq. 5: N(x + B g, Sigma) for each person.

    new, old (N_x, K, 4): states; label (N_x, N_z, K); precision (3,): as PLACE, CROSS, RATE; dt: s. g is the mean of
    the person's group; only places move with its velocity. g of a person alone is the own state, not that of all
    people alone (a reading).
    """
    particles, partitions, n = label.shape
    sums, size, residual = np.empty((n + 1, 2)), np.empty(n + 1), np.empty(4)
    for i in range(particles):
        for j in range(partitions):
            if j > 0 and same_row(label[i, j], label[i, j - 1]):
                out[i, j] = out[i, j - 1]
                continue
            sums[:], size[:] = 0.0, 0.0
            for k in range(n):
                g = label[i, j, k]
                size[g] += 1
                sums[g, 0] += old[i, k, 2]
                sums[g, 1] += old[i, k, 3]
            total = 0.0
            for k in range(n):
                g = label[i, j, k]
                for d in range(2):
                    velocity = old[i, k, d + 2]
                    if g > 0:
                        velocity = sums[g, d] / size[g]
                    residual[d] = new[i, k, d] - (old[i, k, d] + dt * velocity)
                    residual[d + 2] = new[i, k, d + 2] - old[i, k, d + 2]
                total += log_normal(residual, precision, log_scale)
            out[i, j] = total


@njit(cache=True)
def own_dynamics(new: Array, old: Array, precision: Array, log_scale: float, dt: float, out: Array) -> None:
    """Writes log N(x_{t+1}; A x_t, Sigma) of each person, (N_x, K), eq. 3; dt = 0: the person stands still."""
    particles, n, _ = new.shape
    residual = np.empty(4)
    for i in range(particles):
        for k in range(n):
            for d in range(2):
                residual[d] = new[i, k, d] - (old[i, k, d] + dt * old[i, k, d + 2])
                residual[d + 2] = new[i, k, d + 2] - old[i, k, d + 2]
            out[i, k] = log_normal(residual, precision, log_scale)
