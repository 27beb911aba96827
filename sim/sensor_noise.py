"""A camera's noise: normal, independent in each pixel and colour; a tile is drawn once and laid anew in each frame."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sim.rng import rng
from sim.types import Image

SLACK = 192  # px by which the tile is larger than a picture: so many offsets squared, times eight turnings


@dataclass(frozen=True)
class Grain:
    """tile (H + SLACK, W + SLACK, 3) grey levels, None without noise; the seed that lays it."""

    tile: NDArray[np.int16] | None
    seed: int
    repeat: int

    def add(self, image: Image, frame: int, side: int) -> Image:
        """The picture with the noise of a frame (a number from 0) and a side."""
        if self.tile is None:
            return image
        import cv2

        source = rng(self.seed, "noise", 1 + frame, side, repeat=self.repeat)
        down, right = source.integers(SLACK, size=2)
        height, width = image.shape[:2]
        here = self.tile[down : down + height, right : right + width]
        sign = -1 if source.integers(2) else 1
        return np.asarray(cv2.addWeighted(image, 1.0, here, float(sign), 0.0, dtype=cv2.CV_8U), np.uint8)


def grain(sd: float, size: tuple[int, int], seed: int, repeat: int = 0) -> Grain:
    """Noise of standard deviation `sd` for pictures of `size` (width, height)."""
    if sd == 0:
        return Grain(None, seed, repeat)
    shape = (size[1] + SLACK, size[0] + SLACK, 3)
    tile = rng(seed, "noise", 0, repeat=repeat).standard_normal(shape, dtype=np.float32) * np.float32(sd)
    return Grain(np.rint(tile).astype(np.int16), seed, repeat)
