"""The uncertainty of a track, rho = sqrt(det S) / its asymptote, and the values of rho that decide about tracks.

Gonzalez et al. (2006, secs. 4.5, 5) manage tracks by sqrt|S|, S the innovation covariance (of measurement minus
predicted place; eq. 6). It falls towards an asymptote while measurements are associated and rises while they are
missed. It does not depend on measured values. This module computes rho and its thresholds;
tracking.papers.blob.tracked_people starts, confirms and deletes tracks by them.

The paper prints no numbers. It confirms "below a certain percentage" of the asymptote; as rho falls towards 1 from
above, the percentage is above 100. It deletes at the value that "a certain number" of misses gives. The value at birth
depends on the first covariance, too. Rules, ours where the paper has none:
- A track is confirmed if rho <= confirm_ratio (above 1) and the measurement of that frame is near.
- A confirmed track is deleted if rho reaches the value after k misses from the steady state. A track that is not yet in
  the steady state gets there after fewer misses.
- A tentative (not confirmed) track is deleted if rho, while the track is missed, reaches its value at birth, or after a
  time limit. The time limit is at least the time that confirmation takes (`time_to_confirm`).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sim.types import Array
from tracking.filters import kalman

MOST_FRAMES = 998  # Frames after which a track counts as confirmed, whatever rho is.


@dataclass(frozen=True)
class Dynamics:
    """The nominal Kalman filter of one track with D coordinates (constant velocity in each); lengths in m."""

    dt: float  # step, s
    sigma: Array  # (D,): standard deviation of the acceleration, m/s^2
    noise: Array  # (D,): variance of a measurement, m^2, above 0
    birth_rate_var: Array  # (D,): variance of a new track's rate, (m/s)^2; the variance of its place is `noise`

    @property
    def q(self) -> Array:
        """Process noise of a step, (3, D)."""
        return kalman.white_acceleration(self.dt, self.sigma)

    @property
    def asymptote(self) -> Array:
        """Innovation variance S of each coordinate in the steady state, (D,), m^2."""
        return kalman.asymptote(self.dt, self.sigma, self.noise)

    def newborn(self) -> Array:
        """Returns the state (5, 1, D) of a new track at place 0 with rate 0."""
        return kalman.born(np.zeros((1, len(self.noise))), self.noise, self.birth_rate_var)

    def steady(self) -> Array:
        """Returns the state (5, 1, D) just after a measurement in the steady state, in closed form."""
        # K = 1 - R / S; the posterior P11 is K R, and P12 and P22 follow from the Riccati equation
        s = self.asymptote
        k = 1 - self.noise / s
        rate_gain = 2 * (2 - k) - 4 * np.sqrt(1 - k)
        rate_var = rate_gain / self.dt**2 * (k - rate_gain / 2) / (1 - k) * self.noise
        state = kalman.born(np.zeros((1, len(self.noise))), k * self.noise, rate_var)
        state[kalman.COV] = rate_gain * self.noise / self.dt
        return state


def rho(state: Array, noise: Array, asymptote: Array) -> Array:
    """Returns rho (N,) of N predicted filters, (5, N, D) (sec. 4.5, eq. 6); 1 in the steady state, more with misses."""
    # S is diagonal, so that |S| is a product over the coordinates
    return np.asarray(np.sqrt(np.multiply.reduce((state[kalman.VAR] + noise) / asymptote, 1)))


def after_misses(dynamics: Dynamics, misses: int) -> float:
    """Returns rho at the prediction after `misses` frames without a measurement, from the steady state."""
    return _rho_after(dynamics, dynamics.steady(), misses + 1)


def at_birth(dynamics: Dynamics) -> float:
    """Returns rho of a new track at its first prediction, one step after its first measurement."""
    return _rho_after(dynamics, dynamics.newborn(), 1)


def _rho_after(dynamics: Dynamics, state: Array, steps: int) -> float:
    q = dynamics.q
    for _ in range(steps):
        kalman.predict(state, dynamics.dt, q)
    return float(rho(state, dynamics.noise, dynamics.asymptote)[0])


def time_to_confirm(dynamics: Dynamics, confirm_ratio: float) -> float:
    """Returns the age, s, that a track measured in every frame must reach; the next frame confirms it."""
    state, q = dynamics.newborn(), dynamics.q
    kalman.predict(state, dynamics.dt, q)
    frames = 0
    while frames < MOST_FRAMES and rho(state, dynamics.noise, dynamics.asymptote)[0] > confirm_ratio:
        kalman.update(state, np.zeros(1, np.int64), np.zeros((1, len(dynamics.noise))), dynamics.noise)
        kalman.predict(state, dynamics.dt, q)
        frames += 1
    return frames * dynamics.dt
