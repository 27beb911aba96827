"""How dark the shadows of a scene are, from the background sample (ours).

A cast shadow on the ground takes away nearly the same share of the light everywhere. So the relative brightness alpha
of its pixels has a mode, and within a shadow alpha is even up to the noise. Clothes are of many brightnesses, seldom
even where the ground has a texture. Of the pixels that are evenly darkened (shadow_depth_kernels) a histogram of alpha
is made over the sample. Shadows are its brightest mode that has at least MODE of the highest one. They end below the
mode where the histogram has fallen to END of it, or rises again. A darkened pixel below that end is dark foreground.
The noise of the pixels decides how wide the mode is, and so how far the limit is below it.
"""

from __future__ import annotations

import numpy as np

from sim.types import Ints

BINS = 100  # of alpha, from 0 to 1
SAMPLED = 25  # About so many frames of the sample are counted.
SMOOTHED = 3  # bins: the histogram is a running sum over so many
MODE = 0.5  # A mode that is less high than this share of the highest one is none of shadows.
END = 0.1  # Shadows end where the histogram has fallen to this share of their mode.
RISE = 2.0  # The histogram rises again if it is so many times its least value since the mode.
FEWEST = 50  # evenly darkened pixels of the mode and its neighbours; with fewer nothing is known of shadows


def darkest_shadow(counts: Ints, dark: float) -> float | None:
    """Returns the alpha below which a pixel is darker than the shadows; None with too few evenly darkened pixels.

    counts (BINS,): their histogram. dark: alpha below which no pixel is shadow; the result is not below it.
    """
    height = np.convolve(counts, np.ones(SMOOTHED, np.int64), "same")
    first = min(int(np.ceil(dark * BINS)), BINS - 1)
    height[:first] = 0
    if height.max() < FEWEST:
        return None
    inner = np.concatenate([[0], height, [0]])
    modes = np.flatnonzero((height >= MODE * height.max()) & (height >= inner[:-2]) & (height >= inner[2:]))
    at = end = mode = int(modes[-1])
    while at > first and height[end] > END * height[mode] and height[at] <= RISE * height[end]:
        at -= 1
        end = at if height[at] <= height[end] else end
    return max(end / BINS, dark)
