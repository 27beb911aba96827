"""Tsai's radial lens distortion: distort, undistort and the derivative, all in closed form.

Coordinates are in units of the focal length, from the image centre. A lens of coefficient k shows at the distorted
point x, |x| = r, what an ideal lens shows at y = x (1 + k r²). Given |y| = q, the distorted radius r is the root of
r + k r³ = q that continues r = 0: r = 2/√(3k) sinh(asinh(3/2 q √(3k))/3) for k > 0. For k < 0 sin and asin with √(-3k)
replace sinh and asinh; points with q > 2/(3 √(-3k)) are not shown at all.
"""

from __future__ import annotations

import numpy as np

from sim.elementary import atan2, dot, exp, length, log, sin
from sim.types import Array


def undistort(x: Array, k: float) -> Array:
    """Returns the ideal points y = x (1 + k |x|²) of distorted points x (N, 2)."""
    if k == 0.0:
        return x
    return np.asarray(x * (1.0 + k * dot(x, x)[:, None]))


def distort(y: Array, k: float) -> Array:
    """Returns the distorted points x (N, 2) of ideal points y (N, 2); nan where the lens does not show the point."""
    if k == 0.0:
        return y
    root = np.sqrt(3.0 * abs(k))
    q = length(y)[:, None]
    known = np.isfinite(q)
    x = np.where(known, 1.5 * q * root, 0.0)
    with np.errstate(invalid="ignore", divide="ignore"):
        if k > 0:
            e = exp(log(x + np.sqrt(x * x + 1.0)) / 3)  # asinh and sinh
            third = (e - 1.0 / e) / 2
        else:
            third = sin(atan2(x, np.sqrt(1.0 - x * x)) / 3)
        r = np.where(x < 0.02, q, third * 2 / root)
        for _ in range(3):  # Newton's steps, where the closed form would lose digits
            r = np.where(x < 0.5, r - (r + k * r * r * r - q) / (1.0 + 3.0 * k * r * r), r)
        return np.asarray(y * np.where(known, np.where(q > 0, r / q, 1.0), np.nan))


def undistort_jacobian(x: Array, k: float) -> Array:
    """Returns the derivative (N, 2, 2) of `undistort` at x (N, 2): (1 + k |x|²) I + 2 k x xᵀ."""
    r2 = dot(x, x)
    return np.asarray((1.0 + k * r2)[:, None, None] * np.eye(2) + 2.0 * k * x[:, :, None] * x[:, None, :])
