"""Subtraction stereo: disparities inside the foreground only (Hoshikawa et al. 2011, sec. 2).

The matcher is OpenCV's block matcher (`cv2.StereoBM`: grey values, sub-pixel by a parabola, uniqueness, left-right
check). Block matching is local, so that it works on the part of the pictures round the foreground alone; the
disparities are those of the whole picture to the last bit. The left-right check removes the parts of people that
another person hides from the right camera.

Ours: the background is subtracted from the left picture only.
"""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from sim.types import Array, Bools, Image

MULTIPLE = 16  # Numbers of disparities are multiples of it, and steps of a disparity per px, in OpenCV's matcher.
LEAST_BLOCK = 5  # px: least width of the compared block that OpenCV allows.
LEAST_UNIQUE = 5  # Percent by which the best match must be better than the second best.

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
        match. All are nan if the picture is not wider than `disparities` and `block` together, or not higher than
        `block`."""
        found = np.full(mask.shape, np.nan, np.float32)
        rows, columns = np.flatnonzero(mask.any(axis=1)), np.flatnonzero(mask.any(axis=0))
        reach = self.disparities + self.block  # of a match to the left, and of what it is checked against to the right
        if not len(rows) or mask.shape[0] <= self.block or mask.shape[1] <= reach:
            return found
        part = (
            slice(max(rows[0] - self.block, 0), rows[-1] + self.block + 1),
            slice(max(columns[0] - reach, 0), columns[-1] + reach + 1),
        )
        # made anew for each pair, as trackers are copied, and OpenCV's objects cannot be
        matcher = cv2.StereoBM.create(self.disparities, self.block)
        matcher.setUniquenessRatio(LEAST_UNIQUE)
        matcher.setTextureThreshold(0)
        matcher.setDisp12MaxDiff(1)
        raw = matcher.compute(left[part], right[part])
        found[part] = np.where((raw > 0) & mask[part], raw / np.float32(MULTIPLE), np.float32(np.nan))
        return found


def sampled(disparity: Disparities, uv: Array | Disparities, half: int) -> Array:
    """Returns the median disparity (N,), px, of the known pixels in a square of 2 half + 1 px round each point uv (N,
    2), u, v in px; nan if none is known."""
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
