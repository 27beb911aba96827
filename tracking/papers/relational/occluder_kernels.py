"""Kernel of tracking.papers.relational.occluders: who is hidden behind whom."""

from __future__ import annotations

import math

from sim.compiler import njit
from sim.types import Array


@njit(cache=True)
def cover(
    pos: Array, weights: Array, mean: Array, exist: Array, eye: Array, body: Array, hidden: Array, cut: Array
) -> None:
    """Writes the probabilities (K,) that each person is hidden behind another one, and that the feet are.

    pos (P, K, 2), m; weights (P, K): of the particles, sum 1 for each person; mean (K, 2): of the places, m; exist
    (K,): probability that each person exists; eye (3,): the camera, m. body (3,): height and half the width, m; a
    person is hidden if a smaller share of the body than the third number is visible.

    Another person at the mean place covers the share 1 - d / (2 radius) of the body's width, d being the distance to
    the line of sight, and the body's height up to where the line of sight over the other's head meets it.
    """
    particles, n, _ = pos.shape
    height, radius, least = body[0], body[1], body[2]
    for k in range(n):
        for other in range(n):
            to_x, to_y = mean[other, 0] - eye[0], mean[other, 1] - eye[1]
            own_x, own_y = mean[k, 0] - eye[0], mean[k, 1] - eye[1]
            own2 = own_x * own_x + own_y * own_y
            if other == k or own2 == 0.0 or to_x * own_x + to_y * own_y > own2:
                continue
            low, behind = 0.0, 0.0
            for p in range(particles):
                x, y = pos[p, k, 0] - eye[0], pos[p, k, 1] - eye[1]
                square = x * x + y * y
                if square == 0.0:
                    continue
                along = (x * to_x + y * to_y) / square
                if along <= 0.0 or along >= 1.0:
                    continue
                side = abs(x * to_y - y * to_x) / math.sqrt(square)
                top = eye[2] - (eye[2] - height) / along
                if side >= 2.0 * radius or top <= 0.0:
                    continue
                share = 1.0 - side / (2.0 * radius)
                low += weights[p, k] * share
                if 1.0 - share * min(top / height, 1.0) < least:
                    behind += weights[p, k]
            cut[k] = max(cut[k], exist[other] * low)
            hidden[k] = max(hidden[k], exist[other] * behind)
