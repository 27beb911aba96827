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
    d2, log_det = np.zeros((len(place), len(z))), np.empty(len(place))
    for i in range(len(place)):
        w, log_det[i] = 1.0 / (s[i] * scale[i] ** 2), np.log(2 * np.pi * s[i]).sum()
        for j in range(len(z)):
            for axis in range(z.shape[1]):
                d2[i, j] += (z[j, axis] - place[i, axis]) ** 2 * w[axis]
    return d2, log_det
