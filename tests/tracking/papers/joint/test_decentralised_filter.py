"""Algorithm 1 on a linear-Gaussian state (X, Z), against the Kalman filter (companion page, section 4, E1)."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from tracking.papers.joint.decentralised_filter import Nested, advance, log_sum, normalised

A = np.array([[0.9, 0.5], [0.0, 0.8]])
Q = np.array([0.3, 0.4])
# x' = A (x, z) + noise, z alike; y = H (x, z) + noise; standard deviations Q, R, and that of the proposal of x.
H, R, WIDE = np.array([1.0, 0.6]), 0.5, 0.6


def log_normal(x, mean, spread):
    return -(((x - mean) / spread) ** 2) / 2 - np.log(spread) - np.log(2 * np.pi) / 2


class Toy:
    """A scalar X and a scalar Z; y is the frame's measurement. With `ratio` False p_{N_z}(X' | X) / pi is left out."""

    def __init__(self, draws, ratio):
        self.draws, self.ratio, self.y, self.log_q = draws, ratio, 0.0, np.zeros(0)

    def individuals(self, x, z):
        return A[0, 0] * x + WIDE * self.draws.standard_normal(x.shape), np.zeros(x.shape[:2])

    def dynamics(self, new, x, z):
        mean = A[0, 0] * x[..., 0] + A[0, 1] * z
        out = log_normal(new[..., 0], mean, Q[0]) - log_normal(new[..., 0], A[0, 0] * x[..., 0], WIDE)
        return out if self.ratio else out - log_sum(self.log_q + out)[:, None]

    def groups(self, new, x, z):
        return A[1, 1] * z + Q[1] * self.draws.standard_normal(z.shape)

    def energy(self, new, z):
        return log_normal(self.y, H[0] * new[..., 0] + H[1] * z, R)


def kalman(ys):
    x, P, out = np.zeros(2), np.eye(2), []
    for y in ys:
        x, P = A @ x, A @ P @ A.T + np.diag(Q**2)
        K = P @ H / (H @ P @ H + R**2)
        x, P = x + K * (y - H @ x), P - np.outer(K, H @ P)
        out.append(x.copy())
    return np.array(out)


def measurements(frames, seed):
    rng, s, out = np.random.default_rng(seed), np.zeros(2), []
    for _ in range(frames):
        s = A @ s + Q * rng.standard_normal(2)
        out.append(H @ s + R * rng.standard_normal())
    return out


@cache
def error(particles, partitions, ratio=True, frames=25, seeds=4):
    """The root mean square difference of the means of x and z to the Kalman filter."""
    found = []
    for seed in range(seeds):
        rng, ys = np.random.default_rng(100 + seed), measurements(frames, seed)
        toy = Toy(rng, ratio)
        nested = Nested(
            rng.standard_normal((particles, 1, 1)), rng.standard_normal((particles, partitions)),
            np.full((particles, partitions), -np.log(partitions)), np.zeros((particles, 1)), np.zeros(particles),
        )  # fmt: skip
        for y, exact in zip(ys, kalman(ys), strict=True):
            toy.y, toy.log_q = y, nested.log_q
            nested = advance(nested, toy, rng.random(particles))
            w = nested.weights()
            found.append([*(w @ nested.x[:, 0]), w @ (np.exp(nested.log_q) * nested.z).sum(axis=1)] - exact)
            nested = nested.resampled(rng.random(1))
    return float(np.sqrt(np.mean(np.square(found))))


def test_the_error_falls_as_the_root_of_the_number_of_particles():
    counts = [50, 200, 800, 3200]
    errors = [error(n, 20) for n in counts]
    assert np.polyfit(np.log(counts), np.log(errors), 1)[0] == pytest.approx(-0.5, abs=0.12)
    assert errors[-1] < 0.03


def test_without_the_ratio_of_dynamics_and_proposal_it_does_not_converge():
    assert error(3200, 20, ratio=False) > 3 * error(3200, 20)


def test_log_sums_and_weights():
    values = np.log(np.array([[1.0, 3.0], [0.5, 0.5]])) - 800
    np.testing.assert_allclose(log_sum(values), np.log([4, 1]) - 800)
    np.testing.assert_allclose(normalised(values), [[0.25, 0.75], [0.5, 0.5]])
    with np.errstate(divide="ignore"):
        assert log_sum(np.log(np.zeros((1, 2))))[0] == -np.inf


def test_components_are_resampled_by_their_own_weights():
    log_w = np.log(np.array([[1.0, 0.5], [1e-9, 0.5]]))
    particle = np.tile(np.arange(2)[:, None, None], (1, 2, 2))
    nested = Nested(particle[..., :1], particle[:, :1], np.zeros((2, 1)), log_w, np.log([1e-9, 1.0]))
    nested = nested.resampled(np.full(3, 0.5), one_by_one=True)
    assert nested.x[..., 0].T.tolist() == [[0, 0], [1, 1]]
    assert nested.z[:, 0].tolist() == [[1, 1], [1, 1]]
