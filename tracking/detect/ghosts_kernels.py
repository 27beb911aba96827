"""Kernel of tracking.detect.ghosts: for how long each pixel has kept its colour. Numpy twin: tests/reference_background.py."""

from __future__ import annotations

import numpy as np

from sim.compiler import njit
from sim.types import Image, Ints
from tracking.detect.background_kernels import Floats

MEMORY = 30
"""Sightings after which the mean of a colour forgets the older ones, so that it follows slow changes."""


@njit(cache=True, error_model="numpy")
def watch(image: Image, gain: Floats, reach: Floats, colour: Floats, sightings: Ints) -> None:
    """Update, in place, each pixel's mean colour since it last changed, and in how many pictures it has been seen.

    image (H, W, 3) uint8; gain (3,): its brightness per channel. reach (3,): grey levels; a channel farther than this
    from the mean is a change, and starts both anew. colour (3, H, W): at gain 1; sightings (H, W).
    """
    for r in range(image.shape[0]):
        for c in range(image.shape[1]):
            same = True
            for k in range(3):
                same = same and abs(np.float32(image[r, c, k]) / gain[k] - colour[k, r, c]) <= reach[k]
            sightings[r, c] = sightings[r, c] + 1 if same else 1
            share = np.float32(1.0) / np.float32(min(sightings[r, c], MEMORY))
            for k in range(3):
                colour[k, r, c] += share * (np.float32(image[r, c, k]) / gain[k] - colour[k, r, c])
