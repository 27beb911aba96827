"""The measurements of tracks from pixels in one frame, as arrays."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from sim.types import Array, Ints


class Measured(NamedTuple):
    """Measurements of K tracks, one row each; tracks without a measurement have no row.

    rows (K,): table positions of the tracks, from 0, each once, in any order. z (K, 5): ellipse: centre x, y, full axes
    h, w (px), direction theta of h (rad). noise (K, 4): variances of x, y, h, w, m^2. angle_var (K,): variance of
    theta, rad^2, inf if it is not measured. support (K,), 0 to 1: foreground less half the background, of the pixels
    that the template alone covers, over its area; 1 for a blob.
    """

    rows: Ints
    z: Array
    noise: Array
    angle_var: Array
    support: Array

    def joined(self, more: Measured) -> Measured:
        """Returns new Measured with the rows of these measurements followed by those of `more`."""
        return Measured(*(np.concatenate(pair) for pair in zip(self, more, strict=True)))
