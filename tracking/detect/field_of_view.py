"""Which places the camera's picture shows: nobody is tracked outside it."""

from __future__ import annotations

import numpy as np

from sim.scene.camera import project
from sim.types import Array, Bools, Context, Plane

MIDDLE = 0.85
"""Height of the middle of a body, m."""


def inside(pos: Array, plane: Plane, context: Context, unit: float) -> Bools:
    """Return flags (...,): True where the picture shows a person at pos (..., 2), m (on the ground the middle of the
    body).

    plane: of the places; unit: length of a metre in the plane's unit, px per m in the image. Without a camera, or
    without the image's size in the image, all are True.
    """
    shape = pos.shape[:-1]
    if plane == "image":
        if context.image_size is None:
            return np.ones(shape, bool)
        uv, size = pos * unit, context.image_size
    else:
        if context.camera is None:
            return np.ones(shape, bool)
        flat = pos.reshape(-1, 2)
        uv, size = project(context.camera, np.column_stack([flat, np.full(len(flat), MIDDLE)]))[0], context.camera.image
    return np.asarray(((uv >= 0) & (uv <= size)).all(axis=-1).reshape(shape))
