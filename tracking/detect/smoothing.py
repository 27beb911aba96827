"""Smoothing of noisy pictures before the background model sees them (ours).

In low light most of a picture's noise is independent from pixel to pixel. A mean over n x n pixels divides its
standard deviation by n, and blurs the outlines of people by as much. So n is 1 unless the noise of the sample is above
QUIET, and the least odd number, up to WIDEST, with which it is not; pictures of mere noise stay as they are. The noise
is measured in the change from one frame of the sample to the next, of a pixel less its right neighbour: moving people
cover few pixels, and changes of light are the same at both.
"""

from __future__ import annotations

import cv2
import numpy as np

from sim.types import Image
from tracking.detect.brightness_gain import grid

QUIET = 6.0  # grey levels: a standard deviation up to which pictures stay as they are
WIDEST = 5  # px: largest window
AS_SIGMA = 0.6745 * 2  # median of the absolute value over sigma, of a sum of four values of standard deviation sigma


def independent_noise(sample: Image) -> float:
    """Returns the standard deviation of the noise in a sample (K, H, W, 3) uint8 that is independent at each pixel.

    Grey levels; the mean over the colour channels; 0 with a single frame or column.
    """
    rows, columns = grid(*sample.shape[1:3])
    right = slice(columns.start + 1, None, columns.step)
    first, second = (sample[:, rows, part].astype(np.int16) for part in (columns, right))
    wide = second.shape[2]
    change = np.diff(first[:, :, :wide] - second, axis=0)
    return 0.0 if not change.size else float(np.mean(np.median(np.abs(change), axis=(0, 1, 2)))) / AS_SIGMA


def window(noise: float) -> int:
    """Returns the side (px) of the window over which pictures of this noise (grey levels) are averaged; 1: none, also
    if even the widest window leaves too much."""
    return next((n for n in range(1, WIDEST + 1, 2) if noise <= n * QUIET), 1)


def smoothed(image: Image, side: int) -> Image:
    """Returns the picture (H, W, 3) uint8 averaged over windows of side x side px; the same one if `side` is 1."""
    return image if side == 1 else np.asarray(cv2.blur(image, (side, side)), np.uint8)
