"""Blobs as large as people, and what the background sample tells of people's size (ours)."""

from __future__ import annotations

import numpy as np

from sim.types import Array, Bools, Image
from tracking.detect import blobs
from tracking.detect.background import Background
from tracking.detect.mog2 import Mog2
from tracking.detect.person_size import PersonSize
from tracking.detect.pixel_classes import foreground

LEAST_AREA, LEAST_PIXELS = 0.0125, 12.0  # m^2 at the scale, px^2: smaller blobs are noise
COARSE = 18.0  # m that an image is high, while no scale is known
LOOKED = 25  # frames of the background sample in which lone blobs are looked for


def or_guess(scale: float, high: int) -> float:
    """px per m; a guess from the image's height, px, as long as nobody was seen."""
    return scale if scale > 0 else high / COARSE


def people(mask: Bools, scale: float) -> blobs.Blobs:
    """The blobs of a cleaned foreground (H, W) that are no noise (González et al. 3.3); scale: px per m."""
    return blobs.find(mask, max(LEAST_AREA * scale**2, LEAST_PIXELS))


def cut(box: Array, shape: tuple[int, ...]) -> Bools:
    """(M,) does the edge of an image of this shape cut these boxes ltwh (M, 4)?"""
    high, wide = shape
    right, bottom = box[:, 0] + box[:, 2], box[:, 1] + box[:, 3]
    return np.asarray((box[:, 0] <= 1) | (box[:, 1] <= 1) | (right >= wide - 1) | (bottom >= high - 1))


def learn(size: PersonSize, background: Background | Mog2, sample: Image, scale: float) -> None:
    """Let `size` learn from the lone blobs in the frames (K, H, W, 3) of the background sample; scale: nan unknown."""
    shape = background.valid.shape
    scale = or_guess(scale, shape[0])
    for image in sample[:: max(len(sample) // LOOKED, 1)]:
        found = people(blobs.clean(foreground(background.classify(image)), scale), scale)
        size.learn(found.box, found.ellipse, ~cut(found.box, shape))
