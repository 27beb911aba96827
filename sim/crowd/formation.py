"""Where the members of a group walk and stand relative to its middle.

Walking: pairs abreast, triads in a V whose middle member is slightly behind, larger groups made of rows of pairs and
triads (Zanlungo & Kanda 2013). Standing: a circle, facing inwards. Offsets are (forward, left) in metres, mean zero.
"""

from __future__ import annotations

import numpy as np

from sim.types import Array, Ints

V_DEPTH = 0.3  # how far the middle of a triad falls behind, in neighbour distances
ROW_GAP = 1.15  # distance of rows, in neighbour distances: feet need a little more room ahead than aside


def rows_of(n: int) -> list[int]:
    """Sizes of the rows of a group of n: pairs and triads only (1 alone), triads in front."""
    if n <= 3:
        return [n]
    triads = {0: n // 3, 1: (n - 4) // 3, 2: (n - 2) // 3}[n % 3]
    return [3] * triads + [2] * ((n - 3 * triads) // 2)


def walking(n: int, spacing: float) -> Array:
    """(n, 2) offsets of a walking group of n; neighbours in a row are `spacing` apart."""
    rows = []
    for k, size in enumerate(rows_of(n)):
        left = (np.arange(size)[::-1] - (size - 1) / 2) * spacing
        ahead = np.full(size, -k * ROW_GAP * spacing)
        if size == 3:
            ahead[1] -= V_DEPTH * spacing
            left *= np.sqrt(1 - V_DEPTH**2)
        rows.append(np.stack([ahead, left], axis=1))
    offsets = np.concatenate(rows)
    return np.asarray(offsets - offsets.mean(axis=0))


def standing(n: int, spacing: float) -> Array:
    """(n, 2) offsets of a group in conversation: a circle with neighbours `spacing` apart."""
    if n == 1:
        return np.zeros((1, 2))
    angle = 2 * np.pi * (np.arange(n) + 0.5) / n
    radius = spacing / (2 * np.sin(np.pi / n))
    return np.asarray(radius * np.stack([np.cos(angle), np.sin(angle)], axis=1))


def place(offsets: Array, middle: Array, heading: Array) -> Array:
    """Offsets (n, 2) as points in the world, `heading` (2,) being a unit vector."""
    left = np.array([-heading[1], heading[0]])
    return np.asarray(middle + offsets[:, :1] * heading + offsets[:, 1:] * left)


def assign(pos: Array, slots: Array) -> Ints:
    """Which slot each person takes: the assignment with the least sum of squared ways; both (n, 2)."""
    from scipy.optimize import linear_sum_assignment

    cost = np.sum((pos[:, None] - slots[None]) ** 2, axis=2)
    return np.asarray(linear_sum_assignment(cost)[1], dtype=np.int64)
