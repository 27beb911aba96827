"""Birth, confirmation and death of tracks from rho = sqrt|S| / its asymptote.

Gonzalez et al. (2006, 4.5, 5) manage tracks by the innovation covariance's determinant: it falls towards an asymptote
while measurements come, rises while they don't, and knows nothing of their values. The paper names no numbers. It
confirms "below a certain percentage" of the asymptote, here one above 100, as rho falls from above, and deletes beyond
what "a certain number" of misses gives. A newborn's |S| hangs on its first covariance too, hence the checks (ours):

- confirm where rho <= confirm_ratio (a little above 1) and the measurement of that frame was near,
- a newborn must start above it, so that one sighting never confirms (checked when the config is made concrete),
- a confirmed track dies where rho reaches what k misses from the steady state give: sooner if it was not there yet,
- a tentative one dies (ours) where rho, unseen, reaches its value at birth, or after a time limit, never before
  it could be confirmed.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from scenarios.errors import InputError
from sim.types import Array
from tracking.filters import kalman


@dataclass(frozen=True)
class Dynamics:
    """Nominal filter of one track, D coordinates in m: dt; sigma (D,) acceleration; noise (D,), birth_rate_var (D,)."""

    dt: float
    sigma: Array
    noise: Array
    birth_rate_var: Array

    @property
    def q(self) -> Array:
        """(3, D) process noise of a step."""
        return kalman.white_acceleration(self.dt, self.sigma)

    @property
    def asymptote(self) -> Array:
        """(D,) S of a track that is always measured."""
        return kalman.asymptote(self.dt, self.sigma, self.noise)

    def newborn(self) -> Array:
        """(5, 1, D) state of a track that was just born at 0."""
        return kalman.born(np.zeros((1, len(self.noise))), self.noise, self.birth_rate_var)

    def steady(self) -> Array:
        """(5, 1, D) state just after a measurement in the steady state, in closed form.

        With K = 1 - R/S the posterior is P11 = K R, and the Riccati equation gives P12 and P22.
        """
        s = self.asymptote
        k = 1 - self.noise / s
        rate_gain = 2 * (2 - k) - 4 * np.sqrt(1 - k)
        state = np.zeros((5, 1, len(self.noise)))
        state[kalman.VAR] = k * self.noise
        state[kalman.COV] = rate_gain * self.noise / self.dt
        state[kalman.RATE_VAR] = rate_gain / self.dt**2 * (k - rate_gain / 2) / (1 - k) * self.noise
        return state


def rho(state: Array, noise: Array, asymptote: Array) -> Array:
    """(N,) sqrt|S| of predicted filters (S: eq. 6) relative to its asymptote (4.5).

    state (5, N, D), noise and asymptote (D,) in its covariances' unit; S is diagonal, so |S| is a product.
    """
    return np.asarray(np.sqrt(np.multiply.reduce((state[kalman.VAR] + noise) / asymptote, 1)))


def after_misses(dynamics: Dynamics, misses: int) -> float:
    """rho at the prediction that follows `misses` frames without measurement, from the steady state."""
    return _follow(dynamics, dynamics.steady(), misses + 1)


def at_birth(dynamics: Dynamics) -> float:
    """rho at the first prediction of a newborn."""
    return _follow(dynamics, dynamics.newborn(), 1)


def hits_to_confirm(dynamics: Dynamics, confirm_ratio: float, limit: int = 1000) -> int:
    """Sightings in a row, the first included, that bring rho down to confirm_ratio."""
    state = dynamics.newborn()
    for hits in range(1, limit):
        kalman.predict(state, dynamics.dt, dynamics.q)
        if rho(state, dynamics.noise, dynamics.asymptote)[0] <= confirm_ratio:
            return hits + 1
        kalman.update(state, np.zeros(1, np.int64), np.zeros((1, len(dynamics.noise))), dynamics.noise)
    return limit


def _follow(dynamics: Dynamics, state: Array, steps: int) -> float:
    for _ in range(steps):
        kalman.predict(state, dynamics.dt, dynamics.q)
    return float(rho(state, dynamics.noise, dynamics.asymptote)[0])


def check_birth(dynamics: Dynamics, confirm_ratio: float) -> None:
    """InputError where a newborn would be confirmed at first sight."""
    start = at_birth(dynamics)
    if start <= confirm_ratio:
        got = f"{confirm_ratio:g}, and newborn tracks that start at {start:.3g} of the asymptote"
        remedy = "raise speed_prior or size_rate_prior, or lower confirm_ratio or the acceleration noises"
        raise InputError(place="confirm_ratio", got=got, expected="newborn tracks above it", remedy=remedy)


def time_to_confirm(dynamics: Dynamics, confirm_ratio: float) -> float:
    """s, the least age until which a track seen in every frame must live; it is confirmed in the frame after that."""
    return (hits_to_confirm(dynamics, confirm_ratio) - 2) * dynamics.dt
