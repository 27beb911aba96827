"""A group of `stereo`: its extended Kalman filter, its spread, and its association with points.

    X_k+1 = Phi X_k + noise                                  constant velocity (eqs 2, 3)
    Z = f(X_k) + noise                                       (u, v, d) of the mean of the group's points (eqs 4 to 6)
    Sigma <- alpha_s Sigma + (1 - alpha_s) C_y               covariance of its points' positions and velocities (eq. 7)

The filter is filterpy's. P is the covariance of the centroid, Sigma that of the members, which changes in frames in
which the group is measured.

The measurement (eqs 4 to 6): from pictures Z = (u, v, d), the projection of the mean of the group's points in space.
The mean of their (u, v, d) would be biased, as the depth b f / d is no linear function of d (the bias is -var(z) / z).
From detections Z = (x, y, z), so that the filter is a linear Kalman filter.

Data association (sec. 3.3): which group each point belongs to.

    (y_i - xi_j)' S^-1 (y_i - xi_j) < gamma                  search region of group j (eq. 8)
    m_total = p(y_i | xi_j, P_xi)^k_p p(lambda_i | v_j, P_v)^k_v            (eqs 9 to 11)

Each point belongs to the group with the largest m_total among those in whose region it lies. S is the sum of the
group's spread Sigma and the covariance P of its centroid, and with `point_covariance` that of the point, C_i. P grows
while a group is hidden, so that it finds its points again. P_xi and P_v are the blocks of S for positions and
velocities. Departures are listed in `tracker`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from sim.scene.camera import pair_jacobian, project_pair
from sim.types import Array, Camera, Ints
from tracking.detect.features import SpacePoints
from tracking.grouping.whole_groups import NO_ID
from tracking.papers.stereo.config import StereoConfig

if TYPE_CHECKING:
    from filterpy.kalman import ExtendedKalmanFilter


POS, VEL = [0, 2, 4], [1, 3, 5]  # Entries of the state that are the position and the velocity.
TOP = 0.9  # Share of a group's features, by weight, that are below its top.


@dataclass(frozen=True)
class Measurement:
    """What a filter measures of a position (eq. 6): Z = (u, v, d), px, by a stereo camera (eqs 4, 6 with the camera's
    pose), or, without a camera, Z = (x, y, z), m: points whose places are measured directly."""

    camera: Camera | None = None

    def z(self, xyz: Array) -> Array:
        """Returns the measurement (3, 1) of a position (3,), m."""
        return xyz[:, None] if self.camera is None else project_pair(self.camera, xyz[None]).T

    def jacobian(self, xyz: Array) -> Array:
        """Returns dZ/d(x, y, z) (3, 3) at a position (3,), m."""
        return np.eye(3) if self.camera is None else np.asarray(pair_jacobian(self.camera, xyz[None])[0])

    def weights(self, points: SpacePoints, width: float) -> Array:
        """Returns the weights (M,) of M points in their group's mean position; width: of the kernel of density, m."""
        # each point is a person, but a person may have any number of features
        return np.ones(len(points)) if self.camera is None else inverse_densities(points, width)

    def rise(self, z: Array, weights: Array, top_offset: float) -> float:
        """Returns how far, m, the middle of bodies is above the mean of M points with heights z (M,) and weights:
        `top_offset` below the top of features (ours); 0 from points, or if top_offset is 0."""
        if self.camera is None or not top_offset:
            return 0.0
        # others and the edge of the picture hide legs, but seldom heads: the mean height changes with what is seen
        order = np.argsort(z)
        top = min(int(np.searchsorted(np.cumsum(weights[order]), TOP)), len(z) - 1)
        return float(z[order[top]] - top_offset - weights @ z)


def inverse_densities(points: SpacePoints, width: float) -> Array:
    """Returns the inverse of the density of M points on the ground at each of them, (M,), up to a factor (ours)."""
    d = points.pos[:, None, :2] - points.pos[:, :2]
    S = points.cov[:, None, :2, :2] + points.cov[:, :2, :2]
    a, b, c = S[..., 0, 0] + width**2, S[..., 0, 1], S[..., 1, 1] + width**2
    d2 = (c * d[..., 0] ** 2 - 2 * b * d[..., 0] * d[..., 1] + a * d[..., 1] ** 2) / (a * c - b**2)
    return np.asarray(1 / np.exp(-d2 / 2).sum(1))


def measured_state(x: Array, measurement: Measurement) -> Array:
    """Returns f(X) (3, 1) of a state x (6, 1): eq. 6."""
    return measurement.z(x[POS, 0])


