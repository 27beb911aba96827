"""Normal draws that stay correlated over time: sums of stationary AR(1) processes and of white noise.

A part has a share s of the variance and a time constant tau in s. It is a process in time, not in frames: it runs on a
clock of CLOCK ticks per s, and a frame takes the nearest tick. At tick k it adds sqrt(s) x_k, where x_k = rho x_(k-1) +
sqrt(1 - rho²) e_k, e_k is a new standard normal, and rho = exp(-1 / (CLOCK tau)). The sum of all parts is N(0, 1); its
autocorrelation at a lag in s is the sum of s exp(-lag / tau). The rest of the variance is white, that is independent in
each frame. Every process begins in frame 1, so that the draws of a frame do not depend on when a person enters.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from sim.elementary import exp
from sim.rng import autoregression, normals, rng, uniforms
from sim.types import Array, Ints

if TYPE_CHECKING:
    from scenarios.schema.sensor import Memory

CLOCK = 50.0  # Hz, of what lasts in the simulated detector: errors, misses, false alarms


def correlated_normals(
    fresh: Array, memory: Sequence[Memory], first: int, fps: float, seed: int, *keys: int, repeat: int = 0
) -> Array:
    """Returns standard normals (F, D), correlated over time, of frames `first` to `first` + F - 1 (frames from 1 on).

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
    tick = ticks(np.arange(first, first + len(fresh)), fps)
    for k, part in enumerate(memory):
        e = normals(uniforms(rng(seed, "detect", *keys, k, repeat=repeat), (int(tick[-1]) + 1, fresh.shape[1])))
        out += np.sqrt(part.share) * autoregression(e, exp(-1.0 / (CLOCK * part.time)))[tick]
    return np.asarray(out)


def ticks(frame: Ints, fps: float) -> Ints:
    """Returns the ticks (F,) of the detector's clock, from 0 on, that are nearest to the times of frames (F,)."""
    return np.asarray(np.floor((frame - 1) / fps * CLOCK + 0.5), np.int64)
