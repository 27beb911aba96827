"""Cleaning of a foreground mask, and its connected regions as blobs with ellipses (Gonzalez et al. 2006, sec. 3.3).

`clean` applies majority, opening and closing; its windows are in metres and follow the image's scale (ours). `find`
labels the regions, drops small ones and computes the ellipse z = (x, y, h, w, theta) of each from its moments:
    h = 4 sqrt(l1), w = 4 sqrt(l2)     full axes, l1 >= l2 the eigenvalues of the covariance of the region's pixels
    var theta = l1 l2 / (n (l1 - l2)^2)     variance of the direction (ours), n the number of pixels
A filled ellipse with full axes h, w has variances (h/4)^2, (w/4)^2. 1/12 px^2 is added to both, as a pixel is a square.
theta is the angle from the abscissa to the major axis, rad in (-pi/2, pi/2], with v down.
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
# Windows of the three operations, m. Opening removes narrower parts of the foreground, closing fills narrower gaps.
MAJORITY_M, OPEN_M, CLOSE_M = 0.08, 0.05, 0.15
# Regions of a mask that are looked at, the largest first. It bounds the work of a frame of noise, whose thousands of
# pieces would all become tracks.
MOST = 500
# px: least disc of the opening. One pixel is no opening, which is so up to 40 px per m. At 20 px per m a disc of 3 px
# is as wide as a head; it costs HOTA (`python -m benchmarks.foreground opening`).
LEAST_OPEN = 1


@dataclass(frozen=True, slots=True, eq=False)
class Blobs(Frozen):
    """The blobs (connected foreground regions) of one frame of H x W px: M rows, the largest area first.

    box (M, 4)        left, top, width, height, px
    area (M,)         number of pixels
    ellipse (M, 5)    centre x, y, full axes h >= w (px), theta (rad): direction of h from the abscissa, v down;
                      the centre of pixel (0, 0) is at (0.5, 0.5)
    angle_var (M,)    variance of theta, rad^2; inf for a circle
    label (H, W)      int32: a pixel of blob m (from 0) has m + 1, a pixel of no blob has 0
    """

    box: Array
    area: Array
    ellipse: Array
    angle_var: Array
    label: Labels

    def __len__(self) -> int:
        return len(self.area)

    def window(self, row: int, margin: int = 0) -> tuple[slice, slice]:
        """Returns the rows and columns of the box of blob `row` (from 0), and of `margin` px round it."""
        left, top, wide, high = self.box[row].astype(int).tolist()
        return (
            slice(max(top - margin, 0), top + high + margin),
            slice(max(left - margin, 0), left + wide + margin),
        )

    def cut(self) -> Bools:
        """Returns flags (M,): True for each blob whose box touches an edge of the image or is at most 1 px away from
        it."""
        high, wide = self.label.shape
        right, bottom = self.box[:, 0] + self.box[:, 2], self.box[:, 1] + self.box[:, 3]
        return np.asarray((self.box[:, 0] <= 1) | (self.box[:, 1] <= 1) | (right >= wide - 1) | (bottom >= high - 1))


def clean(foreground: Bools, px_per_m: float) -> Bools:
    """Returns a foreground mask (H, W) bool after majority, opening and closing, in this order; the argument is not
    changed (sec. 3.3)."""
    mask: NDArray[Any] = foreground.astype(np.uint8)
    size = odd(MAJORITY_M * px_per_m, 3)
    mask = (cv2.boxFilter(mask, cv2.CV_16U, (size, size), normalize=False) > size * size // 2).astype(np.uint8)
    for operation, metres, least in ((cv2.MORPH_OPEN, OPEN_M, LEAST_OPEN), (cv2.MORPH_CLOSE, CLOSE_M, 3)):
        mask = cv2.morphologyEx(mask, operation, disc(odd(metres * px_per_m, least)))
    return mask.astype(bool)


def odd(size: float, least: int) -> int:
    """Returns the odd whole number nearest to `size` (px), but at least `least` (an odd number of px)."""
    return max(least, 2 * round((size - 1) / 2) + 1)


@cache
def disc(size: int) -> Image:
    """Returns a disc of diameter `size` px (odd) as an array (size, size) uint8: 1 inside, 0 outside."""
    v, u = np.mgrid[:size, :size] - (size - 1) / 2
    return np.asarray(np.hypot(u, v) <= size / 2, np.uint8)


def find(mask: Bools, min_area: float) -> Blobs:
    """Returns the connected regions (8 neighbours) of a foreground mask (H, W) bool that have at least `min_area`
    pixels; of more than MOST = 500 the largest."""
    runs = kernels.find_runs(np.ascontiguousarray(mask))
    first, region = np.unique(kernels.connect(runs), return_inverse=True)
    box, area, centre, spread = kernels.moments(runs, region, len(first))
    order = np.argsort(-area, kind="stable")  # of equal regions that of the first pixel comes first
    order = order[area[order] >= min_area][:MOST]
    number = np.zeros(len(first), np.int32)
    number[order] = np.arange(1, len(order) + 1)
    label = np.zeros(mask.shape, np.int32)
    kernels.paint(runs, number[region], label)
    xx, xy, yy = spread[order].T
    cov = np.stack([xx + 1 / 12, xy, xy, yy + 1 / 12], axis=-1).reshape(-1, 2, 2)
    ellipse, angle_var = ellipses(area[order], centre[order] + 0.5, cov)
    return Blobs(box[order], area[order], ellipse, angle_var, label)


def ellipses(n: Array, centre: Array, cov: Array) -> tuple[Array, Array]:
    """Returns the ellipses (M, 5) of M regions: centre x, y, full axes h >= w (px), theta (rad); and theta's variance
    (M,)."""
    half, differ = (cov[:, 0, 0] + cov[:, 1, 1]) / 2, (cov[:, 0, 0] - cov[:, 1, 1]) / 2
    root = np.hypot(differ, cov[:, 0, 1])
    major, minor = half + root, np.maximum(half - root, 0.0)
    theta = 0.5 * np.arctan2(cov[:, 0, 1], differ)
    with np.errstate(divide="ignore"):
        angle_var = major * minor / (n * np.square(2 * root))
    return np.column_stack([centre, 4 * np.sqrt(major), 4 * np.sqrt(minor), theta]), angle_var
