"""Compiled helpers for drawing on a canvas, the working image of a frame.

They find the pixels of an image row that an elliptic outline covers, mark tiles (8 rows x 16 columns of px) that
drawing has changed as dirty, and restore dirty tiles to the empty scene.
"""

from __future__ import annotations

import numpy as np

from sim.compiler import njit
from sim.render.canvas import TILE_H, TILE_W
from sim.scene.body import XX, XY, YY


@njit(cache=True)
def ellipse_row(y, a, b, d):  # type: ignore[no-untyped-def]
    """Returns the ends x0 <= x1 of row y of the ellipse a x² + 2 b x y + d y² <= 1; (1, -1) if it is missed."""
    root = b * b * y * y - a * (d * y * y - 1.0)
    if not (root >= 0.0 and a > 0.0):
        return 1.0, -1.0
    root = np.sqrt(root)
    return (-b * y - root) / a, (-b * y + root) / a


@njit(cache=True)
def outline_columns(v, i, e, outlines, width):  # type: ignore[no-untyped-def]
    """Returns the first column and the last + 1 of row v in the outline of part e of person i; equal if none."""
    middle, inverse = outlines.middle, outlines.inverse
    x0, x1 = ellipse_row(v + 0.5 - middle[i, e, 1], inverse[i, e, XX], inverse[i, e, XY], inverse[i, e, YY])
    if x0 > x1:
        return 0, 0
    low = int(max(np.ceil(middle[i, e, 0] + x0 - 0.5), 0.0))
    return low, max(int(min(np.floor(middle[i, e, 0] + x1 + 0.5), float(width))), low)


@njit(cache=True)
def mark_dirty(canvas, v, left, right, margin):  # type: ignore[no-untyped-def]
    """Marks the tiles of columns left … right - 1 of row v, and of pixels at most `margin` px away."""
    height, width = canvas.depth.shape
    if right > left:
        first, last = max(left - margin, 0) // TILE_W, (min(right + margin, width) - 1) // TILE_W
        for r in range(max(v - margin, 0) // TILE_H, min(v + margin, height - 1) // TILE_H + 1):
            for c in range(first, last + 1):
                canvas.dirty[r, c] = 1


@njit(cache=True)
def _copy(line, many, out):  # type: ignore[no-untyped-def]
    for i in range(many):
        out[i] = line[i]


@njit(cache=True)
def restore(dirty, empty_colour, empty_depth, colour, depth, shaded):  # type: ignore[no-untyped-def]
    """Restores the dirty tiles of a canvas to the empty scene, and marks all tiles clean."""
    height, width = depth.shape
    for j in range(dirty.shape[0]):
        last = 0
        while last < dirty.shape[1]:  # runs of dirty tiles
            first = last
            while last < dirty.shape[1] and dirty[j, last]:
                dirty[j, last] = 0
                last += 1
            left, many = first * TILE_W, min(last * TILE_W, width) - first * TILE_W
            last += last == first
            for v in range(j * TILE_H, min((j + 1) * TILE_H, height)):
                _copy(empty_colour[v, 3 * left :], 3 * many, colour[v, 3 * left :])
                _copy(empty_depth[v, left:], many, depth[v, left:])
                shaded[v, left : left + many] = 0
