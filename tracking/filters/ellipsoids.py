"""Search regions {y : (y - m)' S^-1 (y - m) <= gate} of groups in the plane: do two of them overlap? The exact test.

Gennari & Hager (2004, 3.1) call groups near when their regions have a point in common and do not say how that is found;
here by the test of Gilitschenski & Hanebeck, "A robust computational test for overlap of two arbitrary-dimensional
ellipsoids in fault-detection of Kalman filters" (2012).
"""

from __future__ import annotations

import numpy as np

from sim.types import Array, Bools
from tracking.filters import ellipsoids_kernels as kernels


def overlap(mean: Array, covariance: Array, other_mean: Array, other_covariance: Array, gate: float) -> Bools:
    """(K,) whether the regions of mean (K, 2), covariance (K, 2, 2) and of their others, row by row, overlap; touching
    is overlapping. Covariances are positive definite."""
    found = np.zeros(len(mean), bool)
    for k in range(len(mean)):
        a, b, d = gate * covariance[k], gate * other_covariance[k], other_mean[k] - mean[k]
        found[k] = kernels.overlap(d[0], d[1], a[0, 0], a[0, 1], a[1, 1], b[0, 0], b[0, 1], b[1, 1])
    return found


def overlaps(mean: Array, covariance: Array, gate: float) -> Bools:
    """(G, G) which of the regions of mean (G, 2), covariance (G, 2, 2) overlap each other."""
    return kernels.overlaps(np.ascontiguousarray(mean), gate * covariance)
