"""Normal draws that stay correlated over time: sums of stationary AR(1) processes and of white noise.

A part has a share s of the variance and a time constant tau in s. It adds sqrt(s) x_t in frame t, where x_t = rho
x_(t-1) + sqrt(1 - rho²) e_t, e_t is a new standard normal, and rho = exp(-1 / (fps tau)) at fps frames/s. The sum of
all parts is N(0, 1); its autocorrelation at a lag in s is the sum of s exp(-lag / tau). The rest of the variance is
white, that is independent in each frame. Every process begins in frame 1, so that the draws of a frame do not depend on
when a person enters.
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

    fresh (F, D): standard normals, used as the white part, which has the variance that no part of the memory takes.
    memory: share of the variance and time constant (s) of each AR(1) part; the shares must not add up to more than 1,
    which is not checked. fps: frames per second. The D columns are independent. The random stream of a part is named by
    the seed, `keys`, the part's number from 0 on, and repeat (number of the suite entry's copy, 0 without copies). It
    begins in frame 1, whatever `first` is. If memory is empty, `fresh` itself is returned; otherwise it is not changed.

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
    """Return x (F, D) with x_1 = e_1 and x_t = rho x_(t-1) + sqrt(1 - rho²) e_t down the rows of e (F, D), t being the
    row.

    rho: correlation of successive rows, 0 to 1. If e is standard normal, so is x. It changes e: rows 2 on are scaled by
    sqrt(1 - rho²).
    """
    from scipy.signal import lfilter

    e[1:] *= np.sqrt(1.0 - rho**2)
    return np.asarray(lfilter([1.0], [1.0, -rho], e, axis=0))
