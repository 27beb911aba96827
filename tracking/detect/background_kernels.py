"""All pixels in one pass each, as numba kernels: classes, adaptation; numpy twins: tests/reference_background.py.

E: mean colours, V: variances (H, W, 3); s, b: normalisers (H, W); g: gain per channel (3,); all float32.
Each kernel calls none of another: numba's cache does not see changes of what is called in other files.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from sim.types import Array, Bools, Image


@njit(cache=True, error_model="numpy")
def classify(
    image: Image, E: Array, V: Array, s: Array, b: Array, valid: Bools, g: Array, limits: Array, out: Image
) -> None:
    """Fill `out` (H, W) with classes; limits: (CD, lower, upper, dark, bright), see tracking.detect.background."""
    one, top = np.float32(1.0), np.float32(255.0)
    tau2, lower, upper, dark, bright = limits[0] * limits[0], limits[1], limits[2], limits[3], limits[4]
    g0, g1, g2 = g[0], g[1], g[2]
    for r in range(image.shape[0]):
        for c in range(image.shape[1]):
            i0, i1, i2 = np.float32(image[r, c, 0]), np.float32(image[r, c, 1]), np.float32(image[r, c, 2])
            e0, e1, e2 = min(g0 * E[r, c, 0], top), min(g1 * E[r, c, 1], top), min(g2 * E[r, c, 2], top)
            w0, w1, w2 = one / V[r, c, 0], one / V[r, c, 1], one / V[r, c, 2]
            length2 = w0 * e0 * e0 + w1 * e1 * e1 + w2 * e2 * e2
            alpha = (w0 * e0 * i0 + w1 * e1 * i1 + w2 * e2 * i2) / length2
            d0, d1, d2 = i0 - alpha * e0, i1 - alpha * e1, i2 - alpha * e2
            cd2 = w0 * d0 * d0 + w1 * d1 * d1 + w2 * d2 * d2
            brightness = (alpha - one) * np.sqrt(length2) / s[r, c]
            low, high = brightness < lower, brightness > upper
            kind = 0
            if high:
                kind = 1 if alpha > bright else 4
            if low:
                kind = 2 if alpha < dark else 3
            if cd2 > tau2 * b[r, c] * b[r, c]:
                kind = 1
            out[r, c] = kind if valid[r, c] else 0


@njit(cache=True, error_model="numpy")
def adapt(
    image: Image,
    classes: Image,
    protected: Bools,
    E: Array,
    V: Array,
    g: Array,
    first: int,
    step: int,
    fast: float,
    slow: float,
    least: float,
) -> None:
    """Move E towards I / g in rows first, first + step, …: by `fast` where background, by `slow` elsewhere, not where
    protected; V follows the squared residuals of background, never below `least`."""
    quick, late, floor = np.float32(fast), np.float32(slow), np.float32(least)
    for r in range(first, image.shape[0], step):
        for c in range(image.shape[1]):
            if protected[r, c]:
                continue
            seen = classes[r, c] == 0
            rate = quick if seen else late
            for k in range(3):
                d = np.float32(image[r, c, k]) / g[k] - E[r, c, k]
                E[r, c, k] += rate * d
                if seen:
                    V[r, c, k] = max(V[r, c, k] + rate * (d * d * g[k] * g[k] - V[r, c, k]), floor)
