"""Compiled light and air between the camera and what it sees: pools of lamps, fog, streaks of rain.

The empty scene is painted with lamps and fog. `add_air` gives both to the people of a frame, each pixel at its own
place. A lamp at height h lights a place at distance r from its foot by h³ / (h² + r²)^(3/2) (cosine and inverse square
law), which is 1 below it.
"""

from __future__ import annotations

import numpy as np

from sim.compiler import njit
from sim.render.canvas import MOST, TILE_H, TILE_W, UNIT
from sim.render.canvas_kernels import mark_dirty
from sim.scene.raycast_kernels import at_pixel

X, Y, HEIGHT = range(3)  # columns of Style.lamps


@njit(cache=True)
def lamp_light(x, y, style):  # type: ignore[no-untyped-def]
    """Returns the factor of brightness at (x, y) m: 1 without lamps."""
    if len(style.lamps) == 0:
        return 1.0
    total = 0.0
    for k in range(len(style.lamps)):
        dx, dy, h = x - style.lamps[k, X], y - style.lamps[k, Y], style.lamps[k, HEIGHT]
        near = h * h / (h * h + dx * dx + dy * dy)
        total += near * np.sqrt(near)
    return 1.0 - style.lamp_share + style.lamp_share * min(total, 1.5)


@njit(cache=True)
def night(style):  # type: ignore[no-untyped-def]
    """Returns the factor of brightness of what no lamp lights, as the sky and the fog."""
    return 1.0 - style.lamp_share if len(style.lamps) else 1.0


@njit(cache=True)
def add_air(canvas, empty_depth, rays, style, fog_colour):  # type: ignore[no-untyped-def]
    """Lights by lamps, and fogs, the pixels of a canvas that people cover. empty_depth (H, W) m. fog_colour (3,)."""
    height, width = empty_depth.shape
    o, d = np.empty(3), np.empty(3)
    for v in range(height):
        for u in range(width):
            t = canvas.depth[v, u]
            if not canvas.dirty[v // TILE_H, u // TILE_W] or t >= empty_depth[v, u]:
                continue
            at_pixel(rays.origin, u + 0.5, v + 0.5, o)
            at_pixel(rays.direction, u + 0.5, v + 0.5, d)
            kept = np.exp(-style.fog * t)
            light, veil = kept * lamp_light(o[0] + t * d[0], o[1] + t * d[1], style), (1.0 - kept) * night(style) * UNIT
            for k in range(3):
                canvas.colour[v, u, k] = np.int16(min(canvas.colour[v, u, k] * light + veil * fog_colour[k], MOST))


SHARE, LENGTH, SLANT, LEFT, TOP = range(5)  # columns of `drops`


@njit(cache=True)
def draw_rain(drops, colour, canvas, margin):  # type: ignore[no-untyped-def]
    """Draws streaks of rain. drops (N, 5): share of `colour` (3,), length px, px to the right per row, first place."""
    height, width = canvas.depth.shape
    for n in range(len(drops)):
        top, many = int(drops[n, TOP] * height), int(drops[n, LENGTH])
        for v in range(max(top, 0), min(top + many, height)):
            u = int(drops[n, LEFT] * width + drops[n, SLANT] * (v - top))
            if 0 <= u < width:
                share = np.float32(drops[n, SHARE])
                for k in range(3):
                    old = np.float32(canvas.colour[v, u, k])
                    canvas.colour[v, u, k] = np.int16(old + share * (np.float32(colour[k] * UNIT) - old))
                mark_dirty(canvas, v, u, u + 1, margin)
