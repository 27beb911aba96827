"""Kernels of track_management: who hides whom, and which boxes are second boxes of people.

Boxes are centred: centre x, y, height, width, px. The loops over all pairs need no table of the pairs.
"""

from __future__ import annotations

import numpy as np

from sim.types import Array
from tracking.papers.blob.person_template_kernels import kernel

IN_FRONT = 0.15  # m in the image: whose feet are lower by more stands in front
FARTHEST = 9.0  # standard deviations beyond which a density is taken as 0: it is below 1e-17


@kernel
def covered_share(box: Array, other: Array) -> float:
    """Returns the share, 0 to 1, of a box (4,) that lies in another box (4,)."""
    shared = 1.0
    for centre, side in ((0, 3), (1, 2)):
        low = max(box[centre] - box[side] / 2, other[centre] - other[side] / 2)
        high = min(box[centre] + box[side] / 2, other[centre] + other[side] / 2)
        shared *= max(high - low, 0.0)
    return float(shared / max(box[2] * box[3], 1e-9))


@kernel
def covered_shares(boxes: Array, others: Array) -> Array:
    """Returns the share (N, M), 0 to 1, of each of the boxes (N, 4) that lies in each of the others (M, 4)."""
    share = np.empty((len(boxes), len(others)))
    for i in range(len(boxes)):
        for j in range(len(others)):
            share[i, j] = covered_share(boxes[i], others[j])
    return share


@kernel
def hidden_shares(boxes: Array, scale: Array, existence: Array) -> Array:
    """Returns the largest share (N,) of each of the boxes (N, 4) that one person in front covers, times the existence
    probability (N,) of that person; scale (N,): px per m."""
    hidden = np.zeros(len(boxes))
    for i in range(len(boxes)):
        for j in range(len(boxes)):
            if boxes[j, 1] + boxes[j, 2] / 2 - (boxes[i, 1] + boxes[i, 2] / 2) > IN_FRONT * scale[i]:
                hidden[i] = max(hidden[i], covered_share(boxes[i], boxes[j]) * existence[j])
    return hidden


@kernel
def add_nearness(total: Array, boxes: Array, owners: Array, spread: Array, weight: Array, earlier: bool) -> None:
    """Adds to `total` (M,), in place, the sum over the owners (N, 4) of weight (N,) times exp(-d^2 / 2).

    d: distance of each of the boxes (M, 4) from the owner, in its standard deviation spread (N,), px. earlier: only of
    owners with a smaller index than the box.
    """
    for j in range(len(owners)):
        if weight[j] > 0:
            for i in range(j + 1 if earlier else 0, len(boxes)):
                if abs(boxes[i, 0] - owners[j, 0]) < FARTHEST * spread[j]:
                    d2 = 0.0
                    for axis in range(4):
                        d2 += ((boxes[i, axis] - owners[j, axis]) / spread[j]) ** 2
                    total[i] += weight[j] * np.exp(-0.5 * d2)
