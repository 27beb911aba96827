"""Compiled drawing of plants in the wind on the canvas (image in int16), before people.

`sample_plants` finds where plants can grow, on a coarse grid of pixels. `sway` draws the plants of one frame where the
wind, in px, has moved them. The tests compare the result with a slow implementation.
"""

from __future__ import annotations

import numpy as np

from sim.compiler import njit
from sim.render.canvas import RUN_END, RUN_FIRST, RUN_ROW
from sim.render.canvas_kernels import mark_dirty
from sim.render.texture_kernels import plant_cover, plant_pattern
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
