"""Tsai's radial distortion, both ways in closed form.

A lens of coefficient k shows at x (N, 2), |x| = r, what an ideal one shows at y = x (1 + k r²); both in units of the
focal length from the centre. Given |y| = q the distorted r is the root of r + k r³ = q that continues r = 0:
r = 2/√(3k) sinh(asinh(3/2 q √(3k))/3) for k > 0, and with √(-3k), sin and asin for k < 0, where nothing is shown of
q > 2/(3 √(-3k)).
"""

from __future__ import annotations

import numpy as np

from sim.types import Array


def straight(x: Array, k: float) -> Array:
    """Where an ideal lens would show what is seen at x (N, 2)."""
    if k == 0.0:
        return x
    return np.asarray(x * (1.0 + k * (x**2).sum(axis=1, keepdims=True)))


def bent(y: Array, k: float) -> Array:
    """Where the lens shows what an ideal one shows at y (N, 2); nan where it shows it nowhere."""
    if k == 0.0:
        return y
    root = np.sqrt(3.0 * abs(k))
    q = np.linalg.norm(y, axis=1, keepdims=True)
    with np.errstate(invalid="ignore", divide="ignore"):
        r = (np.sinh(np.arcsinh(1.5 * q * root) / 3) if k > 0 else np.sin(np.arcsin(1.5 * q * root) / 3)) * 2 / root
        return np.asarray(y * np.where(q > 0, r / q, 1.0))


def slope(x: Array, k: float) -> Array:
    """(N, 2, 2) derivative of `straight`: (1 + k r²) I + 2 k x xᵀ."""
    r2 = (x**2).sum(axis=1)
    return np.asarray((1.0 + k * r2)[:, None, None] * np.eye(2) + 2.0 * k * x[:, :, None] * x[:, None, :])
