"""A camera's noise: normal, independent in each pixel and colour; part of its variance grows with brightness.

At grey level x the variance is sd² (1 - shot + shot x / MIDDLE): what the circuits add, and the counted light's own.

Fresh normal numbers for each frame would cost more than all the rest, so a long pool is drawn once, and each row of
each picture shows a stretch of it that begins anywhere: what two pixels, rows or frames show is independent but for
the one chance in POOL that they begin alike.
"""

from __future__ import annotations

from functools import cache, lru_cache

import numpy as np
from numpy.typing import NDArray

from sim.rng import rng
from sim.types import Ints

POOL = 1 << 20
MIDDLE = 128.0  # grey level at which the sd is as told
TOGETHER = 16  # frames whose places in the pool are drawn at once
LONGEST = 3 * 8192  # numbers that a row may need


@cache
def _normals() -> NDArray[np.float32]:
    normals = rng(0, "noise").standard_normal(POOL, dtype=np.float32)
    return np.concatenate([normals, normals[:LONGEST]])


def pool(sd: float, unit: float) -> NDArray[np.int16]:
    """Normal numbers of standard deviation `sd`, times `unit`, rounded."""
    return np.asarray(np.clip(np.rint(_normals() * np.float32(sd * unit)), -32768, 32767), np.int16)


@lru_cache(maxsize=4)
def _many(rows: int, seed: int, side: int, stretch: int, repeat: int) -> Ints:
    return rng(seed, "noise", side, stretch, repeat=repeat).integers(POOL, size=(TOGETHER, rows))


def offsets(rows: int, seed: int, side: int, frame: int, repeat: int = 0) -> Ints:
    """Where in the pool each row of a frame (a number from 0) of a side (0 left, 1 right) begins."""
    return np.asarray(_many(rows, seed, side, frame // TOGETHER, repeat)[frame % TOGETHER])
