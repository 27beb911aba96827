"""Overlaps and distances of single polygons, by the functions for many pairs."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from sim.geometry.polygons import gap_pairs, iou_pairs, pack
from sim.types import Array


def iou_matrix(a: Sequence[Array], b: Sequence[Array]) -> Array:
    """Returns the intersection over union (N, M) of convex polygons (V, 2), each of a with each of b."""
    i, j = (g.ravel() for g in np.indices((len(a), len(b))))
    width = max((len(p) for p in (*a, *b)), default=1)
    return iou_pairs(pack(a, width), pack(b, width), i, j).reshape(len(a), len(b))


def polygon_gap(a: Array, b: Array) -> float:
    """Returns the distance between two convex polygons, of which one has area; nan if one is empty."""
    none = np.zeros(1, np.int64)
    return float(gap_pairs(pack([a]), pack([b]), none, none)[0])
