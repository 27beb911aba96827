"""Detections as places in metres, and boxes of people who are tracked as points.

For trackers of points that report people with boxes: in the image a person keeps the size of the boxes that were
measured, which follows them slowly.
"""

from __future__ import annotations

import numpy as np

from sim.types import Array, Detections

BOX_TIME = 0.5  # Time constant with which the size of a person's box follows measured boxes, s.


def ordered_points(detections: Detections, unit: float) -> tuple[Array, Array | None]:
    """Returns places (M, 2), m, and sizes of boxes (M, 2): width, height, px, None on the ground or without boxes."""
    order = np.lexsort(detections.pos[:, 1::-1].T)
    sizes = None
    if detections.plane == "image" and detections.box is not None:
        sizes = detections.box[order, 2:]
    return np.ascontiguousarray(detections.pos[order, :2] / unit), sizes


def followed_sizes(old: Array, new: Array, dt: Array | float) -> Array:
    """Returns the sizes of boxes (N, 2), px, after boxes of sizes `new` (N, 2) were measured."""
    return np.asarray(np.where(np.isnan(old), new, new + (old - new) * np.exp(-dt / BOX_TIME)))


def boxes_at(pos: Array, size: Array) -> Array | None:
    """Returns boxes (N, 4) left, top, width, height in px with the centres pos (N, 2) px; None if a size is unknown."""
    return np.concatenate([pos - size / 2, size], axis=1) if np.isfinite(size).all() else None
