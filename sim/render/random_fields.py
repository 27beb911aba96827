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
    """A random field, as of brightness or wind, at N fixed places: a sum of W waves in time.

    Its values at time t (s) are sine @ cos(omega t) + cosine @ sin(omega t). sine, cosine (N, W): sine and cosine of
    the waves' phases at each place, times their amplitudes, in the field's unit. omega (W,): angular frequencies,
    rad/s.
    """

    sine: Array
    cosine: Array
    omega: Array

    def at(self, t: float) -> Array:
        """Return the field's values (N,) at time t (s), in the order of the places."""
        return np.asarray(self.sine @ np.cos(self.omega * t) + self.cosine @ np.sin(self.omega * t))


@dataclass(frozen=True, eq=False)
class PlaneWaves:
    """A random field over ground and time: the sum of W plane waves amplitude sin(k·x + omega t + phase).

    amplitude    of each wave, in the field's unit; 0 or more
    k (W, 2)     wave vectors, rad/m
    omega (W,)   angular frequencies, rad/s
    phase (W,)   rad
    """

    amplitude: float
    k: Array
    omega: Array
    phase: Array

    def at_origin(self, t: float) -> float:
        """Return the field's value at the world's origin (0, 0) at time t (s); 0 if the amplitude is 0."""
        return float(self.amplitude * np.sin(self.omega * t + self.phase).sum()) if self.amplitude > 0 else 0.0

    def sampled(self, places: Array, spread: Array) -> SampledField:
        """Return the field at places (N, 2), x and y in m, each smoothed by a Gaussian of standard deviation spread
        (N,) m.

        Smoothing multiplies the wave of wave vector k (rad/m) by exp(-|k|² spread² / 2). With a spread of inf the field
        vanishes at that place, unless a wave vector is 0, which gives nan.
        """
        amplitude = self.amplitude * np.exp(-0.5 * (self.k**2).sum(axis=1) * spread[:, None] ** 2)
        at = places @ self.k.T + self.phase
        return SampledField(amplitude * np.sin(at), amplitude * np.cos(at), self.omega)


def _with_random_phases(source: np.random.Generator, sd: float, k: Array, omega: Array) -> PlaneWaves:
    """Return a field of standard deviation sd from waves k (W, 2) rad/m, omega (W,) rad/s, with phases drawn from
    source."""
    return PlaneWaves(sd * float(np.sqrt(2 / len(omega))), k, omega, source.uniform(0, 2 * np.pi, len(omega)))


def uniform_drift(source: np.random.Generator, sd: float, time: float) -> PlaneWaves:
    """Return a random field that is the same everywhere, with standard deviation sd and correlation exp(-|lag| / time).

    source: generator that draws it. time: time constant in s, above 0; lag in s, too. The field is 0 if sd is 0. Its
    angular frequencies have a Cauchy distribution of scale 1 / time.
    """
    omega = np.tan(np.pi * (source.uniform(size=WAVES) - 0.5)) / time
    return _with_random_phases(source, sd, np.zeros((WAVES, 2)), omega)


def moving_pattern(source: np.random.Generator, sd: float, length: float, speed: float) -> PlaneWaves:
    """Return a random pattern that moves unchanged over the ground at `speed` (m/s) in a random direction.

    source: generator that draws it. sd: its standard deviation; 0 gives the field 0. length: distance in m, above 0, at
    which its correlation is 0.6.
    """
    angle = source.uniform(0, 2 * np.pi)
    k = source.normal(size=(WAVES, 2)) / length
    return _with_random_phases(source, sd, k, -speed * k @ np.array([np.cos(angle), np.sin(angle)]))


def oscillation(source: np.random.Generator, sd: float, length: float, time: float) -> PlaneWaves:
    """Return a random field with standard deviation sd and correlation exp(-r² / 2 length²) exp(-lag² / 2 time²).

    source: generator that draws it. r: distance on the ground; length in m, above 0. lag: in s; time in s, above 0. The
    field is 0 if sd is 0.
    """
    return _with_random_phases(source, sd, source.normal(size=(WAVES, 2)) / length, source.normal(size=WAVES) / time)
