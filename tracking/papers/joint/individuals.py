"""The individuals of `joint`: their dynamics (eq. 3), the proposal pi(X_{t+1} | X_{0:t}, y), and p(y | x).

A state is x, y in m and vx, vy in m/s. Sigma of eq. 3 has equal, independent axes; a covariance of one axis is (3,):
variance of the place, covariance of place and velocity, variance of the velocity.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sim.types import Array
from tracking.papers.joint.decentralised_filter import log_sum
from tracking.papers.joint.group_proposal_kernels import CROSS, PLACE, RATE


def process_noise(place: float, velocity: float, dt: float) -> Array:
    """Returns Sigma of one axis, (3,): white acceleration of root density `velocity`, m/s^1.5, and jitter of the place
    of root density `place`, m/s^0.5, over dt s."""
    density = velocity**2
    return np.array([density * dt**3 / 3 + place**2 * dt, density * dt**2 / 2, density * dt])


def precision_of(cov: Array) -> tuple[Array, float]:
    """Returns the precision (3,) of one axis and the log density at the mean of both axes together; cov (3,)."""
    det = cov[PLACE] * cov[RATE] - cov[CROSS] ** 2
    return np.array([cov[RATE], -cov[CROSS], cov[PLACE]]) / det, float(-2 * np.log(2 * np.pi) - np.log(det))


def log_density(x: Array, mean: Array, cov: Array) -> Array:
    """Returns log N(x; mean, Sigma) of states (N, K, 4) with Sigma of one axis cov (3,), (N, K)."""
    precision, scale = precision_of(cov)
    place, rate = np.split(x - mean, 2, axis=-1)
    square = precision[PLACE] * place * place + 2 * precision[CROSS] * place * rate + precision[RATE] * rate * rate
    return np.asarray(scale - square.sum(axis=-1) / 2)


def moved(state: Array, dt: float) -> Array:
    """Returns A x, the states (..., 4) after dt s at constant velocity; state: x, y, vx, vy."""
    out = state.copy()
    out[..., :2] += dt * state[..., 2:]
    return out


@dataclass(frozen=True)
class Proposal:
    """The proposal of each person, a mixture: alpha N(A x, Sigma) + (1 - alpha) pi_det, of each person alone (ours).

    sigma (3,): Sigma of one axis. noise: standard deviation of a measured place, m. dt: s. alpha: share of the
    dynamics. informed: True: pi_det is p(x' | x, y), the product of dynamics and likelihood (ours); False: the
    paper's, Sigma about the detection and the predicted velocity.
    """

    sigma: Array
    noise: float
    dt: float
    alpha: float
    informed: bool

    def draw(self, state: Array, z: Array, normals: Array, uniforms: Array) -> tuple[Array, Array]:
        """Returns new states (N, K, 4) and (N, K): log of p(y | x') N(x'; A x, Sigma) / pi(x')."""
        mean = moved(state, self.dt)
        seen = np.isfinite(z[:, 0])
        target, cov = self.detected(mean, np.where(seen[:, None], z, 0.0))
        from_detection = seen & (uniforms >= self.alpha)
        own, detected = (_coloured(normals, c) for c in (self.sigma, cov))
        new = np.where(from_detection[..., None], target + detected, mean + own)
        log_own = log_density(new, mean, self.sigma)
        with np.errstate(divide="ignore"):
            log_alpha, log_rest = np.log([self.alpha, 1 - self.alpha])
        both = np.stack([log_own + log_alpha, log_density(new, target, cov) + log_rest], axis=-1)
        log_seen = self.log_likelihood(new, np.where(seen[:, None], z, 0.0)) + log_own - log_sum(both)
        return new, np.where(seen, log_seen, 0.0)

    def detected(self, mean: Array, z: Array) -> tuple[Array, Array]:
        """Returns mean (N, K, 4) and covariance (3,) of pi_det; mean: A x; z (K, 2)."""
        target = mean.copy()
        if not self.informed:
            target[..., :2] = z
            return target, self.sigma
        gain = self.sigma[:RATE] / (self.sigma[PLACE] + self.noise**2)
        error = z - mean[..., :2]
        target[..., :2] += gain[PLACE] * error
        target[..., 2:] += gain[CROSS] * error
        a, b, c = self.sigma
        return target, np.array([a - gain[PLACE] * a, b - gain[PLACE] * b, c - gain[CROSS] * b])

    def log_likelihood(self, state: Array, z: Array) -> Array:
        """Returns log p(y | x) (N, K), normal about the place: exp(-lambda d) with the squared distance as d (ours)."""
        square = ((z - state[..., :2]) ** 2).sum(axis=-1)
        return np.asarray(-square / (2 * self.noise**2) - np.log(2 * np.pi * self.noise**2))


def _coloured(normals: Array, cov: Array) -> Array:
    a = np.sqrt(cov[PLACE])
    b = cov[CROSS] / a
    c = np.sqrt(max(cov[RATE] - b * b, 0.0))
    out = np.empty_like(normals)
    out[..., :2] = a * normals[..., :2]
    out[..., 2:] = b * normals[..., :2] + c * normals[..., 2:]
    return out
