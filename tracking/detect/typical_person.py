"""The person whom trackers expect before they have seen anybody: a prior in metres for any camera (ours).

Its width and depth are the trackers' own belief about real people, not the body that the simulator draws. Its height is
PERSON_HEIGHT, which defines the scale of an image. A real person with arms is some 0.5 m wide and 0.3 m deep, so that
the silhouette is some 0.42 m wide in the mean over headings. Stride, bags and wide clothes add to that; `PersonSize`
learns how much from lone blobs.
"""

from __future__ import annotations

import numpy as np

from sim.scene.body import PERSON_HEIGHT, person_boxes
from sim.types import Array, Camera

WIDTH = 0.42  # m, of the silhouette seen from the side, mean over headings
SHOULDERS, DEPTH = 0.459, 0.272  # m, from straight above, where shoulders hide the arms: across and along the heading


def boxes(camera: Camera, ground: Array) -> Array:
    """Returns the boxes (N, 4), left, top, width, height, px, of upright typical people in a pinhole camera's image."""
    n = len(ground)
    tall, wide = np.full(n, PERSON_HEIGHT), np.full(n, WIDTH)
    return person_boxes(camera, np.column_stack([ground, np.zeros(n)]), np.zeros(n), tall, wide, wide)


def axes_from_above(camera: Camera) -> Array:
    """Returns the longer and the shorter axis (2,), px, of a typical person under a camera that looks straight down."""
    tall, wide, deep = np.array([PERSON_HEIGHT]), np.array([SHOULDERS]), np.array([DEPTH])
    return np.sort(person_boxes(camera, np.zeros((1, 3)), np.zeros(1), tall, wide, deep)[0, 2:])[::-1]
