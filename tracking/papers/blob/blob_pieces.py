"""Blobs that are pieces of one person: several measurements of one track from pixels.

At frame 367 of Gonzalez et al. (2006, sec. 5) a person is segmented into several pieces, which "still lie within the
gate" and "are assigned to the existing tracker". The paper does not say how several measurements update one filter.
Here they are one measurement, their union: the ellipse of all their pixels. The gate holds for the union, as half a
person alone is far from the prediction in height and centre.
"""

from __future__ import annotations

import numpy as np

from sim.types import Array, Bools, Ints
from tracking.detect import blobs
from tracking.papers.blob import box_geometry


def owners(centre: Array, predicted: Array, d2: Array, free: Bools) -> Ints:
    """Returns the row (M,) of the track of which each blob may be a piece, -1 for none."""
    found = np.full(len(centre), -1)
    if not len(predicted):
        return found
    inside = box_geometry.points_inside(centre, predicted).T & free
    held = inside.any(0)
    found[held] = np.where(inside, d2, np.inf).argmin(0)[held]
    return found


def hull(box: Array) -> Array:
    """Returns the box (1, 4) round boxes (K, 4), K at least 1; left, top, width, height, px."""
    low, high = box[:, :2].min(0), (box[:, :2] + box[:, 2:]).max(0)
    return np.concatenate([low, high - low])[None]


def union(area: Array, ellipse: Array) -> tuple[Array, float]:
    """Returns the ellipse (5,) of all pixels of several blobs, and the variance of its direction, rad^2."""
    share, c, s = area / area.sum(), np.cos(ellipse[:, 4]), np.sin(ellipse[:, 4])
    axes = np.square(ellipse[:, 2:4] / 4)
    turn = np.stack([np.stack([c, -s], 1), np.stack([s, c], 1)], 1)
    cov = turn @ (axes[:, :, None] * turn.transpose(0, 2, 1))
    centre = share @ ellipse[:, :2]
    away = ellipse[:, :2] - centre
    whole = np.tensordot(share, cov + away[:, :, None] * away[:, None], 1)
    made, angle_var = blobs.ellipses(np.array([area.sum()]), centre[None], whole[None])
    return made[0], float(angle_var[0])
