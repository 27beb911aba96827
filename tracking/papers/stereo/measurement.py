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

POS, VEL = [0, 2, 4], [1, 3, 5]
"""Entries of the state that are the position and the velocity."""


class Measurement(Protocol):
    """What a filter measures of a position: the functions of eq. 6."""

    def z(self, xyz: Array) -> Array:
        """Return the measurement (3, 1) of a position (3,), m."""
        ...

    def jacobian(self, xyz: Array) -> Array:
        """Return dZ/d(x, y, z) (3, 3) at a position (3,), m."""
        ...

    def areas(self, xyz: Array) -> Array:
        """Return the area (M,) on people that a point at each of the places (M, 3), m, stands for, up to a factor."""
        ...


class PairMeasurement:
    """Z = (u, v, d) in px, by a stereo camera (eqs 4, 6 with the camera's pose)."""

    def __init__(self, camera: Camera) -> None:
        self.camera = camera

    def z(self, xyz: Array) -> Array:
        """Return u, v, d (3, 1) in px of a position (3,), m."""
        return project_pair(self.camera, xyz[None]).T

    def jacobian(self, xyz: Array) -> Array:
        """Return d(u, v, d)/d(x, y, z) (3, 3) in px/m."""
        return np.asarray(pair_jacobian(self.camera, xyz[None])[0])

    def areas(self, xyz: Array) -> Array:
        """Return the squared depths (M,): features keep a distance in the image."""
        return np.asarray(np.square((xyz - self.camera.position) @ self.camera.rotation[2]))


class PlaceMeasurement:
    """Z = (x, y, z) in m: points whose places are measured directly."""

    def z(self, xyz: Array) -> Array:
        """Return the position (3,) as a column (3, 1), m."""
        return xyz[:, None]

    def jacobian(self, xyz: Array) -> Array:
        """Return the unit matrix (3, 3)."""
        del xyz
        return np.eye(3)

    def areas(self, xyz: Array) -> Array:
        """Return ones (M,): each point is a person."""
        return np.ones(len(xyz))


def measured_state(x: Array, measurement: Measurement) -> Array:
    """Return f(X) (3, 1) of a state x (6, 1): eq. 6."""
    return measurement.z(x[POS, 0])


def state_jacobian(x: Array, measurement: Measurement) -> Array:
    """Return df/dX (3, 6) at a state x (6, 1); the columns of velocities are 0."""
    H = np.zeros((3, 6))
    H[:, POS] = measurement.jacobian(x[POS, 0])
    return H
