"""Middles and overlaps of boxes: left, top, width, height in px."""

from __future__ import annotations

import numpy as np

from sim.types import Array

LEAST = 1e-12  # px²: boxes without an area overlap by 0


def box_iou(a: Array, b: Array) -> Array:
    """Returns the IoU (…) of boxes a (…, 4) and b (…, 4), which are broadcast; 0 where one is nan."""
    inner = box_intersections(a, b)
    union = a[..., 2] * a[..., 3] + b[..., 2] * b[..., 3] - inner
    return np.nan_to_num(inner / np.maximum(union, LEAST))


def box_intersections(a: Array, b: Array) -> Array:
    """Returns the common areas (…) of boxes a (…, 4) and b (…, 4), which are broadcast; nan where a box is nan."""
    low = np.maximum(a[..., :2], b[..., :2])
    high = np.minimum(a[..., :2] + a[..., 2:], b[..., :2] + b[..., 2:])
    return np.asarray(np.prod(np.maximum(high - low, 0.0), axis=-1))


def centres(box: Array) -> Array:
    """Returns the middles (R, 2) of boxes (R, 4) left, top, width, height."""
    return np.asarray(box[:, :2] + box[:, 2:] / 2)
