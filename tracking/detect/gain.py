"""How bright a frame is beside the model: one factor per colour, the median of I / E over background pixels (ours)."""

from __future__ import annotations

import numpy as np

from sim.types import Array, Bools, Image
from tracking.detect.classes import Floats

POINTS = 6000
"""Pixels of the grid on which a gain is estimated."""
DARKEST, BRIGHTEST = 16.0, 245.0
"""Grey levels between which I and E must lie: below noise rules, above the camera clips."""
FEWEST = 50


def grid(high: int, wide: int) -> tuple[slice, slice]:
    """Rows and columns of the grid."""
    step = max(1, int(np.sqrt(high * wide / POINTS)))
    return slice(step // 2, None, step), slice(step // 2, None, step)


def gain(image: Array | Floats, mean: Array | Floats, where: Bools) -> Array | None:
    """(3,) median of I / E over grid pixels (h, w, 3) that are `where` (h, w); None if too few can be used."""
    usable = where & np.all((mean > DARKEST) & (image > DARKEST) & (image < BRIGHTEST), axis=-1)
    if usable.sum() < FEWEST:
        return None
    return np.asarray(np.median(image[usable] / mean[usable], axis=0))


def frame_gains(sample: Image) -> Array:
    """(K, 3): brightness of each frame of a sample beside their median frame; 1 where it cannot be told."""
    rows, columns = grid(*sample.shape[1:3])
    values = sample[:, rows, columns].astype(float)
    middle = np.median(values, axis=0)
    everywhere = np.ones(middle.shape[:2], bool)
    found = [gain(v, middle, everywhere) for v in values]
    return np.array([np.ones(3) if g is None else g for g in found])
