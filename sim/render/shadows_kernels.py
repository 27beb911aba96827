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
    """Raise shade (many,) to 255 times the share of the sun that one body part takes at places (many, 3) x, y, z in m.

    A value that is higher already is kept. The direction to the sun is (sx, sy, 1). centre (3,) m: of the ellipsoid.
    shape (3,): inverse shape of its shadow, entries 11, 12, 22, 1/m². softness: half the penumbra over the geometric
    mean of the shadow's half axes; 0 gives a sharp edge. Places at or above the height of the centre stay unshaded.
    Returns nothing.
    """
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
    """Darken colour (H, W, 3) int16 where N people stand before the sun; of several shadows, the darkest counts.

    place (H, W, 3) m and direct (H, W), the sun's share of the light: of the empty scene. bounds (N, 4) (first row,
    last row + 1, first column, last column + 1): pixels on which each person's shadow can fall. flat: True if only
    level ground is in view. Then the shadow of part e (0 body, 1 head) has the outline middle (N, 2, 2) px, inverse (N,
    2, 3) 1/px²; else these are not used. centre (N, 2, 3) m: of the ellipsoids. shape (N, 2, 3): inverse shapes of the
    shadows, entries 11, 12, 22, 1/m². softness (N, 2): half the penumbra over the geometric mean of the shadow's half
    axes. sun (3,): vector to the sun, above the horizon. shaded (H, W) uint8: on entry 0, on return 255 times the share
    of the sun that is gone. Tiles (8 rows x 16 columns of px) with changes, or at most `margin` px away, are set to 1
    in dirty. Returns nothing.
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
