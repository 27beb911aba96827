"""Compiled counts over an id map (H, W), which holds the id of the person that each pixel shows.

They give each person's number of visible pixels, the box round these pixels, and which people touch in the image.
"""

from __future__ import annotations

import numpy as np

from sim.compiler import njit
from sim.geometry.union_find_kernels import find_root
from sim.render.canvas import END_COLUMN, END_ROW, FIRST_COLUMN, FIRST_ROW

LEFT, RIGHT, TOP, BOTTOM = range(4)  # columns of `edges`


@njit(cache=True, error_model="numpy")
def count_pixels(ids, bounds, id, row_of, count, edges, blob):  # type: ignore[no-untyped-def]
    """Counts the visible pixels of N people in an id map (H, W), and finds who touch in the image.

    bounds (N, 4): outside which nobody is visible. row_of: row of each id. count (N,), 0 on entry: visible pixels.
    edges (N, 4): columns LEFT …. blob (N,): number of the connected region, by its first person's row; -1 if nothing is
    visible.
    """
    height, width = ids.shape
    parent = np.arange(len(id))
    for i in range(len(id)):
        edges[i, LEFT], edges[i, RIGHT], edges[i, TOP], edges[i, BOTTOM] = width, 0, height, 0
        for v in range(bounds[i, FIRST_ROW], bounds[i, END_ROW]):
            for u in range(bounds[i, FIRST_COLUMN], bounds[i, END_COLUMN]):
                if ids[v, u] != id[i]:
                    continue
                count[i] += 1
                edges[i, LEFT], edges[i, RIGHT] = min(edges[i, LEFT], u), max(edges[i, RIGHT], u + 1)
                edges[i, TOP], edges[i, BOTTOM] = min(edges[i, TOP], v), max(edges[i, BOTTOM], v + 1)
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
