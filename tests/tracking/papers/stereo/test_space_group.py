"""The filter of a group: linear limit, consistency at three depths, no bias of depth, two points are no measurement."""

from __future__ import annotations

import numpy as np
import pytest
from filterpy.kalman import KalmanFilter

from sim.scene.camera import back_project, point_covariances, project_pair
from tests.sim.scene.test_camera_stereo import rig
from tracking.detect.features import SpacePoints
from tracking.papers.stereo import space_group
from tracking.papers.stereo.config import StereoConfig
from tracking.papers.stereo.space_group import POS, VEL, Measurement

DT = 1 / 30
# A rig that tells depths at 20 m: 25 px of disparity.
FIT = {"tilt": 20.0, "focal": 1000.0, "baseline": 0.5, "height": 3.0}


def at_places(pos: np.ndarray, cov: np.ndarray, vel: np.ndarray | None = None, vel_cov: float = 0.01) -> SpacePoints:
    n = len(pos)
    vel = np.zeros((n, 3)) if vel is None else vel
    return SpacePoints(np.arange(1, n + 1), pos, cov, vel, np.repeat(vel_cov * np.eye(3)[None], n, 0))


def cloud(seed: int, count: int, centre, sd: float = 0.3) -> np.ndarray:
    return np.asarray(centre) + sd * np.random.default_rng(seed).standard_normal((count, 3))


def test_the_state_jacobian_is_that_of_central_differences() -> None:
    measurement, step = Measurement(rig(40.0)), 1e-5
    x = np.array([[1.5, 0.7, 6.0, -0.3, 1.1, 0.1]]).T
    numeric = [
        (
            space_group.measured_state(x + step * e[:, None], measurement)
            - space_group.measured_state(x - step * e[:, None], measurement)
        )[:, 0]
        for e in np.eye(6)
    ]
    assert np.abs(space_group.state_jacobian(x, measurement) - np.stack(numeric, 1) / (2 * step)).max() < 1e-6


def test_a_linear_measurement_makes_it_a_kalman_filter() -> None:
    config = StereoConfig()
    motion, r = space_group.motion_model(config, DT), np.random.default_rng(0)
    points = at_places(cloud(1, 8, [1, 2, 1]), np.repeat(0.01 * np.eye(3)[None], 8, 0))
    group = space_group.newborn(points, Measurement(), motion, 0.0)
    kf = KalmanFilter(dim_x=6, dim_z=3)
    kf.x, kf.P, kf.F, kf.Q = group.ekf.x.copy(), group.ekf.P.copy(), motion.Phi, motion.Q
    kf.H = np.eye(6)[POS]
    for k in range(1, 40):
        space_group.predict(group, motion)
        kf.predict()
        pos = points.pos + DT * k * np.array([1.0, 0.3, 0.0]) + 0.1 * r.standard_normal((8, 3))
        space_group.measure(group, at_places(pos, points.cov), Measurement(), motion, DT * k)
        kf.update(pos.mean(0)[:, None], R=(0.01 / 8 + config.centroid_noise**2) * np.eye(3))
        assert np.abs(group.ekf.x - kf.x).max() < 1e-12
        assert np.abs(group.ekf.P - kf.P).max() < 1e-12


@pytest.mark.slow
@pytest.mark.parametrize("depth", [5.0, 10.0, 20.0])
def test_errors_have_the_stated_covariance(depth: float) -> None:
    """NEES of the state over 60 runs of 2 s: 6 in the mean, within 99 % of chi-square."""
    camera = rig(**FIT)
    config = StereoConfig(centroid_noise=0.05, accel_noise=0.5, density_width=20.0)
    measurement, motion, n, runs = Measurement(camera), space_group.motion_model(config, DT), 12, 60
    deviations, nees = np.array([0.3, 0.3, 0.25]), []
    for run in range(runs):
        r = np.random.default_rng([run, int(depth)])
        noise = np.linalg.cholesky(motion.Q)
        x = np.zeros(6)
        x[POS] = camera.position + depth * camera.rotation[2]
        x[VEL] = [0.8, -0.5, 0.0]
        members = cloud(run, n, [0, 0, 0], 0.25)
        members -= members.mean(0)
        group = None
        for k in range(60):
            x = motion.Phi @ x + noise @ r.standard_normal(6)
            true = x[POS] + members + config.centroid_noise * r.standard_normal(3)
            uvd = project_pair(camera, true) + deviations * r.standard_normal((n, 3))
            pos = back_project(camera, uvd)
            points = at_places(pos, point_covariances(camera, pos, deviations**2))
            if group is None:
                group = space_group.newborn(points, measurement, motion, 0.0)
                group.ekf.x[VEL, 0] = x[VEL] + 0.2 * r.standard_normal(3)
                group.ekf.P[np.ix_(VEL, VEL)] = 0.04 * np.eye(3)
            else:
                space_group.predict(group, motion)
                space_group.measure(group, points, measurement, motion, k * DT)
        e = group.ekf.x[:, 0] - x
        nees.append(e @ np.linalg.solve(group.ekf.P, e))
    sd = np.sqrt(2 * 6 / runs)
    assert abs(np.mean(nees) - 6) < 2.6 * sd + 0.3


@pytest.mark.slow
def test_depth_has_no_bias_where_members_stand_at_many_depths() -> None:
    """The mean of their disparities would tell a depth 0.13 m too small."""
    camera, r = rig(0.0, focal=246.0), np.random.default_rng(5)
    z = 8.0 + r.standard_normal(400)
    z += 8.0 - z.mean()
    pos = camera.position + z[:, None] * camera.rotation[2]
    d = project_pair(camera, pos)[:, 2]
    assert 246 * 0.12 / d.mean() - 8.0 < -0.1
    config, measurement = StereoConfig(density_width=20.0), Measurement(camera)
    motion = space_group.motion_model(config, DT)
    points = at_places(pos, point_covariances(camera, pos, np.square([0.3, 0.3, 0.15])))
    group = space_group.newborn(points, measurement, motion, 0.0)
    for k in range(1, 30):
        space_group.predict(group, motion)
        space_group.measure(group, points, measurement, motion, k * DT)
    assert abs((group.pos - camera.position) @ camera.rotation[2] - 8.0) < 0.02


def test_the_spread_is_that_of_the_members_without_their_errors() -> None:
    r, n = np.random.default_rng(0), 4000
    place = np.array([0.5, 0.3, 0.4]) * r.standard_normal((n, 3))
    cov = np.repeat(np.diag([0.01, 0.1, 0.02])[None], n, 0)
    pos = place + np.sqrt([0.01, 0.1, 0.02]) * r.standard_normal((n, 3))
    points = at_places(pos, cov, vel=0.1 * r.standard_normal((n, 3)), vel_cov=1e-9)
    found = np.sqrt(np.diag(space_group.spread_of(points, StereoConfig())))
    assert found[POS] == pytest.approx([0.5, 0.3, 0.4], abs=0.03)
    assert found[VEL] == pytest.approx([0.1, 0.1, 0.1], abs=0.03)
    raw = np.sqrt(np.diag(space_group.spread_of(points, StereoConfig(point_covariance=False))))
    assert raw[POS[1]] == pytest.approx(np.sqrt(0.09 + 0.1), abs=0.03)
