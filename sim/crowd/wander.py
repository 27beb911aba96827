"""How a person's wanted velocity fluctuates: an Ornstein-Uhlenbeck process per person, from the person's own stream."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from sim.rng import rng
from sim.types import Array

SD = 0.06  # m/s, per axis
TIME = 1.5  # s, correlation time


def wander(keys: Sequence[tuple[int, ...]], frames: int, fps: float, seed: int, repeat: int) -> Array:
    """(frames, P, 2) in m/s, stationary from the first frame: u_k = keep u_k-1 + sqrt(1 - keep^2) SD noise_k."""
    keep = float(np.exp(-1 / (fps * TIME)))
    out = np.empty((frames, len(keys), 2))
    for p, key in enumerate(keys):
        out[:, p] = rng(seed, "gait", *key, repeat=repeat).normal(size=(frames, 2))
    out[1:] *= np.sqrt(1 - keep**2)
    out *= SD
    for k in range(1, frames):
        out[k] += keep * out[k - 1]
    return out