def state_jacobian(x: Array, measurement: Measurement) -> Array:
    """Returns df/dX (3, 6) at a state x (6, 1); the columns of velocities are 0."""
    H = np.zeros((3, 6))
    H[:, POS] = measurement.jacobian(x[POS, 0])
    return H


VELOCITY_SPREAD = 0.25  # m/s: standard deviation of velocities that a group's spread is shrunk to (ours).
LEAST_VARIANCE = 1e-6  # m^2, m^2/s^2: least eigenvalue of a spread.


@dataclass
class SpaceGroup:
    """A group of points in space, confirmed or tentative.

    ekf: filter with the state x (6, 1), order x, x', y, y', z, z', and its covariance P. spread (6, 6): Sigma, in
    the same order. count: N, number of its points in its last measured frame. id: NO_ID while tentative.
    first_seen, last_seen: s; measured_time: s. parent: id of the group that it split from, or NO_ID. members (K,
    3): expected places of its points relative to its position, m, when it was measured last. apart_since: s since when
    its points have been unlinked parts, nan if they are not or it was not measured. rise: m from its position up to the
    middle of its members' bodies, smoothed as Sigma.
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
    rise: float = 0.0

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
    """Predicts a group to the next frame, in place: X = Phi X, P = Phi P Phi' + Q (eq. 2)."""
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
    rise = measurement.rise(points.pos[:, 2], weights, config.top_offset)
    group = SpaceGroup(ekf, spread_of(points, config), float(n), NO_ID, t, t, motion.dt, rise=rise)
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
        values, U = np.linalg.eigh(C)
        C = (U * np.maximum(values, 0.0)) @ U.T
    w = config.spread_weight
    prior = np.square(np.tile([config.person_spread, VELOCITY_SPREAD], 3))
    return np.asarray((n * C + w * np.diag(prior)) / (n + w)) + LEAST_VARIANCE * np.eye(6)


def measure(group: SpaceGroup, points: SpacePoints, measurement: Measurement, motion: Motion3D, t: float) -> None:
    """Updates a group, in place, by its M points of the frame at t s: state (eqs 4 to 6), Sigma (eq. 7) and N."""
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
    group.rise = keep * group.rise + (1 - keep) * measurement.rise(points.pos[:, 2], weights, config.top_offset)
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


def associated(groups: Sequence[SpaceGroup], points: SpacePoints, config: StereoConfig) -> Ints:
    """Returns for each of M points the number of its group in `groups`, (M,), -1 for none (eqs 8 to 11)."""
    if not groups or not len(points):
        return np.full(len(points), -1)
    x = np.stack([g.ekf.x[:, 0] for g in groups])
    own = np.stack([g.spread + g.ekf.P for g in groups])
    total = np.full((len(groups), len(points)), -np.inf)
    g, m = _in_reach(x, own, points, config)
    d2, position = _log_density(points.pos[m] - x[g][:, POS], own[g], points.cov[m], POS, config)
    near = d2 < config.gate
    g, m, position = g[near], m[near], position[near]
    _, velocity = _log_density(points.vel[m] - x[g][:, VEL], own[g], points.vel_cov[m], VEL, config)
    total[g, m] = position + config.velocity_weight * velocity
    inside = np.zeros(total.shape, bool)
    inside[g, m] = True
    return np.where(inside.any(0), total.argmax(0), -1)


def _in_reach(x: Array, own: Array, points: SpacePoints, config: StereoConfig) -> tuple[Ints, Ints]:
    trace, square = np.einsum("gii->g", own[:, POS][:, :, POS]), np.zeros((len(x), len(points)))
    spread = np.einsum("mii->m", points.cov) if config.point_covariance else np.zeros(len(points))
    for d, k in enumerate(POS):
        square += np.square(points.pos[:, d] - x[:, k, None])
    rows, columns = np.nonzero(square <= config.gate * (1 + 1e-9) * (trace[:, None] + spread))
    return np.asarray(rows, np.int64), np.asarray(columns, np.int64)


def _log_density(away: Array, own: Array, cov: Array, part: list[int], config: StereoConfig) -> tuple[Array, Array]:
    S = own[:, part][:, :, part]
    if config.point_covariance:
        S = S + cov
    inverse = np.linalg.inv(S)
    d2 = np.einsum("ri,rij,rj->r", away, inverse, away)
    return d2, (np.linalg.slogdet(inverse)[1] - d2) / 2
