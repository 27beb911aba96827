"""The individuals' proposal and dynamics (companion page, section 4, E3 and E4)."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.reference_joint import all_partitions, label_of, log_group_dynamics
from tracking.filters.person_streams import PersonStreams
from tracking.papers.joint.config import JointConfig
from tracking.papers.joint.distributions import FrameModel
from tracking.papers.joint.group_proposal_kernels import group_dynamics
from tracking.papers.joint.individuals import Proposal, log_density, moved, precision_of, process_noise

DT, NOISE = 0.1, 0.1
SIGMA = process_noise(0.2, 0.8, DT)


def covariance(sigma):
    """The covariance (4, 4) of x, y, vx, vy."""
    place, cross, rate = sigma
    return np.kron([[place, cross], [cross, rate]], np.eye(2))


def drawn(alpha, informed, z, count=40_000, sigma=SIGMA):
    rng = np.random.default_rng(0)
    state = np.tile([1.0, 2.0, 0.5, -0.3], (count, 1, 1))
    proposal = Proposal(sigma, NOISE, DT, alpha, informed)
    return state, *proposal.draw(state, np.array([z]), rng.standard_normal((count, 1, 4)), rng.random((count, 1)))


@pytest.mark.parametrize("informed", [True, False])
@pytest.mark.parametrize("alpha", [0.3, 1.0])
def test_the_proposals_density_is_that_of_its_draws(alpha, informed):
    """The mean of f / pi over draws of pi is the integral of f: here N(y; A x, S), exact (E3)."""
    z = np.array([1.15, 1.9])
    state, _, log_w = drawn(alpha, informed, z)
    S = (SIGMA[0] + NOISE**2) * np.eye(2)
    away = z - moved(state[0, 0], DT)[:2]
    exact = np.exp(-away @ np.linalg.solve(S, away) / 2) / (2 * np.pi * np.sqrt(np.linalg.det(S)))
    assert np.exp(log_w).mean() == pytest.approx(exact, rel=0.03)


def test_the_informed_proposal_is_the_posterior_of_the_step():
    z = np.array([1.15, 1.9])
    state, new, log_w = drawn(0.0, True, z)
    P, H = covariance(SIGMA), np.eye(4)[:2]
    K = P @ H.T @ np.linalg.inv(H @ P @ H.T + NOISE**2 * np.eye(2))
    mean = moved(state[0, 0], DT)
    np.testing.assert_allclose(new[:, 0].mean(axis=0), mean + K @ (z - mean[:2]), atol=0.01)
    np.testing.assert_allclose(np.cov(new[:, 0].T), P - K @ H @ P, atol=2e-3)
    assert np.ptp(log_w) < 1e-9


def dynamics(new, old, label):
    out = np.empty(label.shape[:2])
    group_dynamics(new, old, label, *precision_of(SIGMA), DT, out)
    return out, log_density(new, moved(old, DT), SIGMA)


def test_eq_5_is_that_of_all_partitions():
    rng = np.random.default_rng(2)
    old, new = rng.normal(0, 0.5, (2, 3, 4, 4))
    parts = list(all_partitions(4))
    label = np.array([[label_of(p) for p in parts]] * 3)
    out, _ = dynamics(new, old, label)
    for i in range(3):
        expected = [log_group_dynamics(new[i], old[i], p, covariance(SIGMA), DT) for p in parts]
        np.testing.assert_allclose(out[i], expected)


def test_eq_5_of_people_alone_is_eq_3_to_the_last_bit():
    """E4."""
    rng = np.random.default_rng(3)
    old, new = rng.normal(0, 0.5, (2, 20, 5, 4))
    out, own = dynamics(new, old, np.zeros((20, 2, 5), np.int64))
    assert np.array_equal(out, np.repeat(own.cumsum(axis=1)[:, -1:], 2, axis=1))


def test_missed_people_follow_the_dynamics_and_their_group():
    """Eq. 5; people who are seen are not moved by groups."""
    x = np.tile([[0.0, 0, 1, 0], [0, 1, 2, 3], [9, 9, 1, 1], [0, 9, 0, 2]], (20_000, 1, 1))
    z, nobody, keys = np.tile([1, 1, 0, 0], (20_000, 1)), np.full((4, 2), np.nan), np.arange(4, dtype=np.uint64)
    model = FrameModel(JointConfig(), 0.5, NOISE, nobody, np.zeros((4, 4)), PersonStreams(0), keys)
    new, log_w = model.individuals(x, z)
    assert not log_w.any()
    expected = [[0.75, 0.75, 1, 0], [0.75, 1.75, 2, 3], [9.5, 9.5, 1, 1], [0, 10, 0, 2]]
    np.testing.assert_allclose(new.mean(axis=0), expected, atol=0.02)
    np.testing.assert_allclose(np.cov(new[:, 0].T), covariance(model.sigma), atol=5e-3)
    assert np.array_equal(*(replace(model, z=x[0, :, :2]).individuals(x, groups)[0] for groups in (z, 0 * z)))


def test_the_density_is_the_normal_one():
    rng = np.random.default_rng(1)
    x, mean = rng.normal(0, 0.2, (2, 5, 3, 4))
    P = covariance(SIGMA)
    expected = [
        [-(d @ np.linalg.solve(P, d)) / 2 - np.log(np.linalg.det(2 * np.pi * P)) / 2 for d in row] for row in x - mean
    ]
    np.testing.assert_allclose(log_density(x, mean, SIGMA), expected)
