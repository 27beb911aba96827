"""Kernels of tracking.detect.background and ghosts: the class of each pixel, adaptation of the model, one pass each.

Numpy twins: tests/reference_background.py. The module also defines the five classes (Gonzalez et al. 2006, sec. 3.2).

Colour is the first axis of the model's arrays, so that the loop over pixels vectorises. Arrays, float32 unless noted:
    E, V   (3, N) or (3, H, W): mean colour, grey levels, and its variance, squared grey levels
    s, b   (N,): normalisers of brightness and of chromaticity distortion; inf where the background is unknown
    g      (3,): gain of the frame per colour channel
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sim.compiler import njit
from sim.types import Bools, Image

Floats = NDArray[np.float32]

# The classes of a pixel (uint8); DARK is dark foreground.
BACKGROUND, FOREGROUND, DARK, SHADOW, HIGHLIGHT = range(5)

# Slots of `limits`: thresholds of CD / b and of (alpha - 1) / a, lower and upper; limits of alpha itself.
CHROMATICITY, LOWER, UPPER, DARK_BELOW, BRIGHT_ABOVE = range(5)

# Grey level at which the camera clips.
CLIPPED = 255

# Sightings after which the mean of a colour forgets the older ones, so that it follows slow changes.
MEMORY = np.float32(30)


@njit(cache=True)
def classify(
    i0: Image, i1: Image, i2: Image, E: Floats, V: Floats, s: Floats, b: Floats, g: Floats, limits: Floats, out: Image
) -> None:
    """Writes the class of each of N pixels into `out` (N,) uint8. Returns nothing.

    Classes: 0 BACKGROUND, 1 FOREGROUND, 2 DARK (dark foreground), 3 SHADOW, 4 HIGHLIGHT. i0, i1, i2 (N,) uint8: the
    frame's colour planes in the order of E. E, V (3, N) float32: mean colour at gain 1 in grey levels, and variance
    (above 0). s, b (N,): normalisers of brightness and of chromaticity distortion CD; inf makes the pixel BACKGROUND. g
    (3,): the frame's gain (brightness factor) per channel; E times gain is cut at 255. limits (5,): threshold of CD /
    b, lower and upper threshold of (alpha - 1) / a, alpha below which a pixel is DARK, alpha above which it is
    FOREGROUND. alpha is the pixel's brightness over the model's; a = s / |E / sigma|.

    The paper tests CD first, then dark, highlight, shadow. Here the test that the paper makes first is made last, and
    overwrites the others. The result is the same.
    """
    one, top = np.float32(1.0), np.float32(CLIPPED)
    tau, lower, upper = limits[CHROMATICITY], limits[LOWER], limits[UPPER]
    dark, bright = limits[DARK_BELOW], limits[BRIGHT_ABOVE]
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
        kind = np.uint8(BACKGROUND)
        kind = (np.uint8(FOREGROUND) if alpha > bright else np.uint8(HIGHLIGHT)) if brightness > upper else kind
        kind = (np.uint8(DARK) if alpha < dark else np.uint8(SHADOW)) if brightness < lower else kind
        out[n] = np.uint8(FOREGROUND) if cd2 > most * most else kind


@njit(cache=True)
def adapt(
    image: Image, classes: Image, protected: Bools, E: Floats, V: Floats, g: Floats, first: int, step: int,
    fast: float, slow: float, least: float,
) -> None:  # fmt: skip
    """Change mean E and variance V, (3, H, W) float32, in place towards a frame (H, W, 3) uint8. Returns nothing.

    Only the rows first, first + step, first + 2 step, … change. classes (H, W): the frame's pixel classes. g (3,): the
    frame's gain (brightness factor) per channel. Pixels where `protected` (H, W) is True stay as they are.

    E moves towards I / g (I the frame's grey level) by the share `fast` where the class is BACKGROUND, by `slow`
    elsewhere. It stays at 1 or above, as the brightness of a black pixel is undefined. V moves towards the squared
    residual in image grey levels, by `fast`, only where the class is BACKGROUND. It stays at `least` (squared grey
    levels) or above. A channel at 255 is skipped where the model expects 255 or more: a clipped value does not show the
    true brightness.
    """
    quick, late, floor = np.float32(fast), np.float32(slow), np.float32(least)
    for r in range(first, image.shape[0], step):
        for c in range(image.shape[1]):
            if protected[r, c]:
                continue
            background = classes[r, c] == BACKGROUND
            rate = quick if background else late
            for k in range(3):
                value = image[r, c, k]
                if value == CLIPPED and g[k] * E[k, r, c] >= np.float32(CLIPPED):
                    continue
                d = np.float32(value) / g[k] - E[k, r, c]
                E[k, r, c] = max(E[k, r, c] + rate * d, np.float32(1.0))
                if background:
                    V[k, r, c] = max(V[k, r, c] + rate * (d * d * g[k] * g[k] - V[k, r, c]), floor)


@njit(cache=True)
def watch(image: Image, gain: Floats, reach: Floats, colour: Floats, sightings: Floats) -> None:
    """Update, in place, each pixel's mean colour since it last changed, and in how many pictures it has been seen.

    image (H, W, 3) uint8; gain (3,): its brightness per channel. reach (3,): grey levels; a channel farther than this
    from the mean is a change, and starts both anew. colour (3, H, W): at gain 1; sightings (H, W) float32.
    """
    one, k0, k1, k2 = np.float32(1.0), np.float32(1.0) / gain[0], np.float32(1.0) / gain[1], np.float32(1.0) / gain[2]
    for r in range(image.shape[0]):
        for c in range(image.shape[1]):
            d0 = np.float32(image[r, c, 0]) * k0 - colour[0, r, c]
            d1 = np.float32(image[r, c, 1]) * k1 - colour[1, r, c]
            d2 = np.float32(image[r, c, 2]) * k2 - colour[2, r, c]
            same = abs(d0) <= reach[0] and abs(d1) <= reach[1] and abs(d2) <= reach[2]
            n = sightings[r, c] + one if same else one
            sightings[r, c] = n
            share = one / min(n, MEMORY)  # 1 after a change, so that the mean is then this colour
            colour[0, r, c] += share * d0
            colour[1, r, c] += share * d1
            colour[2, r, c] += share * d2
