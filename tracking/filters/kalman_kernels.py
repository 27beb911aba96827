"""Kernel of kalman: distances of measurements from all filters."""

from __future__ import annotations

import numpy as np

from sim.compiler import njit
from sim.types import Array


@njit(cache=True)
def distances(place: Array, s: Array, z: Array, scale: Array) -> tuple[Array, Array]:
    """Returns squared Mahalanobis distances (N, M) of N predicted filters and M measurements z (M, D) (eq. 9), and ln
    |2 pi S| (N,).

    place, s (N, D): predicted places, and variances of the innovation. scale (N,): units of z per square root of the
    variances' unit (px per m).
    """
    d2, log_det, z = np.zeros((len(place), len(z))), np.zeros(len(place)), z.T.copy()
    for i in range(len(place)):
        for axis in range(len(z)):  # the inner loop runs along memory
            w = 1.0 / (s[i, axis] * scale[i] ** 2)
            log_det[i] += np.log(2 * np.pi * s[i, axis])
            for j in range(z.shape[1]):
                d2[i, j] += (z[axis, j] - place[i, axis]) ** 2 * w
    return d2, log_det
