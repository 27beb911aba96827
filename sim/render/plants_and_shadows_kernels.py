"""Compiled drawing on the canvas (image in int16) of the empty scene before people: plants in the wind, shadows.

`sample_plants` finds where plants can grow, on a coarse grid of pixels. `sway` draws the plants of one frame where the
wind, in px, has moved them. `draw_shadows` casts the shadows of people; of several on a pixel only the darkest counts.
The tests compare the result with a slow implementation.
"""

from __future__ import annotations

import numpy as np

from sim.compiler import njit
from sim.render.canvas import END_COLUMN, END_ROW, FIRST_COLUMN, FIRST_ROW, RUN_END, RUN_FIRST, RUN_ROW
from sim.render.canvas_kernels import mark_dirty, outline_columns
from sim.render.texture_kernels import plant_cover, plant_pattern
from sim.scene.body import BODY_PART, HEAD_PART, XX, XY, YY
from sim.scene.raycast import GROUND, HIT_KIND, HIT_SLOTS
from sim.scene.raycast_kernels import look


@njit(cache=True)
def sample_plants(rays, scale, step, solids, size, key, pattern, cover):  # type: ignore[no-untyped-def]
    """Sets pattern and cover (J, I) to the plant pattern and its share of a pixel, at every `step`-th pixel.

    Off the ground they are -inf and 0. rays, scale, size, key: as of `paint_pixels`.
    """
    o, d, hit = np.empty(3), np.empty(3), np.empty(HIT_SLOTS)
    for j in range(pattern.shape[0]):
        for i in range(pattern.shape[1]):
            t = look(rays, (i + 0.5) * step, (j + 0.5) * step, solids, o, d, hit)
            pattern[j, i], cover[j, i] = -np.inf, 0.0
            if int(hit[HIT_KIND]) == GROUND:
                slope = abs(d[2]) / np.sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2])
                footprint = (t if scale > 0 else 1.0) / abs(scale) / np.sqrt(max(slope, 0.02))
                x, y = o[0] + t * d[0], o[1] + t * d[1]
                pattern[j, i] = plant_pattern(x, y, size, key)
                cover[j, i] = plant_cover(x, y, size, key, -np.inf, footprint)


@njit(cache=True)
def _interpolate(nodes, x, y, k):  # type: ignore[no-untyped-def]
    """Returns the value of nodes[k] at column x and row y of its grid, bilinear between the nodes."""
    i, j = min(int(x), nodes.shape[2] - 2), min(int(y), nodes.shape[1] - 2)
    a, b = x - i, y - j
    low = nodes[k, j, i] * (1 - a) + nodes[k, j, i + 1] * a
    return low * (1 - b) + (nodes[k, j + 1, i] * (1 - a) + nodes[k, j + 1, i + 1] * a) * b


@njit(cache=True)
def sway(empty, share, runs, nodes, step, canvas, margin):  # type: ignore[no-untyped-def]
    """Draws plants where wind has moved them: colour at pixel p becomes `empty` at p - share(p) * wind(p), bilinear.

    empty (H, W, 3): as `canvas.colour`. share (H, W): of plants. runs (S, 3): pixels with plants. nodes (2, J, I):
    wind, px, at every `step`-th pixel.
    """
    height, width = share.shape
    for s in range(len(runs)):
        v, left, right = runs[s, RUN_ROW], runs[s, RUN_FIRST], runs[s, RUN_END]
        for u in range(left, right):
            column, row = (u + 0.5) / step, (v + 0.5) / step
            x = u - share[v, u] * _interpolate(nodes, column, row, 0)
            y = v - share[v, u] * _interpolate(nodes, column, row, 1)
            x, y = min(max(x, 0.0), width - 1.001), min(max(y, 0.0), height - 1.001)
            i, j = int(x), int(y)
            a, b = np.float32(x - i), np.float32(y - j)
            for k in range(3):
                low = empty[j, i, k] + a * np.float32(empty[j, i + 1, k] - empty[j, i, k])
                high = empty[j + 1, i, k] + a * np.float32(empty[j + 1, i + 1, k] - empty[j + 1, i, k])
                canvas.colour[v, u, k] = np.int16(low + b * (high - low))
        mark_dirty(canvas, v, left, right, margin)


@njit(cache=True)
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


@njit(cache=True)
def draw_shadows(rows, place, direct, level, centre, shadows, sun, canvas, margin):  # type: ignore[no-untyped-def]
    """Darkens the canvas where the people of these rows stand before the sun; of several shadows, the darkest counts.

    place (H, W, 3) m, direct (H, W): of the empty scene. level: True if only level ground is in view. centre (N, 2, 3)
    m: of the ellipsoids. shadows: PeopleShadows of N people.
    """
    width, colour, shaded = direct.shape[1], canvas.colour, canvas.shaded
    outlines, bounds = shadows.outlines, shadows.outlines.bounds
    sx, sy = sun[0] / sun[2], sun[1] / sun[2]
    shade, half = np.empty(width, np.float32), np.float32(0.5)
    for i in rows:
        for v in range(bounds[i, FIRST_ROW], bounds[i, END_ROW]):
            low, high = bounds[i, FIRST_COLUMN], bounds[i, END_COLUMN]
            if level:
                low, high = outline_columns(v, i, BODY_PART, outlines, width)
                first, last = outline_columns(v, i, HEAD_PART, outlines, width)
                if last > first:
                    low, high = (min(low, first), max(high, last)) if high > low else (first, last)
            if high <= low:
                continue
            shade[: high - low] = 0.0
            for e in range(2):
                shape, softness = shadows.shape[i, e], shadows.softness[i, e]
                _shade_line(place[v, low:], high - low, centre[i, e], shape, sx, sy, softness, shade)
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
            mark_dirty(canvas, v, left, right, margin)
