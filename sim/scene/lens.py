"""Tsai's radial lens distortion: distort, undistort and the derivative, all in closed form.

Coordinates are in units of the focal length, from the image centre. A lens of coefficient k shows at the distorted
point x, |x| = r, what an ideal lens shows at y = x (1 + k r²). Given |y| = q, the distorted radius r is the root of
r + k r³ = q that continues r = 0: r = 2/√(3k) sinh(asinh(3/2 q √(3k))/3) for k > 0. For k < 0 sin and asin with √(-3k)
replace sinh and asinh; points with q > 2/(3 √(-3k)) are not shown at all.
"""

from __future__ import annotations

import numpy as np

from sim.types import Array


def undistort(x: Array, k: float) -> Array:
    """Return the ideal points y = x (1 + k |x|²), (N, 2), of distorted points x (N, 2); x itself, not a copy, if k is
    0.

    Points are in units of the focal length, from the image centre. k: the lens's radial coefficient. nan stays nan.
    """
    if k == 0.0:
        return x
    return np.asarray(x * (1.0 + k * (x**2).sum(axis=1, keepdims=True)))


def distort(y: Array, k: float) -> Array:
    """Return the distorted points x (N, 2) of ideal points y (N, 2), where y = x (1 + k |x|²); y itself if k is 0.

    Points are in units of the focal length, from the image centre. k: the lens's radial coefficient. For k < 0 a point
    with |y| > 2/(3 √(-3k)) is not shown by the lens: its row is nan.
    """
    if k == 0.0:
        return y
    root = np.sqrt(3.0 * abs(k))
    q = np.linalg.norm(y, axis=1, keepdims=True)
    with np.errstate(invalid="ignore", divide="ignore"):
        r = (np.sinh(np.arcsinh(1.5 * q * root) / 3) if k > 0 else np.sin(np.arcsin(1.5 * q * root) / 3)) * 2 / root
        return np.asarray(y * np.where(q > 0, r / q, 1.0))


def undistort_jacobian(x: Array, k: float) -> Array:
    """Return the derivative (N, 2, 2) of `undistort` at distorted points x (N, 2): (1 + k |x|²) I + 2 k x xᵀ.

    Rows are the ideal point's coordinates, columns those of x. Points are in units of the focal length, from the image
    centre. k: the lens's radial coefficient.
    """
    r2 = (x**2).sum(axis=1)
    return np.asarray((1.0 + k * r2)[:, None, None] * np.eye(2) + 2.0 * k * x[:, :, None] * x[:, None, :])
