"""How bright a frame is beside the model: one factor per colour, the median of I / E over background pixels (ours)."""

from __future__ import annotations

import numpy as np

from sim.types import Bools, Image
from tracking.detect.pixel_classes import Floats

POINTS = 6000
"""Pixels of the grid on which a gain is estimated."""
DARKEST, BRIGHTEST = 16.0, 235.0
"""Grey levels between which I and E must lie: below noise rules, above the camera clips."""
FEWEST = 50
"""Usable grid pixels without which a colour tells no gain."""


def grid(high: int, wide: int) -> tuple[slice, slice]:
    """Rows and columns of the grid."""
    step = max(1, int(np.sqrt(high * wide / POINTS)))
    return slice(step // 2, None, step), slice(step // 2, None, step)


def gain(image: Floats, mean: Floats, where: Bools) -> Floats | None:
    """(3,) median of I / E over grid pixels (3, h, w) that are `where` (h, w); None if too few can be used.

    A colour that cannot be used, as blue under sodium lamps, is taken to change as the others do on average.
    """
    found = [_one_colour(i[where], e[where]) for i, e in zip(image, mean, strict=True)]
    known = [factor for factor in found if factor is not None]
    if not known:
        return None
    return np.array([np.mean(known) if factor is None else factor for factor in found], np.float32)


def _one_colour(seen: Floats, mean: Floats) -> float | None:
    """The median ratio over pixels that neither noise rules nor the camera clips.

    Which these are is told by a first guess, since to choose them by what is seen would take sides.
    """
    usable = (mean > DARKEST) & (seen > DARKEST) & (seen < BRIGHTEST)
    for _ in range(2):
        if np.count_nonzero(usable) < FEWEST:
            return None
        factor = _median(seen[usable] / mean[usable])
        usable = (factor * mean > DARKEST) & (factor * mean < BRIGHTEST) & (mean > DARKEST)
    return factor


def _median(values: Floats) -> float:
    """numpy's median of one or more numbers, in a quarter of its time: none of them is nan."""
    half = len(values) // 2
    middle = np.partition(values, half)
    above = middle[half]
    return float(above if len(values) % 2 else (middle[:half].max() + above) / 2)


def frame_gains(sample: Image) -> Floats:
    """(K, 3): brightness of each frame of a sample beside their median frame; 1 where it cannot be told."""
    rows, columns = grid(*sample.shape[1:3])
    values = np.moveaxis(sample[:, rows, columns], -1, 1).astype(np.float32)
    middle = np.median(values, axis=0)
    everywhere = np.ones(middle.shape[1:], bool)
    found = [gain(v, middle, everywhere) for v in values]
    return np.array([np.ones(3) if g is None else g for g in found], np.float32)
