"""Blur and noise of a camera's image: the weights of the lens blur, and where each frame's noise comes from.

Noise is normal and independent in each pixel and colour; part of its variance grows with brightness. At grey level x
its variance is sd² (1 - shot + shot x / MID_GREY). sd is the scenario's standard deviation in grey levels, at MID_GREY
= 128. shot is the share (0 to 1) of shot noise, that of the light; the rest is the read noise of the circuits.

Fresh normal numbers for each frame would cost more than all the rest. A long pool is therefore drawn once, and each row
of each image reads a stretch of it that begins at a random offset. Any two pixels, rows or frames are independent
unless they begin at the same offset, which has a chance of one in POOL = 2^20.
"""

from __future__ import annotations

from functools import cache, lru_cache

import numpy as np
from numpy.typing import NDArray

from scenarios.limits import PICTURE_SIDE
from sim.rng import rng
from sim.types import Ints

POOL = 1 << 20
FRAMES_PER_DRAW = 16  # frames whose offsets are drawn in one call
LONGEST = 3 * PICTURE_SIDE  # numbers that a row may need: 3 colours, the widest image


def blur_weights(sd: float) -> NDArray[np.float32]:
    """Returns the weights (2 r + 1,), sum 1, of a Gaussian blur of standard deviation `sd` px; r = 3 sd, rounded up."""
    radius = int(np.ceil(3 * sd))
    x = np.arange(-radius, radius + 1)
    weights = np.exp(-0.5 * (x / sd) ** 2) if radius else np.ones(1)
    return np.asarray(weights / weights.sum(), np.float32)


@cache
def _normals() -> NDArray[np.float32]:
    # The same for all seeds; the first numbers are repeated, so that no row ends beyond the pool.
    normals = rng(0, "noise").standard_normal(POOL, dtype=np.float32)
    return np.concatenate([normals, normals[:LONGEST]])


def noise_pool(sd: float, unit: float) -> NDArray[np.int16]:
    """Returns the pool (POOL + LONGEST,) of normal numbers of `sd` grey levels, times `unit`, rounded to int16."""
    return np.asarray(np.clip(np.rint(_normals() * np.float32(sd * unit)), -32768, 32767), np.int16)


@lru_cache(maxsize=4)
def _offsets_of_frames(rows: int, seed: int, side: int, draw: int, repeat: int) -> Ints:
    return rng(seed, "noise", side, draw, repeat=repeat).integers(POOL, size=(FRAMES_PER_DRAW, rows))


def noise_offsets(rows: int, seed: int, side: int, frame: int, repeat: int = 0) -> Ints:
    """Returns where in the pool the noise of each image row begins: (rows,).

    side: 0 the left camera, 1 the right one. frame: number from 1 plus BACKGROUNDS; background images have 1 to 50.
    """
    return np.asarray(_offsets_of_frames(rows, seed, side, frame // FRAMES_PER_DRAW, repeat)[frame % FRAMES_PER_DRAW])
