"""Compiled: people and their shadows painted over a plate, row by row of their outlines. The slow twin is in the tests.

A body part is a ball of radius 1 in its own axes (across, along, up, each over its half axis): there the ray of pixel
(u, v) is q = P (u, v, 1) + t D (u, v, 1), and it meets the ball at the smaller root t of |q| = 1; t is depth along the
camera's axis, and the nearest t wins. Only pixels inside the part's outline (sim.people.outlines) are asked.
"""

from __future__ import annotations

import numpy as np
from numba import njit

UNIT = 64.0  # canvases hold grey levels times this, as int16
MOST = 32767.0
TILE_H, TILE_W = 8, 16  # px: what is blurred anew as a whole where something was painted


@njit(cache=True, error_model="numpy")
def span(y, a, b, d):  # type: ignore[no-untyped-def]
    """Ends x0 <= x1 of the row y of the ellipse a x² + 2 b x y + d y² <= 1; x0 > x1: none."""
    root = b * b * y * y - a * (d * y * y - 1.0)
    if not (root >= 0.0 and a > 0.0):
        return 1.0, -1.0
    root = np.sqrt(root)
    return (-b * y - root) / a, (-b * y + root) / a


@njit(cache=True, error_model="numpy")
def columns(v, i, e, middle, inverse, width):  # type: ignore[no-untyped-def]
    """First column and last + 1 whose middles lie in the outline (i, e) in row v and in the image."""
    x0, x1 = span(v + 0.5 - middle[i, e, 1], inverse[i, e, 0], inverse[i, e, 1], inverse[i, e, 2])
    if x0 > x1:
        return 0, 0
    low = int(max(np.ceil(middle[i, e, 0] + x0 - 0.5), 0.0))
    return low, max(int(min(np.floor(middle[i, e, 0] + x1 + 0.5), float(width))), low)


