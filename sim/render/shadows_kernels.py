"""Compiled drawing of people's shadows on the canvas (image in int16) of the empty scene.

Of several shadows on a pixel only the darkest counts. The tests compare the result with a slow implementation.
"""

from __future__ import annotations

import numpy as np

from sim.compiler import njit
from sim.render.canvas import END_COLUMN, END_ROW, FIRST_COLUMN, FIRST_ROW
from sim.render.canvas_kernels import mark_dirty, outline_columns
from sim.scene.body import BODY_PART, HEAD_PART, XX, XY, YY


@njit(cache=True, error_model="numpy")
def _shade_line(place, many, centre, shape, sx, sy, softness, shade):  # type: ignore[no-untyped-def]
    """Raises shade (many,) to 255 times the share of the sun that one body part takes at places (many, 3) m."""
    f = np.float32
    x, y, z, a, b, c = f(centre[0]), f(centre[1]), f(centre[2]), f(shape[XX]), f(2 * shape[XY]), f(shape[YY])
    slope_x, slope_y, zero, one, most = f(sx), f(sy), f(0.0), f(1.0), f(255.0)
    edge, per = f(1.0 + softness), f(1.0 / max(2 * softness, 1e-6))
    for k in range(many):
        above = z - place[k, 2]
        dx, dy = place[k, 0] - x + slope_x * above, place[k, 1] - y + slope_y * above
        q = dx * dx * a + dx * dy * b + dy * dy * c
        share = (edge - np.sqrt(max(q, zero))) * per
        share = share if above > zero else zero
        dark = most * min(max(share, zero), one)
        shade[k] = max(shade[k], dark)


@njit(cache=True, error_model="numpy")
def draw_shadows(  # type: ignore[no-untyped-def]
    place, direct, bounds, flat, middle, inverse, centre, shape, sun, softness, shaded, colour, dirty, margin
):
    """Darkens colour (H, W, 3) where N people stand before the sun; of several shadows, the darkest counts.

    place (H, W, 3) m, direct (H, W): of the empty scene. bounds (N, 4), middle (N, 2, 2) px, inverse (N, 2, 3), shape
    (N, 2, 3), softness (N, 2): of PeopleShadows. flat: True if only level ground is in view. centre (N, 2, 3) m: of the
    ellipsoids. shaded (H, W): on return 255 times the share of the sun that is gone.
    """
    height, width = direct.shape
    sx, sy = sun[0] / sun[2], sun[1] / sun[2]
    shade, half = np.empty(width, np.float32), np.float32(0.5)
    for i in range(len(bounds)):
        for v in range(bounds[i, FIRST_ROW], bounds[i, END_ROW]):
            low, high = bounds[i, FIRST_COLUMN], bounds[i, END_COLUMN]
            if flat:
                low, high = outline_columns(v, i, BODY_PART, middle, inverse, width)
                first, last = outline_columns(v, i, HEAD_PART, middle, inverse, width)
                if last > first:
                    low, high = (min(low, first), max(high, last)) if high > low else (first, last)
            if high <= low:
                continue
            shade[: high - low] = 0.0
            for e in range(2):
                _shade_line(place[v, low:], high - low, centre[i, e], shape[i, e], sx, sy, softness[i, e], shade)
            left, right = width, 0
            for u in range(low, high):
                new, old = int(shade[u - low] + half), int(shaded[v, u])
                if new > old:
                    left, right = min(left, u), u + 1
                    shaded[v, u] = new
                    part = direct[v, u] * np.float32(1.0 / 255.0)
                    factor = (np.float32(1.0) - part * np.float32(new)) / (np.float32(1.0) - part * np.float32(old))
                    for k in range(3):
                        colour[v, u, k] = np.int16(np.int32(np.float32(colour[v, u, k]) * factor))
            mark_dirty(dirty, v, left, right, margin, height, width)
