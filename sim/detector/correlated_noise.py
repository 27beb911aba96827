"""Random numbers that stay alike for a while: stationary sums of AR(1) parts and of what is new in each frame.

A part of share s and time tau is sqrt(s) x, x_t = rho x_(t-1) + sqrt(1 - rho²) e_t with rho = exp(-1 / (fps tau)), so
that the whole is N(0, 1) with correlation sum s exp(-lag / tau) over the parts, and the rest of the variance is white.
Chains begin in frame 1, whoever is there by then: who enters later meets the same numbers.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from sim.rng import rng
from sim.types import Array

if TYPE_CHECKING:
    from scenarios.schema.sensor import Memory


def lasting(
    fresh: Array, memory: Sequence[Memory], first: int, fps: float, seed: int, *keys: int, repeat: int = 0
) -> Array:
    """(F, D) normals of frames `first` …; fresh (F, D) are their white parts, keys name the streams of the others."""
    if not memory:
        return fresh
    white = max(0.0, 1.0 - sum(part.share for part in memory))
    out = np.sqrt(white) * fresh
    last = first + len(fresh) - 1
    for k, part in enumerate(memory):
        rho = float(np.exp(-1.0 / (fps * part.time)))
        e = rng(seed, "detect", *keys, k, repeat=repeat).standard_normal((last, fresh.shape[1]))
        out += np.sqrt(part.share) * _chain(e, rho)[first - 1 :]
    return np.asarray(out)


def _chain(e: Array, rho: float) -> Array:
    """x_1 = e_1, x_t = rho x_(t-1) + sqrt(1 - rho²) e_t down the rows."""
    from scipy.signal import lfilter

    e[1:] *= np.sqrt(1.0 - rho**2)
    return np.asarray(lfilter([1.0], [1.0, -rho], e, axis=0))
