"""Areas, overlaps, distances and footprints of single polygons, by the functions for many; points in polygons."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from sim.geometry.polygons import cross, footprint_hulls, gap_pairs, iou_pairs, pack
from sim.types import Array, Bools


def iou_matrix(a: Sequence[Array], b: Sequence[Array]) -> Array:
    """Returns the intersection over union (N, M) of convex polygons (V, 2), each of a with each of b."""
    i, j = (g.ravel() for g in np.indices((len(a), len(b))))
    width = max((len(p) for p in (*a, *b)), default=1)
    return iou_pairs(pack(a, width), pack(b, width), i, j).reshape(len(a), len(b))


def polygon_gap(a: Array, b: Array) -> float:
    """Returns the distance between two convex polygons, of which one has area; nan if one is empty."""
    none = np.zeros(1, np.int64)
    return float(gap_pairs(pack([a]), pack([b]), none, none)[0])


def area(polygon: Array) -> float:
    """Returns the signed area of a polygon (V, 2): negative if clockwise."""
    return float(pack([polygon]).area[0])


def footprint_hull(pos: Array) -> Array:
    """Returns the hull (V, 2) of the footprints of N people at pos (N, 2); (0, 2) of nobody."""
    return footprint_hulls(pos, np.array([len(pos)]))[0]


def contains(polygon: Array, points: Array, dilate: float = 0.0) -> Bools:
    """Returns which points (N, 2) are in the convex polygon (V, 2), on its edge, or at most `dilate` off each side."""
    edge = np.roll(polygon, -1, axis=0) - polygon
    off = cross(edge, points[:, None] - polygon) / np.hypot(*edge.T)
    return (off >= -dilate).all(axis=1)