@njit(cache=True)
def touch(dirty, v, left, right, margin, height, width):  # type: ignore[no-untyped-def]
    """Note the tiles of columns left … right - 1 of row v and of a margin round them."""
    if right > left:
        first, last = max(left - margin, 0) // TILE_W, (min(right + margin, width) - 1) // TILE_W
        for r in range(max(v - margin, 0) // TILE_H, min(v + margin, height - 1) // TILE_H + 1):
            for c in range(first, last + 1):
                dirty[r, c] = 1


@njit(cache=True, error_model="numpy")
def _colour(atlas, page, e, round_, up, light, canvas, v, u):  # type: ignore[no-untyped-def]
    """The canvas at (v, u): the atlas's colour at round_ in [0, 4) and up in [-1, 1], between its four neighbours."""
    rows, cols = atlas.shape[2], atlas.shape[3]
    x, y = round_ * (0.25 * cols) - 0.5, min(max((up + 1.0) * (0.5 * rows) - 0.5, 0.0), rows - 1.001)
    i, j = int(np.floor(x)), int(y)
    a, b = np.float32(x - i), np.float32(y - j)
    left, right = i if i >= 0 else cols - 1, i + 1 if i + 1 < cols else 0
    one, bright = np.float32(1.0), np.float32(light)
    for k in range(3):
        low = np.float32(atlas[page, e, j, left, k]) * (one - a) + np.float32(atlas[page, e, j, right, k]) * a
        high = np.float32(atlas[page, e, j + 1, left, k]) * (one - a) + np.float32(atlas[page, e, j + 1, right, k]) * a
        c = (low * (one - b) + high * b) * bright
        canvas[v, u, k] = np.int16(np.int32(c if c < np.float32(MOST) else np.float32(MOST)))


@njit(cache=True, error_model="numpy")
def people(  # type: ignore[no-untyped-def]
    order, start, step, half, middle, inverse, boxes, id, sun, shadow, sunlit, pages, atlas,
    shade, label, depth, ids, canvas, dirty, margin, amodal,
):  # fmt: skip
    """Paint people in `order` (near first is quickest; any gives the same), by depth.

    start, step (N, 2, 3, 3): P and D of each part; half (N, 2, 3) m; middle (N, 2, 2), inverse (N, 2, 3): outlines;
    boxes (N, 4) first row, last + 1, first column, last + 1; sun (N, 3) in each body's axes; sunlit (N, 3): share of
    the sun at feet, waist and head; pages (N,) of the atlas (P, 2, H, W, 3).
    depth (H, W) is that of the plate and becomes that of all; with `label` ids (H, W) and amodal (N,), the pixels of
    each silhouette in the image; with `shade` the canvas (H, W, 3) and the tiles that are dirty. The light is the
    sky's, from above more than from the side, and the sun's by Lambert's law.
    """
    height, width = depth.shape
    for i in order:
        s0, s1, s2 = sun[i, 0], sun[i, 1], sun[i, 2]
        low_sun = shadow / max(s2, 0.3)
        for e in range(2):
            h0, h1, h2 = 1.0 / half[i, e, 0], 1.0 / half[i, e, 1], 1.0 / half[i, e, 2]
            for v in range(boxes[i, 0], boxes[i, 1]):
                low, high = columns(v, i, e, middle, inverse, width)
                if low == high:
                    continue
                if label:
                    amodal[i] += high - low
                    if e == 1:
                        other, last = columns(v, i, 0, middle, inverse, width)
                        amodal[i] -= max(0, min(last, high) - max(other, low))
                if shade:
                    touch(dirty, v, low, high, margin, height, width)
                y = v + 0.5
                px0, dx0 = start[i, e, 0, 1] * y + start[i, e, 0, 2], step[i, e, 0, 1] * y + step[i, e, 0, 2]
                py0, dy0 = start[i, e, 1, 1] * y + start[i, e, 1, 2], step[i, e, 1, 1] * y + step[i, e, 1, 2]
                pz0, dz0 = start[i, e, 2, 1] * y + start[i, e, 2, 2], step[i, e, 2, 1] * y + step[i, e, 2, 2]
                for u in range(low, high):
                    x = u + 0.5
                    px, dx = start[i, e, 0, 0] * x + px0, step[i, e, 0, 0] * x + dx0
                    py, dy = start[i, e, 1, 0] * x + py0, step[i, e, 1, 0] * x + dy0
                    pz, dz = start[i, e, 2, 0] * x + pz0, step[i, e, 2, 0] * x + dz0
                    a, b = dx * dx + dy * dy + dz * dz, px * dx + py * dy + pz * dz
                    root = max(b * b - a * (px * px + py * py + pz * pz - 1.0), 0.0)
                    t = (-b - np.sqrt(root)) / a
                    if t <= 0.0 or t >= depth[v, u]:
                        continue
                    depth[v, u] = t
                    if label:
                        ids[v, u] = id[i]
                    if not shade:
                        continue
                    qx, qy, qz = px + t * dx, py + t * dy, pz + t * dz
                    nx, ny, nz = qx * h0, qy * h1, qz * h2
                    size = 1.0 / np.sqrt(nx * nx + ny * ny + nz * nz)
                    facing = max(0.0, nx * s0 + ny * s1 + nz * s2) * size * low_sun
                    up = qz if e == 0 else 1.0
                    facing *= sunlit[i, 1] + (sunlit[i, 2 if up > 0 else 0] - sunlit[i, 1]) * abs(up)
                    light = UNIT * ((1.0 - shadow) * (0.8 + 0.2 * nz * size) + facing)
                    share = qx / (abs(qx) + abs(qy) + 1e-12)
                    _colour(atlas, pages[i], e, 1.0 - share if qy >= 0 else 3.0 + share, qz, light, canvas, v, u)


@njit(cache=True, error_model="numpy")
def _shade(x, y, z, i, centre, shape, sx, sy, softness):  # type: ignore[no-untyped-def]
    """Share of the sun that person i (body and head) takes from the point (x, y, z); it comes along (sx, sy, 1)."""
    share = 0.0
    for e in range(2):
        above = centre[i, e, 2] - z
        if above <= 0.0 or share >= 1.0:
            continue
        dx, dy = x - centre[i, e, 0] + sx * above, y - centre[i, e, 1] + sy * above
        q = dx * dx * shape[i, e, 0] + 2 * dx * dy * shape[i, e, 1] + dy * dy * shape[i, e, 2]
        soft = softness[i, e]
        if q < (1.0 + soft) ** 2:
            share = max(share, 1.0 if q <= (1.0 - soft) ** 2 or soft == 0.0 else (1.0 + soft - np.sqrt(q)) / (2 * soft))
    return min(share, 1.0)


@njit(cache=True, error_model="numpy")
def shadows(  # type: ignore[no-untyped-def]
    place, direct, boxes, flat, middle, inverse, centre, shape, sun, softness, taken, canvas, dirty, margin
):
    """Darken the canvas (H, W, 3) where people stand before the sun; the darkest shadow counts where several fall.

    place (H, W, 3) m and direct (H, W), the sun's share of the light, of the plate; boxes as for `people`, the image of
    the shadows; flat: all that is in view is level ground, where the shadow of part e has the outline middle, inverse;
    centre (N, 2, 3), shape (N, 2, 3): inverse of P S Pᵀ, packed; softness (N, 2): half the penumbra over the mean
    radius; taken (H, W) uint8: 255 times the share of the sun that is gone, 0 at first.
    """
    height, width = direct.shape
    sx, sy = sun[0] / sun[2], sun[1] / sun[2]
    for i in range(len(boxes)):
        for v in range(boxes[i, 0], boxes[i, 1]):
            low, high = boxes[i, 2], boxes[i, 3]
            if flat:
                low, high = columns(v, i, 0, middle, inverse, width)
                first, last = columns(v, i, 1, middle, inverse, width)
                if last > first:
                    low, high = (min(low, first), max(high, last)) if high > low else (first, last)
            left, right = width, 0
            for u in range(low, high):
                share = _shade(place[v, u, 0], place[v, u, 1], place[v, u, 2], i, centre, shape, sx, sy, softness)
                gone, old = int(255.0 * share + 0.5), int(taken[v, u])
                if gone > old:
                    left, right = min(left, u), u + 1
                    taken[v, u] = gone
                    part = direct[v, u] * (1.0 / 255.0)
                    factor = np.float32((1.0 - part * gone) / (1.0 - part * old))
                    for k in range(3):
                        canvas[v, u, k] = np.int16(np.int32(np.float32(canvas[v, u, k]) * factor))
            touch(dirty, v, left, right, margin, height, width)
