"""Walls as segments: how far points are from them, what they cross, and how far it is round them."""

from __future__ import annotations

import numpy as np

from sim.elementary import dot, length
from sim.types import Array, Bools


def wall_distances(point: Array, wall: Array) -> Array:
    """Returns the distances (...) m of points (..., 2) m from walls with the two ends `wall` (..., 2, 2) m."""
    along, off = wall[..., 1, :] - wall[..., 0, :], point - wall[..., 0, :]
    s = np.clip(dot(off, along) / np.maximum(dot(along, along), 1e-12), 0, 1)
    return length(off - s[..., None] * along)


def blocked(a: Array, b: Array, walls: Array) -> Bools:
    """Returns flags (...): True where the segment from a to b, (..., 2) m, crosses one of the walls (W, 2, 2) m.

    A segment that only touches a wall, or whose end lies on the wall, does not cross it.
    """
    if not len(walls):
        return np.zeros(a.shape[:-1], dtype=np.bool_)
    p, q = walls[:, 0], walls[:, 1]

    def side(o: Array, u: Array, v: Array) -> Array:
        return np.asarray(
            (u[..., 0] - o[..., 0]) * (v[..., 1] - o[..., 1]) - (u[..., 1] - o[..., 1]) * (v[..., 0] - o[..., 0])
        )

    a, b = a[..., None, :], b[..., None, :]
    crosses = (side(a, b, p) * side(a, b, q) < 0) & (side(p, q, a) * side(p, q, b) < 0)
    return np.asarray(crosses.any(axis=-1))


def distances_round(a: Array, b: Array, walls: Array) -> Array:
    """Returns the distances (...) m that people walk from a to b, (..., 2) m, round the walls (W, 2, 2) m between them.

    Each wall is walked round alone, so that behind several walls the way may be longer.
    """
    straight = length(b - a)
    if not len(walls):
        return straight
    ends = walls.reshape(-1, 2)
    round_ends = length(a[..., None, :] - ends) + length(b[..., None, :] - ends)
    longer = round_ends.reshape(*straight.shape, len(walls), 2).min(axis=-1)
    between = np.stack([blocked(a, b, wall[None]) for wall in walls], axis=-1)
    return np.asarray(np.maximum(straight, np.where(between, longer, 0.0).max(axis=-1)))
