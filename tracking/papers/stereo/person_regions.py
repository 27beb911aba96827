"""Person or not: height and width of foreground regions from their points in space (Hoshikawa et al. 2011, sec. 2).

A region is a blob of the foreground. Its height is the range of its points' world z, its width their range across the
line of sight: that between the 10 % and 90 % quantiles over 0.8. The points' own errors widen a range. A region is too
low or too narrow if even the measured range is, and too high only if the range without them is. The paper prints
neither its measure nor limits. Ours: a region that the edge of the image cuts is not too small for a person, a region
of several people may be of any width, and one with fewer than LEAST_POINTS disparities is nobody.
"""

from __future__ import annotations

import numpy as np

from sim.scene.camera import back_project, point_covariances
from sim.types import Array, Bools, Camera
from tracking.detect.blobs import Blobs
from tracking.detect.subtraction_stereo import Disparities

QUANTILES = 0.1, 0.9  # Ranges are those between these quantiles: matches may be wrong.
NORMAL_RANGE = 2.563  # Range of a normal distribution between these quantiles, in standard deviations.
LEAST_HEIGHT, MOST_HEIGHT, LEAST_WIDTH = 0.5, 3.0, 0.1  # m, of a foreground region that is a person (sec. 2).
LEAST_POINTS = 5  # Points with a disparity that a region needs to be measured.


def person_mask(blobs: Blobs, disparity: Disparities, camera: Camera, deviations: tuple[float, float, float]) -> Bools:
    """Returns the foreground (H, W) bool of the regions that may be people; deviations (3,): standard deviations of a
    point's u, v and disparity, px."""
    height, width, error = sizes(blobs, disparity, camera, deviations)
    small = (height < LEAST_HEIGHT) | (width < LEAST_WIDTH)
    keep = np.isfinite(height) & (height**2 - error**2 <= MOST_HEIGHT**2) & (~small | blobs.cut())
    return np.asarray(np.concatenate([[False], keep])[blobs.label])


def sizes(
    blobs: Blobs, disparity: Disparities, camera: Camera, deviations: tuple[float, float, float]
) -> tuple[Array, Array, Array]:
    """Returns height, width and the height that errors alone would give, (M,) each, m, of M foreground regions."""
    found = np.full((3, len(blobs)), np.nan)
    row, column = np.nonzero(~np.isnan(disparity))
    blob = blobs.label[row, column] - 1
    points = back_project(camera, np.column_stack([column + 0.5, row + 0.5, disparity[row, column]]))
    axes = np.stack([[0.0, 0.0, 1.0], camera.rotation[0]])
    for k in np.flatnonzero(np.bincount(blob, minlength=len(blobs)) >= LEAST_POINTS).tolist():
        mine = points[blob == k]
        low, high = np.quantile(mine @ axes.T, QUANTILES, axis=0)
        middle = np.median(mine, 0)[None]
        error = NORMAL_RANGE * np.sqrt(point_covariances(camera, middle, np.square(deviations))[0, 2, 2])
        found[:, k] = np.append(high - low, error) / (QUANTILES[1] - QUANTILES[0])
    return found[0], found[1], found[2]
