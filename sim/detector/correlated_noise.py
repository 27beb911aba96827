"""Normal draws that stay correlated over time: sums of stationary AR(1) processes and of white noise.

A part of share s and time constant tau is sqrt(s) x with x_t = rho x_(t-1) + sqrt(1 - rho²) e_t and
rho = exp(-1 / (fps tau)). The sum of all parts is N(0, 1) with autocorrelation sum s exp(-lag / tau); the rest of the
variance is white. Every process begins in frame 1, so that the draws of a frame do not depend on when a person enters.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from sim.rng import rng
from sim.types import Array

if TYPE_CHECKING:
    from scenarios.schema.sensor import Memory


def correlated_normals(
    fresh: Array, memory: Sequence[Memory], first: int, fps: float, seed: int, *keys: int, repeat: int = 0
) -> Array:
    """Return standard normals (F, D), correlated over time, of frames `first` to `first` + F - 1 (frames from 1 on).

    fresh (F, D): standard normals, used as the white part. memory: share of the variance and time constant (s) of each
    AR(1) part; the shares must not add up to more than 1. The D columns are independent. The random stream of a part is
    named by the seed, `keys`, the part's number from 0 on, and repeat (number of the suite entry's copy). If memory is
    empty, `fresh` itself is returned.

    Raises ValueError for a negative seed or key.
    """
    if not memory:
        return fresh
    white = max(0.0, 1.0 - sum(part.share for part in memory))
    out = np.sqrt(white) * fresh
    last = first + len(fresh) - 1
    for k, part in enumerate(memory):
        rho = float(np.exp(-1.0 / (fps * part.time)))
        e = rng(seed, "detect", *keys, k, repeat=repeat).standard_normal((last, fresh.shape[1]))
        out += np.sqrt(part.share) * _autoregression(e, rho)[first - 1 :]
    return np.asarray(out)


def _autoregression(e: Array, rho: float) -> Array:
    """Return x (F, D) with x_1 = e_1, x_t = rho x_(t-1) + sqrt(1 - rho²) e_t down the rows of e (F, D).

    It changes e: rows 2 on are scaled.
    """
    from scipy.signal import lfilter

    e[1:] *= np.sqrt(1.0 - rho**2)
    return np.asarray(lfilter([1.0], [1.0, -rho], e, axis=0))
