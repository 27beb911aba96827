"""The height of the ground: z = h(x, y), zero but for stairs."""

from __future__ import annotations

import numpy as np

from sim.types import Array, Scene, Stairs


def height_at(scene: Scene, xy: Array) -> Array:
    """Ground height (...) in m at places (..., 2); nan places stand at 0. Where stairs overlap, the higher."""
    xy = np.asarray(xy, dtype=float)
    z = np.zeros(xy.shape[:-1])
    for stairs in scene.stairs:
        h = _flight(stairs, xy)
        z = np.where(np.abs(h) > np.abs(z), h, z)
    return z


def _flight(stairs: Stairs, xy: Array) -> Array:
    """Height of one flight: each step rises smoothly over its tread, as a walker's body does.

    h = rise/n (k + r - sin(2πr)/2π) with k + r = n s, s the share of the way from foot to head: continuous in value
    and slope, rise/n per step, level at each edge.
    """
    axis = stairs.head - stairs.foot
    length = float(np.hypot(axis[0], axis[1]))
    if length == 0.0:
        return np.zeros(xy.shape[:-1])
    d = xy - stairs.foot
    along = d @ (axis / length)
    across = np.abs(d[..., 1] * axis[0] - d[..., 0] * axis[1]) / length
    n = stairs.steps
    k = np.clip(along / length, 0.0, 1.0) * n
    h = stairs.rise / n * (k - np.sin(2 * np.pi * k) / (2 * np.pi))
    inside = (along > 0) & (along <= length + stairs.landing) & (across <= stairs.width / 2)
    return np.where(inside, h, 0.0)


def flights(scene: Scene) -> Array:
    """Stairs as rows (S, 9): foot x, y, unit axis x, y, length, half width, rise, steps, landing; m."""
    rows = np.zeros((len(scene.stairs), 9))
    for row, stairs in zip(rows, scene.stairs, strict=True):
        axis = stairs.head - stairs.foot
        length = float(np.hypot(*axis))
        row[:] = [*stairs.foot, *(axis / length), length, stairs.width / 2, stairs.rise, stairs.steps, stairs.landing]
    return rows
