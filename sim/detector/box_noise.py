"""Errors of a detector's boxes in proportion to their size, as scenarios.schema.sensor.BoxNoise describes them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from sim.types import Array, Camera

if TYPE_CHECKING:
    from scenarios.schema.sensor import BoxNoise


def erring(box: Array, visibility: Array, noise: BoxNoise, n: Array) -> Array:
    """Boxes (R, 4) ltwh moved by errors n (R, 4), standard normals for middle, foot, top and width.

    With h the box's height: middle += h e0, foot += h e1, top += h e2, log width += e3. At least 1 px (or what there
    was) remains of width and height.
    """
    n = heavier(n, noise.tails)
    means, sds = np.array([noise.across, noise.foot, noise.top, noise.width]).T
    e = means + sds * (1.0 + noise.occluded * (1.0 - visibility))[:, None] * n
    left, top, w, h = box.T
    middle = left + w / 2 + h * e[:, 0]
    foot, top = top + h * (1.0 + e[:, 1]), top + h * e[:, 2]
    width, height = w * np.exp(e[:, 3]), foot - top
    width, height = np.maximum(width, np.minimum(w, 1.0)), np.maximum(height, np.minimum(h, 1.0))
    return np.stack([middle - width / 2, foot - height, width, height], axis=1)


def heavier(n: Array, tails: float) -> Array:
    """Standard normals made Student's t of unit variance and excess kurtosis `tails`, each at its quantile."""
    if not tails:
        return n
    from scipy.special import ndtr, stdtrit

    freedom = 4.0 + 6.0 / tails
    return np.asarray(stdtrit(freedom, ndtr(n)) * np.sqrt((freedom - 2.0) / freedom))


def box_errors(box: Array, true: Array) -> Array:
    """(R, 4) errors of boxes against true ones: `erring` the other way round, means and sds not taken off."""
    h = true[:, 3]
    foot, true_foot = box[:, 1] + box[:, 3], true[:, 1] + h
    middle, true_middle = box[:, 0] + box[:, 2] / 2, true[:, 0] + true[:, 2] / 2
    across, low, high = (middle - true_middle) / h, (foot - true_foot) / h, (box[:, 1] - true[:, 1]) / h
    return np.stack([across, low, high, np.log(box[:, 2] / true[:, 2])], axis=1)


def feet(box: Array, z: Array, camera: Camera) -> Array:
    """(R, 2) m: where boxes say that people stand, at the ground's height z (R,); nan where they show no ground.

    The middle of the lower edge; from above the box's middle.
    """
    from sim.scene.camera import rays

    down = 0.5 if camera.kind == "top" else 1.0
    origin, direction = rays(camera, box[:, :2] + box[:, 2:] * np.array([0.5, down]))
    with np.errstate(divide="ignore", invalid="ignore"):
        s = (z - origin[:, 2]) / direction[:, 2]
    s = np.where(np.isfinite(s) & (s > 0), s, np.nan)
    return np.asarray(origin[:, :2] + s[:, None] * direction[:, :2])
