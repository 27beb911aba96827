"""Kernel of tracking.detect.shadow_depth: the histogram of relative brightness over evenly darkened pixels."""

from __future__ import annotations

import numpy as np

from sim.compiler import njit
from sim.types import Image, Ints
from tracking.detect.background_kernels import DARK, SHADOW, Floats

AROUND = ((-1, 0), (1, 0), (0, -1), (0, 1), (-1, -1), (-1, 1), (1, -1), (1, 1))
SAME = 2.5  # standard deviations of a difference of two pixels within which they are equally dark


@njit(cache=True)
def count_even(
    planes: tuple[Image, ...], classes: Image, E: Floats, V: Floats, s: Floats, g: Floats, counts: Ints
) -> None:
    """Adds to `counts` (BINS,) the relative brightness alpha, 0 to 1, of each evenly darkened pixel of a picture.

    A pixel is one if it and its 8 neighbours are DARK or SHADOW in `classes` (H, W), and all nine are equally dark
    within the noise. planes: three of (H, W) uint8, the colours; E, V (3, H, W): mean at gain 1 and variance; s (H, W):
    normaliser of brightness; g (3,): gain.
    """
    high, wide = classes.shape
    alpha, spread = np.zeros((high, wide)), np.zeros((high, wide))
    for r in range(high):
        for c in range(wide):
            if classes[r, c] == DARK or classes[r, c] == SHADOW:
                length2, dot = 0.0, 0.0
                for k in range(3):
                    e = min(float(g[k]) * float(E[k, r, c]), 255.0)
                    length2 += e * e / V[k, r, c]
                    dot += e * planes[k][r, c] / V[k, r, c]
                alpha[r, c], spread[r, c] = dot / length2, s[r, c] * s[r, c] / length2
    for r in range(1, high - 1):
        for c in range(1, wide - 1):
            even = spread[r, c] > 0
            for down, right in AROUND:
                other = spread[r + down, c + right]
                off = alpha[r + down, c + right] - alpha[r, c]
                even &= other > 0 and off * off <= SAME * SAME * (spread[r, c] + other)
            if even:
                counts[min(int(alpha[r, c] * len(counts)), len(counts) - 1)] += 1
