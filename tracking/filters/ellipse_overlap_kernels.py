"""Kernels of tracking.filters.components: do two filled ellipses have a common point? (Gilitschenski & Hanebeck 2012)

An ellipse is the set of points y with y' A^-1 y <= 1 about its centre. Its symmetric 2 x 2 matrix A is given by the
entries xx, xy, yy, in the squared unit of the centres. Slow twin for tests: tests/reference_components.py.
"""

from __future__ import annotations

from math import sqrt

import numpy as np

from sim.compiler import njit
from sim.types import Array, Bools

STEPS = 60
"""Most bisections; two ellipses that are still undecided touch, and count as overlapping."""


@njit(cache=True)
def overlap(dx: float, dy: float, axx: float, axy: float, ayy: float, bxx: float, bxy: float, byy: float) -> bool:
    """Returns True if the filled ellipses y' A^-1 y <= 1 and (y - d)' B^-1 (y - d) <= 1 have a common point."""
    # Coordinates with B = I and A = diag(l1, l2). The ellipses are disjoint if and only if, for some s in (0, 1), f(s)
    # = d' (A / (1 - s) + B / s)^-1 d = sum of s (1 - s) d_i^2 / (1 + s (l_i - 1)) > 1 (Gilitschenski & Hanebeck 2012).
    l11 = sqrt(bxx)  # B = L L'
    l21 = bxy / l11
    l22 = sqrt(byy - l21 * l21)
    u = dx / l11
    v = (dy - l21 * u) / l22
    cxx = axx / (l11 * l11)  # C = L^-1 A L^-T
    cxy = (axy / l11 - l21 * cxx) / l22
    cyy = (ayy - 2 * l21 * (axy / l11) + l21 * l21 * cxx) / (l22 * l22)
    half, differ = (cxx + cyy) / 2, (cxx - cyy) / 2
    root = sqrt(differ * differ + cxy * cxy)
    large = half + root
    small = (axx * ayy - axy * axy) / (bxx * byy - bxy * bxy) / large  # half - root would cancel
    p, q = large - 1, small - 1
    # Direction of the first eigenvector: (cxy, l1 - cxx) or (l1 - cyy, cxy), whichever is the longer.
    ex, ey = (root + differ, cxy) if differ >= 0 else (cxy, root - differ)
    length = sqrt(ex * ex + ey * ey)
    # a circle: every direction is an eigenvector
    if length == 0:
        ex, ey, length = 1.0, 0.0, 1.0
    a = (u * ex + v * ey) / length
    b = (v * ex - u * ey) / length
    a2, b2 = a * a, b * b
    low, high = 0.0, 1.0
    value_low, slope_low, value_high, slope_high = 0.0, a2 + b2, 0.0, -(a2 / (1 + p) + b2 / (1 + q))
    for _ in range(STEPS):
        # f is concave: the tangents at both ends of a bracket bound its maximum
        if min(value_low + slope_low * (high - low), value_high - slope_high * (high - low)) <= 1:
            return True
        s = (low + high) / 2
        m, n = 1 + s * p, 1 + s * q
        value = s * (1 - s) * (a2 / m + b2 / n)
        if value > 1:
            return False
        slope = a2 * (1 - 2 * s - s * s * p) / (m * m) + b2 * (1 - 2 * s - s * s * q) / (n * n)
        if slope > 0:
            low, value_low, slope_low = s, value, slope
        else:
            high, value_high, slope_high = s, value, slope
    return True


@njit(cache=True)
def overlaps(mean: Array, shape: Array) -> Bools:
    """Returns flags (G, G): True where two filled ellipses, centres mean (G, 2), matrices (G, 2, 2), overlap."""
    count = len(mean)
    found = np.ones((count, count), np.bool_)
    for i in range(count):
        for j in range(i):
            a, b = shape[i], shape[j]
            dx, dy = mean[j, 0] - mean[i, 0], mean[j, 1] - mean[i, 1]
            found[i, j] = overlap(dx, dy, a[0, 0], a[0, 1], a[1, 1], b[0, 0], b[0, 1], b[1, 1])
            found[j, i] = found[i, j]
    return found
