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
    planes: tuple[Image, ...], still: Bools, background: Bools, E: Floats, V: Floats, g: Floats, first: int, step: int,
    fast: float, slow: float, least: float,
) -> None:  # fmt: skip
    """Change mean E and variance V, (3, H, W) float32, in place towards a frame. Returns nothing.

    Only the rows first, first + step, first + 2 step, … change. Of these R rows are planes, three of (R, W) uint8: the
    colours; background (R, W): True where the class is BACKGROUND; still (R, W): True where pixels stay as they are. g
    (3,): the frame's gain (brightness factor) per channel.

    E moves towards I / g (I the frame's grey level) by the share `fast` where the class is BACKGROUND, by `slow`
    elsewhere. It stays at 1 or above, as the brightness of a black pixel is undefined. V moves towards the squared
    residual in image grey levels, by `fast`, only where the class is BACKGROUND. It stays at `least` (squared grey
    levels) or above. A channel at 255 is skipped where the model expects 255 or more: a clipped value does not show the
    true brightness. Values are chosen, not branched for, so that the loop vectorises.
    """
    quick, late, floor = np.float32(fast), np.float32(slow), np.float32(least)
    top, one = np.float32(CLIPPED), np.float32(1.0)
    for k in range(3):
        plane, gain = planes[k], g[k]
        for row in range(len(plane)):
            value, mean, var = plane[row], E[k, first + row * step], V[k, first + row * step]
            for c in range(len(value)):
                e, v, seen = mean[c], var[c], background[row, c]
                stays = still[row, c] | ((value[c] == CLIPPED) & (gain * e >= top))
                d = np.float32(value[c]) / gain - e
                moved = max(e + (quick if seen else late) * d, one)
                spread = max(v + (quick if seen else late) * (d * d * gain * gain - v), floor)
                mean[c] = e if stays else moved
                var[c] = spread if seen & ~stays else v


@njit(cache=True)
def watch(planes: tuple[Image, ...], gain: Floats, reach: Floats, colour: Floats, sightings: Floats) -> None:
    """Update, in place, each pixel's mean colour since it last changed, and in how many pictures it has been seen.

    planes: three of (H, W) uint8, the colours of a picture; gain (3,): its brightness per channel. reach (3,): grey
    levels; a channel farther than this from the mean is a change, and starts both anew. colour (3, H, W): at gain 1;
    sightings (H, W) float32.
    """
    one = np.float32(1.0)
    factor, share = one / gain, np.empty(sightings.shape[1], np.float32)
    r0, r1, r2, k0, k1, k2 = reach[0], reach[1], reach[2], factor[0], factor[1], factor[2]
    for r in range(len(sightings)):
        i0, i1, i2, seen = planes[0][r], planes[1][r], planes[2][r], sightings[r]
        m0, m1, m2 = colour[0, r], colour[1, r], colour[2, r]
        for c in range(len(seen)):
            d0, d1, d2 = np.float32(i0[c]) * k0 - m0[c], np.float32(i1[c]) * k1 - m1[c], np.float32(i2[c]) * k2 - m2[c]
            n = seen[c] + one if (abs(d0) <= r0) & (abs(d1) <= r1) & (abs(d2) <= r2) else one
            seen[c], share[c] = n, one / min(n, MEMORY)  # 1 after a change, so that the mean is then this colour
        for k in range(3):
            plane, mean = planes[k][r], colour[k, r]
            for c in range(len(mean)):
                mean[c] += share[c] * (np.float32(plane[c]) * factor[k] - mean[c])
