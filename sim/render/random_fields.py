"""Random fields over places and time, each a pure function of both: what wind and light do slowly.

A field is a sum of WAVES plane waves, amplitude Σ sin(k·x + ω t + φ): stationary, nearly Gaussian, of the wanted sd.
With k drawn from N(0, 1/length²) per axis its correlation, over all draws, is exp(-r² / 2 length²); likewise in time.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sim.types import Array

WAVES = 24


@dataclass(frozen=True, eq=False)
class Swell:
    """A field at N fixed places: sine, cosine (N, W), the parts of each wave; omega (W,) rad/s."""

    sine: Array
    cosine: Array
    omega: Array

    def at(self, t: float) -> Array:
        """(N,) at time t, s."""
        return np.asarray(self.sine @ np.cos(self.omega * t) + self.cosine @ np.sin(self.omega * t))


@dataclass(frozen=True, eq=False)
class Waves:
    """amplitude: of each wave; k (W, 2) rad/m, omega (W,) rad/s, phase (W,) rad."""

    amplitude: float
    k: Array
    omega: Array
    phase: Array

    def at(self, t: float) -> float:
        """At the origin and time t, s."""
        return float(self.amplitude * np.sin(self.omega * t + self.phase).sum()) if self.amplitude > 0 else 0.0

    def over(self, places: Array, spread: Array) -> Swell:
        """At places (N, 2) m, as means over surroundings of sd `spread` (N,) m (Gaussian): wave k times
        exp(-|k|² spread² / 2)."""
        amplitude = self.amplitude * np.exp(-0.5 * (self.k**2).sum(axis=1) * spread[:, None] ** 2)
        at = places @ self.k.T + self.phase
        return Swell(amplitude * np.sin(at), amplitude * np.cos(at), self.omega)


def waves(source: np.random.Generator, sd: float, k: Array, omega: Array) -> Waves:
    """A field of this sd with these waves; phases are drawn."""
    return Waves(sd * float(np.sqrt(2 / len(omega))), k, omega, source.uniform(0, 2 * np.pi, len(omega)))


def relaxing(source: np.random.Generator, sd: float, time: float) -> Waves:
    """The same everywhere, correlation exp(-|lag| / time): frequencies are Cauchy with scale 1 / time."""
    omega = np.tan(np.pi * (source.uniform(size=WAVES) - 0.5)) / time
    return waves(source, sd, np.zeros((WAVES, 2)), omega)


def passing(source: np.random.Generator, sd: float, length: float, speed: float) -> Waves:
    """A pattern that is alike over `length` m and passes unchanged at `speed` m/s, in a direction that is drawn."""
    angle = source.uniform(0, 2 * np.pi)
    k = source.normal(size=(WAVES, 2)) / length
    return waves(source, sd, k, -speed * k @ np.array([np.cos(angle), np.sin(angle)]))


def swaying(source: np.random.Generator, sd: float, length: float, time: float) -> Waves:
    """What moves to and fro: alike over `length` m and `time` s (exp(-lag² / 2 time²))."""
    return waves(source, sd, source.normal(size=(WAVES, 2)) / length, source.normal(size=WAVES) / time)
