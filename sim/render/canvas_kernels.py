"""Compiled helpers for drawing on a canvas, the working image of a frame.

They find the pixels of an image row that an elliptic outline covers, mark tiles (8 rows x 16 columns of px) that
drawing has changed as dirty, and restore dirty tiles to the empty scene.
"""

from __future__ import annotations

import numpy as np

from sim.compiler import njit
from sim.render.canvas import TILE_H, TILE_W
from sim.scene.body import XX, XY, YY


@njit(cache=True, error_model="numpy")
def ellipse_row(y, a, b, d):  # type: ignore[no-untyped-def]
    """Return the ends x0 <= x1 of row y of the ellipse a x² + 2 b x y + d y² <= 1, measured from its centre.

    The result is (1, -1), x0 > x1, if the row misses the ellipse, if a is not above 0, or for nan.
    """
    root = b * b * y * y - a * (d * y * y - 1.0)
    if not (root >= 0.0 and a > 0.0):
        return 1.0, -1.0
    root = np.sqrt(root)
    return (-b * y - root) / a, (-b * y + root) / a


@njit(cache=True, error_model="numpy")
def outline_columns(v, i, e, middle, inverse, width):  # type: ignore[no-untyped-def]
    """Return the first column and the last column + 1 of image row v whose pixel centres lie in an outline and in the
    image.

    The outline is the ellipse of part e (0 body, 1 head) of person i (row from 0). middle (N, 2, 2): centres u, v in
    px. inverse (N, 2, 3): entries 11, 12, 22 of the inverse shape matrices, 1/px². width: of the image, px. The two
    numbers are equal if there are no such pixels, or for nan.
    """
    x0, x1 = ellipse_row(v + 0.5 - middle[i, e, 1], inverse[i, e, XX], inverse[i, e, XY], inverse[i, e, YY])
    if x0 > x1:
        return 0, 0
    low = int(max(np.ceil(middle[i, e, 0] + x0 - 0.5), 0.0))
    return low, max(int(min(np.floor(middle[i, e, 0] + x1 + 0.5), float(width))), low)


@njit(cache=True)
def mark_dirty(dirty, v, left, right, margin, height, width):  # type: ignore[no-untyped-def]
    """Set to 1 the tiles of `dirty` that hold columns left … right - 1 of row v, or pixels at most `margin` px away
    from them.

    dirty (rows, columns): one number per tile of 8 rows x 16 columns of px. height, width: of the image, px. Nothing is
    marked if right <= left. Returns nothing.
    """
    if right > left:
        first, last = max(left - margin, 0) // TILE_W, (min(right + margin, width) - 1) // TILE_W
        for r in range(max(v - margin, 0) // TILE_H, min(v + margin, height - 1) // TILE_H + 1):
            for c in range(first, last + 1):
                dirty[r, c] = 1


@njit(cache=True)
def _copy(line, many, out):  # type: ignore[no-untyped-def]
    for i in range(many):
        out[i] = line[i]


@njit(cache=True)
def restore(dirty, empty_colour, empty_depth, colour, depth, shaded):  # type: ignore[no-untyped-def]
    """Restore the dirty tiles of a canvas to the empty scene, set `shaded` to 0 there, and mark all tiles clean, in
    place.

    dirty (rows, columns): 1 for tiles (8 rows x 16 columns of px) that changed. empty_colour, colour (H, W * 3).
    empty_depth, depth, shaded (H, W). Clean tiles are not touched. Returns nothing.
    """
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
