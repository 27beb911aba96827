"""The ellipse of a normal distribution in the plane, as points to draw."""

from __future__ import annotations

import math

import numpy as np

from sim.types import Array

SIGMA_95 = math.sqrt(5.991)
"""Standard deviations: the ellipse at this distance holds 95 % of a normal distribution in the plane."""

SIGMA_99 = math.sqrt(9.21)
"""The same for 99 %: the points d from a group's centre with d' E^-1 d = 9.21 for its extent E."""

UNIT_CIRCLE = np.stack([f(np.linspace(0, 2 * np.pi, 32, endpoint=False)) for f in (np.cos, np.sin)], axis=1)


def ellipse(centre: Array, cov: Array, sigmas: float) -> Array:
    """Returns 32 points (32, 2) of the ellipse at `sigmas` standard deviations round `centre`, none if `cov` is not
    finite."""
    if not np.isfinite(cov).all():
        return np.zeros((0, 2))
    values, vectors = np.linalg.eigh(cov)
    return np.asarray(centre + sigmas * (UNIT_CIRCLE * np.sqrt(np.maximum(values, 0.0))) @ vectors.T)
