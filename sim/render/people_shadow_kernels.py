"""Compiled: people and their shadows painted over a plate, row by row of their outlines. The slow twin is in the tests.

A body part is a ball of radius 1 in its own axes (across, along, up, each over its half axis): there the ray of pixel
(u, v) is q = P (u, v, 1) + t D (u, v, 1), and it meets the ball at the smaller root t of |q| = 1; t is depth along the
camera's axis, and the nearest t wins. Only pixels inside the part's outline (sim.scene.body.outlines) are asked.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from sim.render.clothing_kernels import ROUND, UP

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
def _met(ray, left, many, t):  # type: ignore[no-untyped-def]
    """t (many,): depths at which the rays of a row's pixels from column `left` on meet a ball.

    ray (3, 4): of each own axis what P and D are at column 0 and gain with each column.
    """
    px0, px1, dx0, dx1 = ray[0, 0], ray[0, 1], ray[0, 2], ray[0, 3]
    py0, py1, dy0, dy1 = ray[1, 0], ray[1, 1], ray[1, 2], ray[1, 3]
    pz0, pz1, dz0, dz1 = ray[2, 0], ray[2, 1], ray[2, 2], ray[2, 3]
    for k in range(many):
        x = left + k + 0.5
        px, dx = px1 * x + px0, dx1 * x + dx0
        py, dy = py1 * x + py0, dy1 * x + dy0
        pz, dz = pz1 * x + pz0, dz1 * x + dz0
        a, b = dx * dx + dy * dy + dz * dz, px * dx + py * dy + pz * dz
        root = b * b - a * (px * px + py * py + pz * pz - 1.0)
        t[k] = (-b - np.sqrt(root if root > 0.0 else 0.0)) / a


@njit(cache=True, error_model="numpy")
def _shaded(ray, left, many, t, half, sun, shadow, sunlit, head, place, across, up, light):  # type: ignore[no-untyped-def]
    """Of the points at depths t (many,): where on a page of the atlas they are, and light times UNIT.

    half (3,) m, sun (3,): in own axes; sunlit (3,): at feet, waist and head; head: whether the part is one. place:
    number of the upper left one of four texels; across, up: from its middle to theirs, 0 … 1. float32 is exact to
    1e-4 of a page.
    """
    f = np.float32
    px0, px1, dx0, dx1 = f(ray[0, 0]), f(ray[0, 1]), f(ray[0, 2]), f(ray[0, 3])
    py0, py1, dy0, dy1 = f(ray[1, 0]), f(ray[1, 1]), f(ray[1, 2]), f(ray[1, 3])
    pz0, pz1, dz0, dz1 = f(ray[2, 0]), f(ray[2, 1]), f(ray[2, 2]), f(ray[2, 3])
    h0, h1, h2 = f(1.0 / half[0]), f(1.0 / half[1]), f(1.0 / half[2])
    low_sun = shadow / max(sun[2], 0.3)
    s0, s1, s2 = f(sun[0] * low_sun), f(sun[1] * low_sun), f(sun[2] * low_sun)
    waist, above, below = f(sunlit[1]), f(sunlit[2] - sunlit[1]), f(sunlit[0] - sunlit[1])
    sky, zero, one = f(UNIT * (1.0 - shadow)), f(0.0), f(1.0)
    for k in range(many):
        x, depth = f(left + k) + f(0.5), f(t[k])
        qx = px1 * x + px0 + depth * (dx1 * x + dx0)
        qy = py1 * x + py0 + depth * (dy1 * x + dy0)
        qz = pz1 * x + pz0 + depth * (dz1 * x + dz0)
        nx, ny, nz = qx * h0, qy * h1, qz * h2
        size = one / np.sqrt(nx * nx + ny * ny + nz * nz)
        facing = nx * s0 + ny * s1 + nz * s2
        facing = (facing if facing > zero else zero) * size
        high = one if head else qz
        facing *= waist + (above * high if high > zero else -below * high)
        light[k] = sky * (f(0.8) + f(0.2) * nz * size) + f(UNIT) * facing
        share = qx / (abs(qx) + abs(qy) + f(1e-12))
        x = (one - share if qy >= zero else f(3.0) + share) * f(0.25 * ROUND) - f(0.5)
        x = x if x >= zero else x + f(ROUND)
        y = (qz + one) * f(0.5 * UP) - f(0.5)
        y = min(max(y, zero), f(UP - 1.001))
        i, j = np.int32(x), np.int32(y)
        across[k], up[k] = x - f(i), y - f(j)
        place[k] = j * np.int32(ROUND + 1) + i


@njit(cache=True, error_model="numpy")
def people(  # type: ignore[no-untyped-def]
    order, start, step, half, middle, inverse, boxes, id, sun, shadow, sunlit, pages, atlas,
    shade, label, depth, ids, canvas, dirty, margin, amodal,
):  # fmt: skip
    """Paint people in `order` (near first is quickest; any gives the same), by depth.

    start, step (N, 2, 3, 3): P and D of each part; half (N, 2, 3) m; middle (N, 2, 2), inverse (N, 2, 3): outlines;
    boxes (N, 4) first row, last + 1, first column, last + 1; sun (N, 3) in each body's axes; sunlit (N, 3): share of
    the sun at feet, waist and head; pages (N,) of the atlas (P, 2, texels; see sim.render.clothing).
    depth (H, W) is that of the plate and becomes that of all, tiles in which it does are dirty; with `label` ids (H, W)
    and amodal (N,), the pixels of each silhouette in the image; with `shade` the canvas (H, W, 3). The light is the
    sky's, from above more than from the side, and the sun's by Lambert's law.
    """
    height, width = depth.shape
    t, ray = np.empty(width), np.empty((3, 4))
    place, one = np.empty(width, np.int32), np.float32(1.0)
    across, up, light = np.empty(width, np.float32), np.empty(width, np.float32), np.empty(width, np.float32)
    for i in order:
        for e in range(2):
            page = atlas[pages[i], e]
            for v in range(boxes[i, 0], boxes[i, 1]):
                low, high = columns(v, i, e, middle, inverse, width)
                if low == high:
                    continue
                if label:
                    amodal[i] += high - low
                    if e == 1:
                        other, last = columns(v, i, 0, middle, inverse, width)
                        amodal[i] -= max(0, min(last, high) - max(other, low))
                for k in range(3):
                    ray[k, 0], ray[k, 1] = start[i, e, k, 1] * (v + 0.5) + start[i, e, k, 2], start[i, e, k, 0]
                    ray[k, 2], ray[k, 3] = step[i, e, k, 1] * (v + 0.5) + step[i, e, k, 2], step[i, e, k, 0]
                _met(ray, low, high - low, t)
                shown = 0
                for u in range(low, high):
                    near = t[u - low]
                    if near <= 0.0 or near >= depth[v, u]:
                        t[u - low] = -1.0
                        continue
                    shown += 1
                    depth[v, u] = near
                    if label:
                        ids[v, u] = id[i]
                if shown == 0:
                    continue
                touch(dirty, v, low, high, margin, height, width)
                if not shade:
                    continue
                _shaded(
                    ray, low, high - low, t, half[i, e], sun[i], shadow, sunlit[i], e == 1, place, across, up, light
                )  # fmt: skip
                for u in range(low, high):
                    n = u - low
                    if t[n] > 0.0:
                        a, b, here, beneath = across[n], up[n], 3 * place[n], 3 * (place[n] + ROUND + 1)
                        for k in range(3):
                            first = np.float32(page[here + k]) * (one - a) + np.float32(page[here + 3 + k]) * a
                            second = np.float32(page[beneath + k]) * (one - a) + np.float32(page[beneath + 3 + k]) * a
                            c = (first * (one - b) + second * b) * light[n]
                            canvas[v, u, k] = np.int16(np.int32(min(c, np.float32(MOST))))


@njit(cache=True, error_model="numpy")
def _shade(place, many, centre, shape, sx, sy, softness, gone):  # type: ignore[no-untyped-def]
    """gone (many,), at first 0: made 255 times the share of the sun that a part takes at places (many, 3), if more.

    The sun comes along (sx, sy, 1); centre (3,), shape (3,), softness of the part: as for `shadows`.
    """
    f = np.float32
    x, y, z, a, b, c = f(centre[0]), f(centre[1]), f(centre[2]), f(shape[0]), f(2 * shape[1]), f(shape[2])
    slope_x, slope_y, zero, one, most = f(sx), f(sy), f(0.0), f(1.0), f(255.0)
    edge, per = f(1.0 + softness), f(1.0 / max(2 * softness, 1e-6))
    for k in range(many):
        above = z - place[k, 2]
        dx, dy = place[k, 0] - x + slope_x * above, place[k, 1] - y + slope_y * above
        q = dx * dx * a + dx * dy * b + dy * dy * c
        share = (edge - np.sqrt(max(q, zero))) * per
        share = share if above > zero else zero
        dark = most * min(max(share, zero), one)
        gone[k] = max(gone[k], dark)


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
    gone, half = np.empty(width, np.float32), np.float32(0.5)
    for i in range(len(boxes)):
        for v in range(boxes[i, 0], boxes[i, 1]):
            low, high = boxes[i, 2], boxes[i, 3]
            if flat:
                low, high = columns(v, i, 0, middle, inverse, width)
                first, last = columns(v, i, 1, middle, inverse, width)
                if last > first:
                    low, high = (min(low, first), max(high, last)) if high > low else (first, last)
            if high <= low:
                continue
            gone[: high - low] = 0.0
            for e in range(2):
                _shade(place[v, low:], high - low, centre[i, e], shape[i, e], sx, sy, softness[i, e], gone)
            left, right = width, 0
            for u in range(low, high):
                new, old = int(gone[u - low] + half), int(taken[v, u])
                if new > old:
                    left, right = min(left, u), u + 1
                    taken[v, u] = new
                    part = direct[v, u] * np.float32(1.0 / 255.0)
                    factor = (np.float32(1.0) - part * np.float32(new)) / (np.float32(1.0) - part * np.float32(old))
                    for k in range(3):
                        canvas[v, u, k] = np.int16(np.int32(np.float32(canvas[v, u, k]) * factor))
            touch(dirty, v, left, right, margin, height, width)
