"""From foreground pixels to blobs: majority, opening, closing, least area, labels, ellipses (González et al., 3.3).

Sizes are metres at the person, made px by the scene's scale. The ellipse keeps first and second moments: a filled one
with full axes h >= w has variances (h/4)^2, (w/4)^2, so h = 4 sqrt(l1), w = 4 sqrt(l2) with l1 >= l2 the eigenvalues of
the pixels' covariance (1/12 added: a pixel is a square). theta: from the abscissa to the major axis, in (-pi/2, pi/2],
v down. Its noise: var theta = l1 l2 / (n (l1 - l2)^2).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from sim.arrays import Frozen
from sim.types import Array, Bools, Image
from tracking.detect import blobs_kernels as kernels

Labels = NDArray[np.int32]
MAJORITY_M, OPEN_M, CLOSE_M = 0.08, 0.05, 0.15
"""Windows of the three operations, m: opening removes what is narrower than its own, closing fills narrower gaps."""


@dataclass(frozen=True, slots=True, eq=False)
class Blobs(Frozen):
    """Blobs of one frame, M rows, largest first.

    box (M, 4) ltwh px; area (M,) px; ellipse (M, 5): x, y, h, w, theta (px, rad), centre by the corner convention (a
    pixel's centre is at + 0.5); angle_var (M,) rad^2, inf for a circle; label (H, W) int32: row + 1, 0 elsewhere.
    """

    box: Array
    area: Array
    ellipse: Array
    angle_var: Array
    label: Labels

    def __len__(self) -> int:
        return len(self.area)

    def contour(self, row: int) -> Array:
        """(V, 2) outer contour of one blob, px, through pixel centres."""
        left, top, wide, high = self.box[row].astype(int)
        cut = (self.label[top : top + high, left : left + wide] == row + 1).astype(np.uint8)
        outlines, _ = cv2.findContours(cut, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_SIMPLE)
        longest = np.reshape(max(outlines, key=len), (-1, 2))
        return np.asarray(longest + np.array([left + 0.5, top + 0.5]))

    def hull(self, row: int) -> Array:
        """(V, 2) convex hull of one blob's contour, px, counter-clockwise in (x, y)."""
        return np.asarray(cv2.convexHull(self.contour(row).astype(np.float32), clockwise=False), float).reshape(-1, 2)


def clean(foreground: Bools, px_per_m: float) -> Bools:
    """(H, W) foreground after majority, opening and closing with windows that follow the scale, px per m (3.3)."""
    mask: NDArray[Any] = foreground.astype(np.uint8)
    size = odd(MAJORITY_M * px_per_m, 3)
    mask = (cv2.boxFilter(mask, cv2.CV_16U, (size, size), normalize=False) > size * size // 2).astype(np.uint8)
    for operation, metres, least in ((cv2.MORPH_OPEN, OPEN_M, 1), (cv2.MORPH_CLOSE, CLOSE_M, 3)):
        mask = cv2.morphologyEx(mask, operation, disc(odd(metres * px_per_m, least)))
    return mask.astype(bool)


def odd(size: float, least: int) -> int:
    """The nearest odd number of px, not below `least`."""
    return max(least, 2 * round((size - 1) / 2) + 1)


@cache
def disc(size: int) -> Image:
    """A round structuring element of odd diameter (OpenCV's own ellipse is not symmetric)."""
    v, u = np.mgrid[:size, :size] - (size - 1) / 2
    return np.asarray(np.hypot(u, v) <= size / 2, np.uint8)


def find(mask: Bools, min_area: float) -> Blobs:
    """Connected regions of a mask (H, W), 8 neighbours, of at least `min_area` px^2, largest first, then by their first
    pixels."""
    runs = kernels.runs(mask)
    region, count = kernels.connect(runs)
    area, corners = kernels.extents(runs, region, count)
    order = np.argsort(-area, kind="stable")
    order = order[area[order] >= max(min_area, 1.0)]
    rank = np.full(count, -1)
    rank[order] = np.arange(len(order))
    region, area, corners = rank[region], area[order], corners[order]
    label = np.zeros(mask.shape, np.int32)
    kernels.labelled(runs, region, label)
    n = area.astype(float)
    ellipse, angle_var = ellipses(n, *_moments(*kernels.moments(runs, region, area)))
    box = np.concatenate([corners[:, :2], corners[:, 2:] - corners[:, :2]], 1).astype(float)
    return Blobs(box, n, ellipse, angle_var, label)


def _moments(centre: Array, spread: Array) -> tuple[Array, Array]:
    """Centre (M, 2) and covariance (M, 2, 2) of pixels that are unit squares, from those of their indices."""
    xx, xy, yy = spread.T
    return centre + 0.5, np.stack([xx + 1 / 12, xy, xy, yy + 1 / 12], axis=-1).reshape(-1, 2, 2)


def ellipses(n: Array, centre: Array, cov: Array) -> tuple[Array, Array]:
    """(M, 5) z = x, y, h, w, theta (3.3; px, rad) and (M,) variance of theta, rad^2, from the moments of n (M,) pixels.

    centre (M, 2) px, cov (M, 2, 2) px^2.
    """
    half, differ = (cov[:, 0, 0] + cov[:, 1, 1]) / 2, (cov[:, 0, 0] - cov[:, 1, 1]) / 2
    root = np.hypot(differ, cov[:, 0, 1])
    major, minor = half + root, np.maximum(half - root, 0.0)
    theta = 0.5 * np.arctan2(cov[:, 0, 1], differ)
    with np.errstate(divide="ignore"):
        angle_var = major * minor / (n * np.square(2 * root))
    return np.column_stack([centre, 4 * np.sqrt(major), 4 * np.sqrt(minor), theta]), angle_var
