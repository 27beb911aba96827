"""The measurement of a group by the extended Kalman filter: Z = f(X) + noise (eqs 4 to 6), and its Jacobian.

The state is X = (x, x', y, y', z, z') (eq. 1). From pictures Z = (u, v, d): the projection of the mean of the group's
points in space. Departure: the mean of their (u, v, d) would be biased, as the depth b f / d is no linear function of d
(the bias is -var(z) / z). From detections Z = (x, y, z), so that the filter is a linear Kalman filter.
"""

from __future__ import annotations

from typing import Protocol

import numpy as np

from sim.scene.stereo import pair_jacobian, project_pair
from sim.types import Array, Camera
from tracking.detect.features import SpacePoints

POS, VEL = [0, 2, 4], [1, 3, 5]  # Entries of the state that are the position and the velocity.
LEAST_DENSITY = 0.25  # Least density of features that counts, relative to the highest of the group (ours).


class Measurement(Protocol):
    """What a filter measures of a position: the functions of eq. 6."""

    def z(self, xyz: Array) -> Array:
        """Returns the measurement (3, 1) of a position (3,), m."""
        ...

    def jacobian(self, xyz: Array) -> Array:
        """Returns dZ/d(x, y, z) (3, 3) at a position (3,), m."""
        ...

    def weights(self, points: SpacePoints, width: float) -> Array:
        """Returns the weights (M,) of M points in their group's mean position; width: of the kernel of density, m."""
        ...


class PairMeasurement:
    """Z = (u, v, d) in px, by a stereo camera (eqs 4, 6 with the camera's pose)."""

    def __init__(self, camera: Camera) -> None:
        self.camera = camera

    def z(self, xyz: Array) -> Array:
        """Returns u, v, d (3, 1) in px of a position (3,), m."""
        return project_pair(self.camera, xyz[None]).T

    def jacobian(self, xyz: Array) -> Array:
        """Returns d(u, v, d)/d(x, y, z) (3, 3) in px/m."""
        return np.asarray(pair_jacobian(self.camera, xyz[None])[0])

    def weights(self, points: SpacePoints, width: float) -> Array:
        """Returns `inverse_densities` (M,): a person may have any number of features."""
        return inverse_densities(points, width)


class PlaceMeasurement:
    """Z = (x, y, z) in m: points whose places are measured directly."""

    def z(self, xyz: Array) -> Array:
        """Returns the position (3,) as a column (3, 1), m."""
        return xyz[:, None]

    def jacobian(self, xyz: Array) -> Array:
        """Returns the unit matrix (3, 3)."""
        del xyz
        return np.eye(3)

    def weights(self, points: SpacePoints, width: float) -> Array:
        """Returns ones (M,): each point is a person."""
        del width
        return np.ones(len(points))


def inverse_densities(points: SpacePoints, width: float) -> Array:
    """Returns the inverse of the density of M points on the ground at each of them, (M,), up to a factor (ours)."""
    d = points.pos[:, None, :2] - points.pos[:, :2]
    S = points.cov[:, None, :2, :2] + points.cov[:, :2, :2]
    a, b, c = S[..., 0, 0] + width**2, S[..., 0, 1], S[..., 1, 1] + width**2
    d2 = (c * d[..., 0] ** 2 - 2 * b * d[..., 0] * d[..., 1] + a * d[..., 1] ** 2) / (a * c - b**2)
    density = np.exp(-d2 / 2).sum(1)
    return np.asarray(1 / np.maximum(density, LEAST_DENSITY * density.max()))


def measured_state(x: Array, measurement: Measurement) -> Array:
    """Returns f(X) (3, 1) of a state x (6, 1): eq. 6."""
    return measurement.z(x[POS, 0])


def state_jacobian(x: Array, measurement: Measurement) -> Array:
    """Returns df/dX (3, 6) at a state x (6, 1); the columns of velocities are 0."""
    H = np.zeros((3, 6))
    H[:, POS] = measurement.jacobian(x[POS, 0])
    return H
