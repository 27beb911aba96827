"""A group of `stereo`: its extended Kalman filter, its spread, and the clocks of its life.

    X_k+1 = Phi X_k + noise                                  constant velocity (eqs 2, 3)
    Z = f(X_k) + noise                                       (u, v, d) of the mean of the group's points (eqs 4 to 6)
    Sigma <- alpha_s Sigma + (1 - alpha_s) C_y               covariance of its points' positions and velocities (eq. 7)

The filter is filterpy's. The paper's Phi has a step of 1 frame; here times are seconds. The paper has one covariance of
a group; here P is that of the centroid, by the filter, and Sigma that of the members. Departures: C_y is without the
points' own covariances and is shrunk to a prior, as the covariance of few points in six dimensions is singular.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from sim.types import Array
from tracking.detect.features import SpacePoints
from tracking.grouping.whole_groups import NO_ID
from tracking.papers.stereo.config import StereoConfig
from tracking.papers.stereo.measurement import POS, VEL, Measurement, measured_state, state_jacobian

if TYPE_CHECKING:
    from filterpy.kalman import ExtendedKalmanFilter

VELOCITY_SPREAD = 0.25  # m/s: standard deviation of velocities that a group's spread is shrunk to (ours).
LEAST_VARIANCE = 1e-6  # m^2, m^2/s^2: least eigenvalue of a spread.


@dataclass
class SpaceGroup:
    """A group.

    ekf: filter with the state x (6, 1), order x, x', y, y', z, z', and its covariance P. spread (6, 6): Sigma, in
    the same order. count: N, number of its points in its last measured frame. id: NO_ID while tentative.
    first_seen, last_seen: s; measured_time: s. parent: id of the group that it split from, or NO_ID. members (K,
    3): expected places of its points relative to its position, m, when it was measured last. apart_since: s since when
    its points have been unlinked parts, nan if they are not or it was not measured.
    """

    ekf: ExtendedKalmanFilter
    spread: Array
    count: float
    id: int
    first_seen: float
    last_seen: float
    measured_time: float
    parent: int = NO_ID
    members: Array = field(default_factory=lambda: np.zeros((0, 3)))
    apart_since: float = float("nan")

    @property
    def pos(self) -> Array:
        """Position (3,), m."""
        return np.asarray(self.ekf.x[POS, 0])

    @property
    def confirmed(self) -> bool:
        """True if the group has an id."""
        return self.id != NO_ID


@dataclass(frozen=True, eq=False)
class Motion3D:
    """The model of motion for a step of dt s: Phi (6, 6) (eq. 3) and the process noise Q (6, 6) of a white acceleration
    of `config`."""

    config: StereoConfig
    dt: float
    Phi: Array
    Q: Array


def motion_model(config: StereoConfig, dt: float) -> Motion3D:
    """Returns the model of motion for a step of dt s, with filterpy's Q_continuous_white_noise."""
    from filterpy.common import Q_continuous_white_noise

    Phi = np.kron(np.eye(3), np.array([[1.0, dt], [0.0, 1.0]]))
    Q = np.kron(config.accel_noise**2 * np.eye(3), Q_continuous_white_noise(2, dt))
    return Motion3D(config, dt, Phi, Q)


def predict(group: SpaceGroup, motion: Motion3D) -> None:
    """Predict a group to the next frame, in place: X = Phi X, P = Phi P Phi' + Q (eq. 2)."""
    group.ekf.F, group.ekf.Q = motion.Phi, motion.Q
    group.ekf.predict()


