"""Compiled: what is true of a frame's pixels: counts, boxes, who touches whom, and disparities with their validity."""

from __future__ import annotations

import numpy as np
from numba import njit

from sim.geometry.union_find_kernels import find_root
from sim.render.people_shadow_kernels import span
from sim.scene.raycast_kernels import at_pixel, first_hit

SAME = 1e-3  # m: what lies nearer by less is taken for the same point


@njit(cache=True, error_model="numpy")
def tally(ids, boxes, id, row_of, count, edges, blob):  # type: ignore[no-untyped-def]
    """Of each person: visible pixels (N,), edges (N, 4) first column, last + 1, first row, last + 1, blob (N,).

    People one of whose pixels is an 8-neighbour of another's are of one blob; blobs are numbered by their first row.
    """
    height, width = ids.shape
    parent = np.arange(len(id))
    for i in range(len(id)):
        edges[i, 0], edges[i, 1], edges[i, 2], edges[i, 3] = width, 0, height, 0
        for v in range(boxes[i, 0], boxes[i, 1]):
            for u in range(boxes[i, 2], boxes[i, 3]):
                if ids[v, u] != id[i]:
                    continue
                count[i] += 1
                edges[i, 0], edges[i, 1] = min(edges[i, 0], u), max(edges[i, 1], u + 1)
                edges[i, 2], edges[i, 3] = min(edges[i, 2], v), max(edges[i, 3], v + 1)
                for k in range(4):  # right, and the three below: each pair of neighbours once
                    y, x = v + (k > 0), u + (1 if k == 0 else k - 2)
                    if y < height and 0 <= x < width and ids[y, x] > 0 and ids[y, x] != id[i]:
                        a, b = find_root(parent, i), find_root(parent, row_of[ids[y, x]])
                        parent[max(a, b)] = min(a, b)
    number = 0
    for i in range(len(id)):
        blob[i] = -1
    for i in range(len(id)):
        if count[i] > 0:
            r = find_root(parent, i)
            if r == i:
                blob[r] = number
                number += 1
            blob[i] = blob[r]


@njit(cache=True, error_model="numpy")
def known(depth, scale, origin, direction, still, out):  # type: ignore[no-untyped-def]
    """Disparities out (H, W) of the empty scene: scale / depth; nan where the right camera does not see the point.

    origin, direction: rays of the right camera; sky has none.
    """
    height, width = depth.shape
    solid = len(still.walls) + len(still.pillars) + len(still.flights) > 0
    o, d, hit = np.empty(3), np.empty(3), np.empty(6)
    for v in range(height):
        for u in range(width):
            z = depth[v, u]
            x = u + 0.5 - scale / z
            out[v, u] = scale / z if z < np.inf and x >= 0.0 else np.nan
            if solid and out[v, u] == out[v, u]:
                at_pixel(origin, x, v + 0.5, o)
                at_pixel(direction, x, v + 0.5, d)
                if first_hit(o, d, still, hit) < z - SAME:
                    out[v, u] = np.nan


@njit(cache=True, error_model="numpy")
def _covers(x, i, e, start, step, row, z):  # type: ignore[no-untyped-def]
    """Whether the ball of part (i, e) is met before depth z by the ray of (x, y); row: what y adds to each."""
    a = b = c = 0.0
    for k in range(3):
        p, d = start[i, e, k, 0] * x + row[k], step[i, e, k, 0] * x + row[3 + k]
        a += d * d
        b += p * d
        c += p * p
    root = b * b - a * (c - 1.0)
    return root >= 0.0 and (-b - np.sqrt(root)) / a < z - SAME


@njit(cache=True, error_model="numpy")
def disparities(  # type: ignore[no-untyped-def]
    depth,
    ids,
    boxes,
    id,
    scale,
    start,
    step,
    middle,
    inverse,
    near,
    background,
    origin,
    direction,
    still,
    out,
):
    """Make out (H, W), at first those of the empty scene, the disparities of all.

    depth, ids: with people; boxes, id: of people; start … inverse: of their parts as the right camera sees them; near
    (N, 2) m: no point of the part is nearer; background (H, W): depth of the empty scene for the right camera.
    """
    height, width = depth.shape
    solid = len(still.walls) + len(still.pillars) + len(still.flights) > 0
    o, d, hit, row = np.empty(3), np.empty(3), np.empty(6), np.empty(6)
    for i in range(len(id)):
        for v in range(boxes[i, 0], boxes[i, 1]):
            for u in range(boxes[i, 2], boxes[i, 3]):
                if ids[v, u] != id[i]:
                    continue
                z = depth[v, u]
                x = u + 0.5 - scale / z
                out[v, u] = scale / z if x >= 0.0 else np.nan
                if solid and x >= 0.0:
                    j = int(x)
                    if min(background[v, max(j - 1, 0)], background[v, j], background[v, min(j + 1, width - 1)]) < z:
                        at_pixel(origin, x, v + 0.5, o)
                        at_pixel(direction, x, v + 0.5, d)
                        if first_hit(o, d, still, hit) < z - SAME:
                            out[v, u] = np.nan
    for i in range(len(id)):
        for e in range(2):
            mu, mv, most = middle[i, e, 0], middle[i, e, 1], scale / near[i, e]
            a, b, c = inverse[i, e, 0], inverse[i, e, 1], inverse[i, e, 2]
            half = np.sqrt(a / (a * c - b * b))
            if not half >= 0.0:
                continue
            for v in range(max(int(mv - half), 0), min(int(mv + half) + 1, height)):
                x0, x1 = span(v + 0.5 - mv, a, b, c)
                if x0 > x1:
                    continue
                low, high = mu + x0, mu + x1
                for k in range(3):
                    row[k] = start[i, e, k, 1] * (v + 0.5) + start[i, e, k, 2]
                    row[3 + k] = step[i, e, k, 1] * (v + 0.5) + step[i, e, k, 2]
                for u in range(max(int(low), 0), min(int(high + most) + 1, width)):
                    x = u + 0.5 - out[v, u]  # nan is in no span
                    if low <= x <= high and _covers(x, i, e, start, step, row, depth[v, u]):
                        out[v, u] = np.nan
