"""Compiled disparities of a stereo pair, u_left - u_right in px at the left image's pixels, and counts over an id map.

First the disparities of the empty scene, then those of people; nan where the right camera does not see the point, as it
is hidden or outside the right image, and for sky. The counts over an id map (H, W), which holds the id of the person
that each pixel shows: each person's visible pixels, the box round them, and which people touch in the image.
"""

from __future__ import annotations

import numpy as np

from sim.compiler import njit
from sim.elementary_kernels import find_root
from sim.render.canvas import END_COLUMN, END_ROW, FIRST_COLUMN, FIRST_ROW
from sim.render.canvas_kernels import ellipse_row
from sim.scene.body import XX, XY, YY
from sim.scene.raycast import HIT_SLOTS
from sim.scene.raycast_kernels import has_solids, look

SAME = 1e-3  # m: a point in front by less than this counts as the same point


@njit(cache=True)
def empty_scene_disparities(depth, scale, rays, solids, out):  # type: ignore[no-untyped-def]
    """Sets out (H, W) to the disparities scale / depth of the empty scene, at the left camera's pixels.

    depth (H, W) m: of the left view. scale: px m. rays: PixelRays of the right camera.
    """
    o, d, hit, solid = np.empty(3), np.empty(3), np.empty(HIT_SLOTS), has_solids(solids)
    for v in range(depth.shape[0]):
        for u in range(depth.shape[1]):
            z = depth[v, u]
            x = u + 0.5 - scale / z
            seen = z < np.inf and x >= 0.0
            if seen and solid:
                seen = look(rays, x, v + 0.5, solids, o, d, hit) >= z - SAME
            out[v, u] = scale / z if seen else np.nan


@njit(cache=True)
def _depths_of_part(left, disparity, many, start, step, row, t):  # type: ignore[no-untyped-def]
    """Sets t (many,) to the depths m at which the right camera sees a part at the left camera's columns from `left` on;
    inf for a miss. start, step (3, 3): of the part. row (6,): their sums over v and 1."""
    px, py, pz, dx, dy, dz = start[0, 0], start[1, 0], start[2, 0], step[0, 0], step[1, 0], step[2, 0]
    px0, py0, pz0, dx0, dy0, dz0 = row[0], row[1], row[2], row[3], row[4], row[5]
    for k in range(many):
        x = left + k + 0.5 - disparity[k]
        p0, p1, p2 = px * x + px0, py * x + py0, pz * x + pz0
        d0, d1, d2 = dx * x + dx0, dy * x + dy0, dz * x + dz0
        a, b = d0 * d0 + d1 * d1 + d2 * d2, p0 * d0 + p1 * d1 + p2 * d2
        root = b * b - a * (p0 * p0 + p1 * p1 + p2 * p2 - 1.0)
        t[k] = (-b - np.sqrt(root)) / a if root >= 0.0 else np.inf


@njit(cache=True)
def set_people(rows, depth, ids, seen, scale, right_depth, rays, solids, out):  # type: ignore[no-untyped-def]
    """Sets out (H, W) to the disparity at the pixels of people; nan where the empty scene hides the point on the right.

    depth (H, W) m, ids (H, W): of the left image, with people. seen: PeopleInView of the left camera. scale: px m.
    right_depth (H, W) m, rays, solids: of the empty scene in the right camera.
    """
    width, bounds, id = depth.shape[1], seen.outlines.bounds, seen.id
    o, d, hit, solid = np.empty(3), np.empty(3), np.empty(HIT_SLOTS), has_solids(solids)
    thin = len(solids.boxes) > 0  # a box may lie between the middles of pixels
    for i in rows:
        for v in range(bounds[i, FIRST_ROW], bounds[i, END_ROW]):
            for u in range(bounds[i, FIRST_COLUMN], bounds[i, END_COLUMN]):
                if ids[v, u] == id[i]:
                    z = depth[v, u]
                    j = max(int(u + 0.5 - scale / z), 0)
                    near = min(right_depth[v, max(j - 1, 0)], right_depth[v, j], right_depth[v, min(j + 1, width - 1)])
                    x = u + 0.5 - scale / z
                    out[v, u] = scale / z if x >= 0.0 else np.nan
                    if (
                        solid
                        and (thin or near < z)
                        and x >= 0.0
                        and look(rays, x, v + 0.5, solids, o, d, hit) < z - SAME
                    ):
                        out[v, u] = np.nan


@njit(cache=True)
def hide_behind_people(rows, depth, scale, other, out):  # type: ignore[no-untyped-def]
    """Sets out (H, W), disparities, to nan where the people of these rows hide the point from the right camera.

    depth (H, W) m: of the left image, with people. scale: px m. other: PeopleInView of the right camera.
    """
    height, width = depth.shape
    row, t = np.empty(6), np.empty(width)
    middle, inverse, start, step = other.outlines.middle, other.outlines.inverse, other.start, other.step
    for i in rows:
        if other.outlines.bounds[i, END_ROW] == other.outlines.bounds[i, FIRST_ROW]:  # also who is not wholly in front
            continue
        for e in range(middle.shape[1]):
            mu, mv, most = middle[i, e, 0], middle[i, e, 1], scale / other.nearest[i, e]
            a, b, c = inverse[i, e, XX], inverse[i, e, XY], inverse[i, e, YY]
            half = np.sqrt(a / (a * c - b * b))
            if not half >= 0.0:
                continue
            for v in range(max(int(mv - half), 0), min(int(mv + half) + 1, height)):
                x0, x1 = ellipse_row(v + 0.5 - mv, a, b, c)
                if x0 > x1:
                    continue
                low, high = mu + x0, mu + x1
                for k in range(3):
                    row[k] = start[i, e, k, 1] * (v + 0.5) + start[i, e, k, 2]
                    row[3 + k] = step[i, e, k, 1] * (v + 0.5) + step[i, e, k, 2]
                left = max(int(low), 0)
                many = min(int(high + most) + 1, width) - left
                _depths_of_part(left, out[v, left:], many, start[i, e], step[i, e], row, t)
                for k in range(many):
                    x = left + k + 0.5 - out[v, left + k]  # a nan is in no range
                    if low <= x <= high and t[k] < depth[v, left + k] - SAME:
                        out[v, left + k] = np.nan


LEFT, RIGHT, TOP, BOTTOM = range(4)  # columns of `edges`


@njit(cache=True)
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
