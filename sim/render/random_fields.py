"""Random fields over ground and time, for slow changes of light and for wind; each a pure function of place and time.

A field is a sum of WAVES = 24 plane waves, amplitude Σ sin(k·x + ω t + φ): x the place in m, t the time in s, k the
wave vector in rad/m, ω the angular frequency in rad/s, φ a random phase. It is stationary, nearly Gaussian, and has the
wanted standard deviation. With k drawn from N(0, 1/length²) per axis, its correlation over all draws is exp(-r² / 2
length²) at distance r; likewise over time.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sim.types import Array

WAVES = 24


@dataclass(frozen=True, eq=False)
class SampledField:
    """A random field at N fixed places: at time t (s), sine @ cos(omega t) + cosine @ sin(omega t)."""

    # sine, cosine (N, W): sine and cosine of the waves' phases at each place, times their amplitudes, in the field's
    # unit
    sine: Array
    cosine: Array
    omega: Array  # (W,) angular frequencies, rad/s

    def at(self, t: float) -> Array:
        """Returns the field's values (N,) at time t (s), in the order of the places."""
        return np.asarray(self.sine @ np.cos(self.omega * t) + self.cosine @ np.sin(self.omega * t))


@dataclass(frozen=True, eq=False)
class PlaneWaves:
    """A random field over ground and time: the sum of W plane waves amplitude sin(k·x + omega t + phase)."""

    amplitude: float  # of each wave, in the field's unit; 0 or more
    k: Array  # (W, 2) wave vectors, rad/m
    omega: Array  # (W,) angular frequencies, rad/s
    phase: Array  # (W,) rad

    def at_origin(self, t: float) -> float:
        """Returns the field's value at the world's origin at time t (s)."""
        return float(self.amplitude * np.sin(self.omega * t + self.phase).sum()) if self.amplitude > 0 else 0.0

    def sampled(self, places: Array, spread: Array) -> SampledField:
        """Returns the field at places (N, 2) m, each smoothed by a Gaussian of standard deviation spread (N,) m."""
        amplitude = self.amplitude * np.exp(-0.5 * (self.k**2).sum(axis=1) * spread[:, None] ** 2)
        at = places @ self.k.T + self.phase
        return SampledField(amplitude * np.sin(at), amplitude * np.cos(at), self.omega)


def _with_random_phases(source: np.random.Generator, sd: float, k: Array, omega: Array) -> PlaneWaves:
    return PlaneWaves(sd * float(np.sqrt(2 / len(omega))), k, omega, source.uniform(0, 2 * np.pi, len(omega)))


def uniform_drift(source: np.random.Generator, sd: float, time: float) -> PlaneWaves:
    """Returns a field that is the same everywhere, with correlation exp(-|lag| / time); time in s."""
    # A Cauchy distribution of frequencies has this correlation.
    omega = np.tan(np.pi * (source.uniform(size=WAVES) - 0.5)) / time
    return _with_random_phases(source, sd, np.zeros((WAVES, 2)), omega)


def moving_pattern(source: np.random.Generator, sd: float, length: float, speed: float) -> PlaneWaves:
    """Returns a pattern that moves unchanged over the ground at `speed` (m/s) in a random direction."""
    angle = source.uniform(0, 2 * np.pi)
    k = source.normal(size=(WAVES, 2)) / length
    return _with_random_phases(source, sd, k, -speed * k @ np.array([np.cos(angle), np.sin(angle)]))


def oscillation(source: np.random.Generator, sd: float, length: float, time: float) -> PlaneWaves:
    """Returns a random field with standard deviation sd and correlation exp(-r² / 2 length²) exp(-lag² / 2 time²)."""
    return _with_random_phases(source, sd, source.normal(size=(WAVES, 2)) / length, source.normal(size=WAVES) / time)
