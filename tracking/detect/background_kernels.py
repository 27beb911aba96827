"""All pixels in one pass each, as numba kernels: classes, adaptation; numpy twins: tests/reference_background.py.

Pixels lie in a row, colours in planes, so that the loops vectorise: image planes i (N,) uint8; E: mean colours, V:
variances (3, N); s, b: normalisers (N,), inf where there is no background; g: gain per colour (3,). All float32.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from sim.types import Bools, Image
from tracking.detect.pixel_classes import Floats


@njit(cache=True, error_model="numpy")
def classify(
    i0: Image, i1: Image, i2: Image, E: Floats, V: Floats, s: Floats, b: Floats, g: Floats, limits: Floats, out: Image
) -> None:
    """Fill `out` (N,) with classes; limits (5,): thresholds of CD / b, lower and upper of (alpha - 1) / a; dark, bright
    of alpha; see tracking.detect.background. What is asked first in the paper is written last here."""
    one, top = np.float32(1.0), np.float32(255.0)
    tau, lower, upper, dark, bright = limits[0], limits[1], limits[2], limits[3], limits[4]
    g0, g1, g2 = g[0], g[1], g[2]
    E0, E1, E2, V0, V1, V2 = E[0], E[1], E[2], V[0], V[1], V[2]
    for n in range(len(out)):
        x0, x1, x2 = np.float32(i0[n]), np.float32(i1[n]), np.float32(i2[n])
        e0, e1, e2 = min(g0 * E0[n], top), min(g1 * E1[n], top), min(g2 * E2[n], top)
        w0, w1, w2 = one / V0[n], one / V1[n], one / V2[n]
        length2 = w0 * e0 * e0 + w1 * e1 * e1 + w2 * e2 * e2
        alpha = (w0 * e0 * x0 + w1 * e1 * x1 + w2 * e2 * x2) / length2  # Horprasert et al., eq. 5
        d0, d1, d2 = x0 - alpha * e0, x1 - alpha * e1, x2 - alpha * e2
        cd2 = w0 * d0 * d0 + w1 * d1 * d1 + w2 * d2 * d2  # eq. 6, squared
        brightness = (alpha - one) * np.sqrt(length2) / s[n]  # eq. 9, with a_i = s_i / sqrt(length2)
        most = tau * b[n]  # eq. 10: CD / b_i > tau, without a root or a division
        kind = np.uint8(0)
        kind = (np.uint8(1) if alpha > bright else np.uint8(4)) if brightness > upper else kind
        kind = (np.uint8(2) if alpha < dark else np.uint8(3)) if brightness < lower else kind
        out[n] = np.uint8(1) if cd2 > most * most else kind


@njit(cache=True, error_model="numpy")
def adapt(
    image: Image,
    classes: Image,
    protected: Bools,
    E: Floats,
    V: Floats,
    g: Floats,
    first: int,
    step: int,
    fast: float,
    slow: float,
    least: float,
) -> None:
    """Move E and V (3, H, W) by a frame (H, W, 3) uint8 of gain g in rows first, first + step, …; not where protected.

    E goes towards I / g by `fast` where background, by `slow` elsewhere, never below 1 (a black pixel's brightness
    would have no measure); V follows the squared residuals of background, never below `least`. A clipped value that was
    to be clipped tells nothing.
    """
    quick, late, floor = np.float32(fast), np.float32(slow), np.float32(least)
    for r in range(first, image.shape[0], step):
        for c in range(image.shape[1]):
            if protected[r, c]:
                continue
            seen = classes[r, c] == 0
            rate = quick if seen else late
            for k in range(3):
                value = image[r, c, k]
                if value == 255 and g[k] * E[k, r, c] >= np.float32(255.0):
                    continue
                d = np.float32(value) / g[k] - E[k, r, c]
                E[k, r, c] = max(E[k, r, c] + rate * d, np.float32(1.0))
                if seen:
                    V[k, r, c] = max(V[k, r, c] + rate * (d * d * g[k] * g[k] - V[k, r, c]), floor)
