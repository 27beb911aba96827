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
TILE_H, TILE_W = 16, 32  # px: what is blurred anew as a whole where something was painted


@njit(cache=True)
def span(y, inverse):  # type: ignore[no-untyped-def]
    """Ends x0 <= x1 of the row y of the ellipse a x² + 2 b x y + d y² <= 1, inverse = (a, b, d); x0 > x1: none."""
    a, b, d = inverse
    root = b * b * y * y - a * (d * y * y - 1.0)
    if not (root >= 0.0 and a > 0.0):
        return 1.0, -1.0
    root = np.sqrt(root)
    return (-b * y - root) / a, (-b * y + root) / a


@njit(cache=True)
def columns(v, middle, inverse, width):  # type: ignore[no-untyped-def]
    """First column and last + 1 whose middles lie in the outline in row v and in the image."""
    x0, x1 = span(v + 0.5 - middle[1], inverse)
    if x0 > x1:
        return 0, 0
    low, high = max(np.ceil(middle[0] + x0 - 0.5), 0.0), min(np.floor(middle[0] + x1 - 0.5) + 1.0, float(width))
    return int(low), max(int(high), int(low))


@njit(cache=True)
def touch(dirty, top, bottom, left, right, margin, height, width):  # type: ignore[no-untyped-def]
    """Note the tiles of rows top … bottom - 1, columns left … right - 1 and of a margin round them."""
    for r in range(max(top - margin, 0) // TILE_H, (min(bottom + margin, height) - 1) // TILE_H + 1):
        for c in range(max(left - margin, 0) // TILE_W, (min(right + margin, width) - 1) // TILE_W + 1):
            dirty[r, c] = 1


@njit(cache=True)
def _colour(atlas, round_, up, light, out):  # type: ignore[no-untyped-def]
    """Colour of an atlas page (H, W, 3) at round_ in [0, 4) and up in [-1, 1], between its four neighbours."""
    rows, cols = atlas.shape[0], atlas.shape[1]
    x, y = round_ * (0.25 * cols) - 0.5, min(max((up + 1.0) * (0.5 * rows) - 0.5, 0.0), rows - 1.001)
    i, j = int(np.floor(x)), int(y)
    a, b = x - i, y - j
    left, right = i % cols, (i + 1) % cols
    for k in range(3):
        low = atlas[j, left, k] * (1 - a) + atlas[j, right, k] * a
        high = atlas[j + 1, left, k] * (1 - a) + atlas[j + 1, right, k] * a
        out[k] = np.int16(min((low * (1 - b) + high * b) * light, MOST))


@njit(cache=True)
def _light(x, y, z, half, sun, shadow, sunlit):  # type: ignore[no-untyped-def]
    """Brightness at a place of a ball: the sky's light from above more than from the side, and the sun's by Lambert."""
    nx, ny, nz = x / half[0], y / half[1], z / half[2]
    size = 1.0 / np.sqrt(nx * nx + ny * ny + nz * nz)
    facing = max(0.0, nx * sun[0] + ny * sun[1] + nz * sun[2]) * size / max(sun[2], 0.3)
    return (1.0 - shadow) * (0.8 + 0.2 * nz * size) + shadow * facing * sunlit


@njit(cache=True)
def people(  # type: ignore[no-untyped-def]
    order,
    start,
    step,
    half,
    middle,
    inverse,
    boxes,
    id,
    sun,
    shadow,
    sunlit,
    pages,
    atlas,
    shade,
    label,
    depth,
    ids,
    canvas,
    dirty,
    margin,
    amodal,
):
    """Paint people in `order` (near first is quickest; any gives the same), by depth.

    start, step (N, 2, 3, 3): P and D of each part; half (N, 2, 3) m; middle (N, 2, 2), inverse (N, 2, 3): outlines;
    boxes (N, 4) first row, last + 1, first column, last + 1; sun (N, 3) in each body's axes; sunlit (N, 3): share of
    the sun at feet, waist and head; pages (N,) of the atlas (P, 2, H, W, 3).
    depth (H, W) is that of the plate and becomes that of all; with `label` ids (H, W) and amodal (N,), the pixels of
    each silhouette in the image; with `shade` the canvas (H, W, 3) and the tiles that are dirty.
    """
    height, width = depth.shape
    for i in order:
        page, top = atlas[pages[i]], boxes[i, 0]
        if shade and boxes[i, 1] > top:
            touch(dirty, top, boxes[i, 1], boxes[i, 2], boxes[i, 3], margin, height, width)
        for v in range(top, boxes[i, 1]):
            first, last = 0, 0
            for e in range(2):
                low, high = columns(v, middle[i, e], inverse[i, e], width)
                if label:
                    amodal[i] += high - low
                    if e == 1:
                        amodal[i] -= max(0, min(last, high) - max(first, low))
                first, last = low, high
                p, d, h = start[i, e], step[i, e], half[i, e]
                y = v + 0.5
                p0, p1, p2 = p[0, 1] * y + p[0, 2], p[1, 1] * y + p[1, 2], p[2, 1] * y + p[2, 2]
                d0, d1, d2 = d[0, 1] * y + d[0, 2], d[1, 1] * y + d[1, 2], d[2, 1] * y + d[2, 2]
                for u in range(low, high):
                    x = u + 0.5
                    px, py, pz = p[0, 0] * x + p0, p[1, 0] * x + p1, p[2, 0] * x + p2
                    dx, dy, dz = d[0, 0] * x + d0, d[1, 0] * x + d1, d[2, 0] * x + d2
                    a, b = dx * dx + dy * dy + dz * dz, px * dx + py * dy + pz * dz
                    root = max(b * b - a * (px * px + py * py + pz * pz - 1.0), 0.0)
                    t = (-b - np.sqrt(root)) / a
                    if t <= 0.0 or t >= depth[v, u]:
                        continue
                    depth[v, u] = t
                    if label:
                        ids[v, u] = id[i]
                    if shade:
                        qx, qy, qz = px + t * dx, py + t * dy, pz + t * dz
                        up = qz if e == 0 else 1.0
                        share = sunlit[i, 1] + (sunlit[i, 2 if up > 0 else 0] - sunlit[i, 1]) * abs(up)
                        level = 1.0 / (abs(qx) + abs(qy) + 1e-12)
                        round_ = 1.0 - qx * level if qy >= 0 else 3.0 + qx * level
                        _colour(page[e], round_, qz, UNIT * _light(qx, qy, qz, h, sun[i], shadow, share), canvas[v, u])


@njit(cache=True)
def _shade(x, y, z, centre, shape, sun, softness):  # type: ignore[no-untyped-def]
    """Share of the sun that one person (body and head) takes from the point (x, y, z)."""
    share = 0.0
    for e in range(2):
        above = (centre[e, 2] - z) / sun[2]
        if above <= 0.0:
            continue
        dx, dy = x - centre[e, 0] + sun[0] * above, y - centre[e, 1] + sun[1] * above
        q = dx * dx * shape[e, 0] + 2 * dx * dy * shape[e, 1] + dy * dy * shape[e, 2]
        if q < (1.0 + softness[e]) ** 2:
            soft = softness[e]
            share = max(share, 1.0 if soft == 0.0 else min((1.0 + soft - np.sqrt(q)) / (2 * soft), 1.0))
    return share


@njit(cache=True)
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
    for i in range(len(boxes)):
        if boxes[i, 1] > boxes[i, 0]:
            touch(dirty, boxes[i, 0], boxes[i, 1], boxes[i, 2], boxes[i, 3], margin, height, width)
        for v in range(boxes[i, 0], boxes[i, 1]):
            low, high = boxes[i, 2], boxes[i, 3]
            if flat:
                low, high = columns(v, middle[i, 0], inverse[i, 0], width)
                a, b = columns(v, middle[i, 1], inverse[i, 1], width)
                if b > a:
                    low, high = (min(low, a), max(high, b)) if high > low else (a, b)
            for u in range(low, high):
                x, y, z = place[v, u, 0], place[v, u, 1], place[v, u, 2]
                share = int(255.0 * _shade(x, y, z, centre[i], shape[i], sun, softness[i]) + 0.5)
                old = int(taken[v, u])
                if share > old:
                    taken[v, u] = share
                    part = direct[v, u] / 255.0
                    factor = (1.0 - part * share) / (1.0 - part * old)
                    for k in range(3):
                        canvas[v, u, k] = np.int16(canvas[v, u, k] * factor)