def newborn(points: SpacePoints, measurement: Measurement, motion: Motion3D, t: float) -> SpaceGroup:
    """Returns a tentative group of M points, M at least 1, with their mean position, velocity and covariance (sec.
    3.4)."""
    from filterpy.kalman import ExtendedKalmanFilter

    config, n = motion.config, len(points)
    ekf = ExtendedKalmanFilter(dim_x=6, dim_z=3)
    ekf.P = np.zeros((6, 6))
    mean, weights = mean_position(points, measurement, config)
    ekf.x[POS, 0], ekf.x[VEL, 0] = mean, points.vel.mean(0)
    ekf.P[np.ix_(POS, POS)] = mean_covariance(points, weights, config)
    ekf.P[np.ix_(VEL, VEL)] = points.vel_cov.mean(0) / n + VELOCITY_SPREAD**2 / n * np.eye(3)
    group = SpaceGroup(ekf, spread_of(points, config), float(n), NO_ID, t, t, motion.dt)
    _place_members(group, points, config)
    return group


def mean_position(points: SpacePoints, measurement: Measurement, config: StereoConfig) -> tuple[Array, Array]:
    """Returns the mean position (3,), m, of M points and their weights (M,) in it, with sum 1 (ours)."""
    weights = measurement.weights(points, config.density_width)
    weights = weights / weights.sum()
    return weights @ points.pos, weights


def mean_covariance(points: SpacePoints, weights: Array, config: StereoConfig) -> Array:
    """Returns the covariance (3, 3), m^2, of the mean of M points as a measurement of their group's position."""
    errors = np.einsum("m,mij->ij", weights**2, points.cov)
    return np.asarray(errors + config.centroid_noise**2 * np.eye(3))


def spread_of(points: SpacePoints, config: StereoConfig) -> Array:
    """Returns C_y (6, 6): covariance of the positions and velocities of M points, order x, x', y, y', z, z' (eq. 7)."""
    n = len(points)
    y = np.zeros((n, 6))
    y[:, POS], y[:, VEL] = points.pos, points.vel
    C = np.cov(y.T, bias=True) if n > 1 else np.zeros((6, 6))
    if config.point_covariance:
        C[np.ix_(POS, POS)] -= points.cov.mean(0)
        C[np.ix_(VEL, VEL)] -= points.vel_cov.mean(0)
        both = (points.lag[:, None, None] * points.vel_cov).mean(0)
        C[np.ix_(POS, VEL)] -= both
        C[np.ix_(VEL, POS)] -= both.T
        values, U = np.linalg.eigh(C)
        C = (U * np.maximum(values, 0.0)) @ U.T
    w = config.spread_weight
    prior = np.square(np.tile([config.person_spread, VELOCITY_SPREAD], 3))
    return np.asarray((n * C + w * np.diag(prior)) / (n + w)) + LEAST_VARIANCE * np.eye(6)


def measure(group: SpaceGroup, points: SpacePoints, measurement: Measurement, motion: Motion3D, t: float) -> None:
    """Update a group, in place, by its M points of the frame at t s: state (eqs 4 to 6), Sigma (eq. 7) and N."""
    config = motion.config
    mean, weights = mean_position(points, measurement, config)
    J = measurement.jacobian(mean)
    R = J @ mean_covariance(points, weights, config) @ J.T
    group.ekf.update(
        measurement.z(mean), state_jacobian, measured_state, R, args=(measurement,), hx_args=(measurement,)
    )
    group.ekf.P = (group.ekf.P + group.ekf.P.T) / 2
    keep = np.exp(-motion.dt / config.spread_time)
    group.spread = keep * group.spread + (1 - keep) * spread_of(points, config)
    group.count, group.last_seen = float(len(points)), t
    group.measured_time += motion.dt
    _place_members(group, points, config)


def _place_members(group: SpaceGroup, points: SpacePoints, config: StereoConfig) -> None:
    offset = points.pos - group.pos
    spread = group.spread[np.ix_(POS, POS)]
    group.members = expected_places(offset, points.cov, spread) if config.point_covariance else offset


def expected_places(offset: Array, cov: Array, spread: Array) -> Array:
    """Returns the expected offsets (M, 3), m, of a group's points from its centroid: Sigma (Sigma + C_i)^-1 (y_i - xi)
    (ours)."""
    return np.asarray((spread @ np.linalg.solve(spread + cov, offset[..., None]))[..., 0])
