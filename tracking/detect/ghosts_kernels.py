"""Kernel of tracking.detect.ghosts: for how long each pixel has kept its colour.

Numpy twin: tests/reference_background.py.
"""

from __future__ import annotations

import numpy as np

from sim.compiler import njit
from sim.types import Image
from tracking.detect.background_kernels import Floats

MEMORY = np.float32(30)
"""Sightings after which the mean of a colour forgets the older ones, so that it follows slow changes."""


@njit(cache=True, error_model="numpy")
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
