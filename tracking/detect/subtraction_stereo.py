"""Subtraction stereo: disparities inside the foreground only (Hoshikawa et al. 2011, sec. 2).

The matcher is OpenCV's block matcher (`cv2.StereoBM`: grey values, sub-pixel by a parabola), written anew so that it
works at the pixels of the foreground alone. Block matching is local, so that their disparities are those of the whole
picture to the last bit. Its left-right check compares pixels of the foreground with each other only. It removes the
parts of people that another person hides from the right camera.

Ours: the background is subtracted from the left picture only.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sim.types import Array, Bools, Image
from tracking.detect.subtraction_stereo_kernels import block_match, filtered_pair, left_right, reach

MULTIPLE = 16  # Numbers of disparities are multiples of it, as those of OpenCV's matcher.
LEAST_BLOCK = 5  # px: least width of the compared block that OpenCV allows.
LEAST_UNIQUE = 5  # Percent by which the best match must be better than the second best.
SHORT_BLOCK = 22  # px: widest block whose sums of differences, and 5 % more, are below 32768.

Disparities = NDArray[np.float32]


class SubtractionStereo:
    """Matches a rectified pair at the pixels of the foreground.

    State: disparities, the number D of disparities that are tried, 0 to D - 1 px, a multiple of 16; block: width of the
    compared block, px, odd.
    """

    def __init__(self, largest: float, block: int) -> None:
        """largest: largest disparity that is looked for, px, above 0. block: odd, px; less than 5 counts as 5."""
        self.disparities = MULTIPLE * int(np.ceil((largest + 1) / MULTIPLE))
        self.block = max(block, LEAST_BLOCK)

    def match(self, left: Image, right: Image, mask: Bools) -> Disparities:
        """Returns the disparities (H, W), px, inside `mask` (H, W), the foreground of the left picture; nan without a
        match."""
        half, D = self.block // 2, self.disparities
        found = np.full(mask.shape, np.nan, np.float32)
        high, wide = mask.shape
        inside = np.zeros_like(mask)
        room = slice(half, max(high - half, half)), slice(D - 1 + half, max(wide - half, D - 1 + half))
        inside[room] = mask[room]
        own = runs(inside)
        needed = runs(reach(own, half, mask.shape))
        filters = np.empty((2, high, wide), np.int16)
        filtered_pair(left, right, needed, half, D, filters)
        sad = np.empty((wide, D), np.int16 if self.block <= SHORT_BLOCK else np.int32)
        cost = np.empty(mask.shape, np.int32)
        block_match(own, needed, half, LEAST_UNIQUE, filters, sad, found, cost)
        left_right(own, found, cost)
        return found


def runs(mask: Bools) -> NDArray[np.int32]:
    """Returns row, first column and last column + 1 of each run of True pixels in a row of a mask, (R, 3), in order."""
    high, wide = mask.shape
    padded = np.zeros(1 + high * (wide + 1), bool)  # False before the first row and after each
    padded[1:].reshape(high, wide + 1)[:, :wide] = mask
    edges = np.flatnonzero(padded[1:] != padded[:-1])
    row, first = np.divmod(edges[::2], wide + 1)
    return np.column_stack([row, first, edges[1::2] - row * (wide + 1)]).astype(np.int32)


def sampled(disparity: Disparities, uv: Array | Disparities, half: int) -> Array:
    """Returns the median disparity (N,), px, of the known pixels in a square of 2 half + 1 px round each point."""
    high, wide = disparity.shape
    step = np.arange(-half, half + 1)
    column = np.clip(np.floor(uv[:, 0]).astype(int)[:, None] + step, 0, wide - 1)
    row = np.clip(np.floor(uv[:, 1]).astype(int)[:, None] + step, 0, high - 1)
    patch = np.sort(disparity[row[:, :, None], column[:, None, :]].reshape(len(uv), step.size**2), 1)  # nan comes last
    known = (~np.isnan(patch)).sum(1)
    k = np.arange(len(uv))
    low, up = np.maximum(known - 1, 0) // 2, known // 2
    up = np.minimum(up, np.maximum(known - 1, 0))
    return np.asarray((patch[k, low] + patch[k, up]) / 2, np.float64)
