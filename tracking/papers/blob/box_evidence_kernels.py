"""Kernels of box_evidence: boxes that hold two people. Boxes are centred: centre x, y, height, width, px."""

from __future__ import annotations

import numpy as np

from sim.compiler import njit
from sim.types import Array, Ints


@njit(cache=True)
def pairs_beside(boxes: Array, existence: Array, least: float) -> Ints:
    """Returns the pairs (P, 2) of boxes (N, 4) that touch each other and exist with a probability of at least `least`.
    existence (N,)."""
    n, found = 0, np.empty((len(boxes) * (len(boxes) - 1) // 2, 2), np.int64)
    for i in range(len(boxes)):
        for j in range(i + 1, len(boxes)):
            aside = 2 * abs(boxes[i, 0] - boxes[j, 0]) < boxes[i, 3] + boxes[j, 3]
            below = 2 * abs(boxes[i, 1] - boxes[j, 1]) < boxes[i, 2] + boxes[j, 2]
            if aside and below and min(existence[i], existence[j]) >= least:
                found[n, 0], found[n, 1] = i, j
                n += 1
    return found[:n]


@njit(cache=True)
def joint_boxes(boxes: Array, pairs: Ints) -> Array:
    """Returns the boxes (P, 4) round the two boxes of each pair (P, 2) of the boxes (N, 4)."""
    found = np.empty((len(pairs), 4))
    for k in range(len(pairs)):
        for axis in range(2):
            low, high = np.inf, -np.inf
            for i in pairs[k]:
                half = boxes[i, 3 - axis] / 2
                low, high = min(low, boxes[i, axis] - half), max(high, boxes[i, axis] + half)
            found[k, axis], found[k, 3 - axis] = (low + high) / 2, high - low
    return found
