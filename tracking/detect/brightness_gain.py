"""The brightness of a frame relative to the background model: one factor per colour channel (ours).

The factor of a channel is the median of I / E over background pixels, I the frame's grey level and E the model's
mean grey level. It has no unit and is 1 for a frame as bright as the model.
"""

from __future__ import annotations

import numpy as np

from sim.types import Bools, Image
from tracking.detect.background_kernels import Floats

POINTS = 6000  # About so many pixels, on a regular grid, are used for the estimate.
# Grey levels between which a pixel is usable: noise dominates below, the camera clips above.
DARKEST, BRIGHTEST = 16.0, 235.0
FEWEST = 50  # Fewest usable grid pixels from which the factor of a channel is estimated.


def grid(high: int, wide: int) -> tuple[slice, slice]:
    """Returns two slices, of rows and of columns, that select a regular grid of pixels from an image of high x wide
    px."""
    step = max(1, int(np.sqrt(high * wide / POINTS)))
    return slice(step // 2, None, step), slice(step // 2, None, step)


def gain(image: Floats, mean: Floats, where: Bools) -> Floats | None:
    """Returns a frame's brightness factor in each colour channel, (3,) float32, or None if no channel has enough
    pixels."""
    found = [_one_channel(i, e, where) for i, e in zip(image, mean, strict=True)]
    known = [factor for factor in found if factor is not None]
    if not known:
        return None
    return np.array([np.mean(known) if factor is None else factor for factor in found], np.float32)


def _one_channel(seen: Floats, mean: Floats, where: Bools) -> float | None:
    ratio, light = seen / np.maximum(mean, DARKEST), where & (mean > DARKEST)
    usable = light & (seen > DARKEST) & (seen < BRIGHTEST)
    for _ in range(2):
        if np.count_nonzero(usable) < FEWEST:
            return None
        factor = float(np.median(ratio[usable]))
        usable = light & (factor * mean > DARKEST) & (factor * mean < BRIGHTEST)
    return factor


def frame_gains(sample: Image) -> Floats:
    """Returns the gain of each frame of a sample (K, H, W, 3) uint8, (K, 3) float32: a brightness factor per colour
    channel."""
    rows, columns = grid(*sample.shape[1:3])
    values = np.moveaxis(sample[:, rows, columns], -1, 1).astype(np.float32)
    middle = np.median(values, axis=0)
    everywhere = np.ones(middle.shape[1:], bool)
    found = [gain(v, middle, everywhere) for v in values]
    return np.array([np.ones(3) if g is None else g for g in found], np.float32)
