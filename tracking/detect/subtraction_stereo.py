"""Subtraction stereo: disparities inside the foreground only (Hoshikawa et al. 2011, sec. 2).

The foreground of the left picture is covered by windows, the boxes of its connected regions with a margin. OpenCV's
block matcher (`cv2.StereoBM`: grey values, sub-pixel by a parabola) works in each window alone. Block matching is
local, so with these margins the disparities inside the foreground are those of the whole picture to the last bit. The
left-right check is the matcher's own. It compares matches up to D px apart, so that with it a few pixels (3 of 100,000)
have a disparity in one and none in the other.

Ours: the background is subtracted from the left picture only.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from sim.types import Array, Bools, Image, Ints

STEPS = 16
"""Disparity steps per px of OpenCV's matcher; numbers of disparities are multiples of it, too."""
LEAST_BLOCK = 5
"""px: least width of the compared block that OpenCV allows."""
SLACK = 2
"""px: margin for the matcher's own prefilter, a Sobel filter of 3 x 3 px, and for its interpolation."""
LEAST_UNIQUE = 5
"""Percent by which the best match must be better than the second best."""
TEXTURE = 5
"""Least texture of a block, in the matcher's unit."""

Disparities = NDArray[np.float32]


@dataclass(frozen=True, eq=False)
class Matched:
    """The disparities of one pair, H x W px.

    disparity (H, W) float32: px, nan where nothing was matched. evaluated: number of disparities that were compared,
    the area of the windows times the number of disparities.
    """

    disparity: Disparities
    evaluated: int


class SubtractionStereo:
    """Matches a rectified pair inside windows round the foreground.

    State: disparities, the number D of disparities that are tried, 0 to D - 1 px, a multiple of 16; block: width of the
    compared block, px, odd; check: whether left and right matches must agree within 1 px.
    """

    def __init__(self, largest: float, block: int, check: bool = True) -> None:
        """largest: largest disparity that is looked for, px, above 0. block: odd, px; less than 5 counts as 5."""
        self.disparities = STEPS * int(np.ceil((largest + 1) / STEPS))
        self.block, self.check = max(block, LEAST_BLOCK), check
        self._matcher = cv2.StereoBM.create(self.disparities, self.block)
        self._matcher.setUniquenessRatio(LEAST_UNIQUE)
        self._matcher.setTextureThreshold(TEXTURE)
        self._matcher.setDisp12MaxDiff(1 if check else -1)

    def match(self, left: Image, right: Image, mask: Bools, boxes: Ints | None = None) -> Matched:
        """Returns the disparities inside `mask` (H, W), the foreground of the left picture.

        left, right (H, W): grey values, uint8, of a rectified pair. boxes (K, 4): x0, y0, x1, y1 in px (ends excluded)
        of boxes that cover the mask; None: those of its connected regions, which takes time to find. An empty mask
        gives nan everywhere. Pixels whose match would lie beyond the left edge of the right picture have none.
        """
        boxes = region_boxes(mask) if boxes is None else boxes
        found = np.full(left.shape, np.nan, np.float32)
        area = 0
        for core, (x0, y0, x1, y1) in zip(*windows(boxes, self.margins, mask.shape), strict=True):
            part = self._match(left[y0:y1, x0:x1], right[y0:y1, x0:x1])
            inner = slice(core[1], core[3]), slice(core[0], core[2])
            own = part[core[1] - y0 : core[3] - y0, core[0] - x0 : core[2] - x0]
            found[inner] = np.where(mask[inner], own, found[inner])
            area += max(x1 - x0 - self.disparities, 0) * (y1 - y0)
        return Matched(found, area * self.disparities)

    def dense(self, left: Image, right: Image) -> Matched:
        """Returns the disparities of the whole pictures (H, W), as `match` with a mask that is True everywhere."""
        return self.match(left, right, np.ones(left.shape, bool))

    @property
    def margins(self) -> Ints:
        """Margins (4,) round a region, px: left, top, right, bottom; to the left lie the matches in the right
        picture."""
        half = self.block // 2 + SLACK
        return np.array([half + self.disparities, half, half, half])

    def _match(self, left: Image, right: Image) -> Disparities:
        """Returns disparities (h, w) of a window, nan where there are none; a window without room for a match has
        none."""
        if left.shape[1] <= self.disparities + self.block or left.shape[0] <= self.block:
            return np.full(left.shape, np.nan, np.float32)
        raw = self._matcher.compute(np.ascontiguousarray(left), np.ascontiguousarray(right))
        return np.where(raw > 0, raw.astype(np.float32) / STEPS, np.float32(np.nan))


def region_boxes(mask: Bools) -> Ints:
    """Return the boxes (K, 4) of the connected regions of a mask (H, W): x0, y0, x1, y1 in px, ends excluded."""
    one = np.ascontiguousarray(mask).view(np.uint8)
    stats = cv2.connectedComponentsWithStats(one, connectivity=8, ltype=cv2.CV_16U)[2]
    boxes = stats[1:, :4].astype(np.int64)
    boxes[:, 2:] += boxes[:, :2]
    return boxes


def windows(boxes: Ints, margins: Ints, shape: tuple[int, ...]) -> tuple[Ints, Ints]:
    """Return boxes that cover the given ones, and the windows to match in: two arrays (K, 4), x0, y0, x1, y1 in px
    (ends excluded).

    boxes (N, 4): of regions, in the same form. A window is a box widened by `margins` (left, top, right, bottom, px)
    and cut off at the edges of the picture; shape: its (H, W). Boxes are replaced by their common box where the window
    of two of them together is not larger than their two windows. N = 0 gives K = 0.
    """
    high, wide = shape
    core = boxes
    outwards, limits = margins * np.array([-1, -1, 1, 1]), np.array([wide, high, wide, high])
    while True:
        window = np.minimum(np.maximum(core + outwards, 0), limits)
        low, end = np.minimum(core[:, None, :2], core[:, :2]), np.maximum(core[:, None, 2:], core[:, 2:])
        low, end = np.maximum(low + outwards[:2], 0), np.minimum(end + outwards[2:], limits[2:])
        area = (window[:, 2:] - window[:, :2]).prod(1)
        joined = (end - low).prod(2) <= area[:, None] + area
        if joined.sum() <= len(core):  # each box with itself
            return core, window
        while (further := joined @ joined).sum() > joined.sum():
            joined = further
        label = np.unique(joined.argmax(1), return_inverse=True)[1]
        common = np.full((label.max() + 1, 4), np.array([wide, high, 0, 0]))
        np.minimum.at(common[:, :2], label, core[:, :2])
        np.maximum.at(common[:, 2:], label, core[:, 2:])
        core = common


def sampled(disparity: Disparities, uv: Array | Disparities, half: int) -> Array:
    """Return the median disparity (N,), px, of the known pixels in a square of 2 half + 1 px round each point.

    disparity (H, W): nan where unknown. uv (N, 2): points in the picture, px. A point without a known disparity in its
    square gets nan.
    """
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
