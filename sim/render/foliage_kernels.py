"""Compiled: where plants grow in an image, and their sway from moment to moment."""

from __future__ import annotations

import numpy as np
from numba import njit

from sim.render.people_shadow_kernels import touch
from sim.render.texture_kernels import overgrown, wild
from sim.scene.raycast import GROUND
from sim.scene.raycast_kernels import at_pixel, first_hit


@njit(cache=True)
def survey(rays, focal, every, still, size, key, pattern, share):  # type: ignore[no-untyped-def]
    """Of every `every`-th pixel: the pattern of plants (sim.render.texture_kernels.wild) on level ground, -inf
    elsewhere, and
    the share of it that plants would cover if they grew everywhere: 0 where leaves are too far away to show."""
    o, d, hit = np.empty(3), np.empty(3), np.empty(6)
    for j in range(pattern.shape[0]):
        for i in range(pattern.shape[1]):
            at_pixel(rays[0], (i + 0.5) * every, (j + 0.5) * every, o)
            at_pixel(rays[1], (i + 0.5) * every, (j + 0.5) * every, d)
            t = first_hit(o, d, still, hit)
            pattern[j, i], share[j, i] = -np.inf, 0.0
            if int(hit[0]) == GROUND:
                slope = abs(d[2]) / np.sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2])
                footprint = (t if focal > 0 else 1.0) / abs(focal) / np.sqrt(max(slope, 0.02))
                x, y = o[0] + t * d[0], o[1] + t * d[1]
                pattern[j, i] = wild(x, y, size, key)
                share[j, i] = overgrown(x, y, size, key, -np.inf, footprint)


@njit(cache=True)
def _between(nodes, x, y, k):  # type: ignore[no-untyped-def]
    """nodes (K, J, I), of which k is asked for, at column x and row y of its grid, linearly."""
    i, j = min(int(x), nodes.shape[2] - 2), min(int(y), nodes.shape[1] - 2)
    a, b = x - i, y - j
    low = nodes[k, j, i] * (1 - a) + nodes[k, j, i + 1] * a
    return low * (1 - b) + (nodes[k, j + 1, i] * (1 - a) + nodes[k, j + 1, i + 1] * a) * b


@njit(cache=True)
def sway(plate, share, spans, nodes, step, canvas, dirty, margin):  # type: ignore[no-untyped-def]
    """Show plants where wind has moved them: canvas (H, W, 3) at p is the plate at p - share(p) * wind(p).

    share (H, W): of each pixel that moves; spans (S, 3): row, first column, last + 1 of what moves; nodes (2, J, I):
    the wind, px across and down, at every `step`-th pixel; dirty: tiles touched, with a margin.
    """
    height, width = share.shape
    for s in range(len(spans)):
        v, left, right = spans[s, 0], spans[s, 1], spans[s, 2]
        for u in range(left, right):
            column, row = (u + 0.5) / step, (v + 0.5) / step
            x = u - share[v, u] * _between(nodes, column, row, 0)
            y = v - share[v, u] * _between(nodes, column, row, 1)
            x, y = min(max(x, 0.0), width - 1.001), min(max(y, 0.0), height - 1.001)
            i, j = int(x), int(y)
            a, b = np.float32(x - i), np.float32(y - j)
            for k in range(3):
                low = plate[j, i, k] + a * np.float32(plate[j, i + 1, k] - plate[j, i, k])
                high = plate[j + 1, i, k] + a * np.float32(plate[j + 1, i + 1, k] - plate[j + 1, i, k])
                canvas[v, u, k] = np.int16(low + b * (high - low))
        touch(dirty, v, left, right, margin, height, width)
