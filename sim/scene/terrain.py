"""Stairs as ground: the height z = h(x, y), m, which is 0 except on stairs and the landings behind them, and the rows
of numbers by which kernels know the stairs."""

from __future__ import annotations

import numpy as np

from sim.elementary import dot, sin
from sim.elementary import length as length_of
from sim.types import Array, Scene, Stairs

FOOT_X, FOOT_Y, AXIS_X, AXIS_Y, LENGTH, HALF_WIDTH, RISE, STEPS, LANDING = range(9)  # columns of `flight_rows`


def height_at(scene: Scene, xy: Array) -> Array:
    """Returns the ground's height in m at points xy (..., 2): 0 off the stairs, and where xy is nan."""
    xy = np.asarray(xy, dtype=float)
    z = np.zeros(xy.shape[:-1])
    for stairs in scene.stairs:
        h = _flight_height(stairs, xy)
        # Where two flights overlap, the height further from 0 counts.
        z = np.where(np.abs(h) > np.abs(z), h, z)
    return z


def _flight_height(stairs: Stairs, xy: Array) -> Array:
    """Returns the height of one flight of stairs at points xy (..., 2), 0 off it.

    Each step rises smoothly over its tread, as a walker's body does: h = rise/n (k + r - sin(2πr)/2π) with k + r = n s,
    where s is the share of the way from foot to head and n the number of steps.
    """
    axis = stairs.head - stairs.foot
    length = float(length_of(axis))
    d = xy - stairs.foot
    along = dot(d, axis / length)
    across = np.abs(d[..., 1] * axis[0] - d[..., 0] * axis[1]) / length
    n = stairs.steps
    k = np.clip(along / length, 0.0, 1.0) * n
    h = stairs.rise / n * (k - sin(2 * np.pi * k) / (2 * np.pi))
    inside = (along > 0) & (along <= length + stairs.landing) & (across <= stairs.width / 2)
    return np.where(inside, h, 0.0)


def flight_rows(scene: Scene) -> Array:
    """Returns the stairs of a scene as rows (S, 9) for the ray casting, m; columns FOOT_X …."""
    rows = np.zeros((len(scene.stairs), 9))
    for row, stairs in zip(rows, scene.stairs, strict=True):
        axis = stairs.head - stairs.foot
        length = float(length_of(axis))
        row[:] = [*stairs.foot, *(axis / length), length, stairs.width / 2, stairs.rise, stairs.steps, stairs.landing]
    return rows
