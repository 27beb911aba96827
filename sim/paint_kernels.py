"""Compiled: people painted over a plate, pixel by pixel, and the shadows they cast.

A person is the two ellipsoids of sim.people. A ray o + t d meets (p - c)ᵀ M (p - c) = 1 at the smaller root t of
t² dᵀMd + 2 t dᵀM(o - c) + (o - c)ᵀM(o - c) - 1 = 0; t is depth along the camera's axis, and the nearest t wins.
The shadow of an ellipsoid (c, S) on level ground z along sun s is the ellipse with middle c - s (c_z - z)/s_z and shape
P S Pᵀ, P = I - s e_zᵀ / s_z. The numpy twin is in the tests.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from sim.texture_kernels import lattice, smooth

SHOES, TROUSERS, SHIRT, SECOND, SKIN, HAIR = range(6)  # rows of a person's colours
PLAIN, HOOPS, STRIPES, PATCHES, JACKET = range(5)  # how a shirt is patterned
WHOLE = 2.0  # brightness of an unlit pixel is never above this


@njit(cache=True)
def _wear(part, across, along, up, round_, style, key, colours, out):  # type: ignore[no-untyped-def]
    """The colour of a place on a person. across, along: of the horizontal normal, body frame; up: share of height;
    round_: way round the body in [0, 4); style: pattern, its count, hem, hair line."""
    if part == 1:
        row = HAIR if up > style[3] + 0.035 * along or (along < -0.25 and up > 0.9) else SKIN
        shade = 1.0
    elif up < 0.045:
        row, shade = SHOES, 1.0
    elif up < style[2]:
        row = TROUSERS
        gap = abs(across) < 0.16 and up < style[2] - 0.06  # between the legs
        shade = 0.55 if gap else 1.0
    elif up > 0.80 and along > 0.0 and abs(across) < 0.45:
        row, shade = SKIN, 0.9  # neck
    else:
        row, shade, pattern = SHIRT, 1.0, int(style[0])
        hoop = pattern == HOOPS and int(np.floor(up * style[1] * 3.0)) % 2 == 1
        stripe = pattern == STRIPES and int(np.floor(round_ * style[1])) % 2 == 1
        patch = pattern == PATCHES and lattice(int(round_ * style[1] * 0.8), int(up * 4 * style[1]), key) > 0.3
        if hoop or stripe or patch or (pattern == JACKET and along > 0.25 and abs(across) < 0.3):
            row = SECOND
    cloth = 1.0 + 0.16 * smooth(5.0 * round_, 22.0 * up, key) + 0.10 * smooth(13.0 * round_, 55.0 * up, key + 1)
    for k in range(3):
        out[k] = colours[row, k] * shade * cloth


@njit(cache=True)
def people(  # type: ignore[no-untyped-def]
    origin,
    direction,
    boxes,
    centre,
    inverse,
    facing,
    foot,
    height,
    keys,
    styles,
    colours,
    sun,
    shadow,
    depth,
    ids,
    id,
    image,
    amodal,
):
    """Paint all people: depth (H, W), ids (H, W) and image (H, W, 3) are those of the plate and become those of all.

    boxes (N, 4) first and last + 1 column and row; amodal (N,) counts the pixels of each silhouette in the image.
    """
    o, d, m, n, c = np.empty(3), np.empty(3), np.empty(3), np.empty(3), np.empty(3)
    for i in range(len(id)):
        cos, sin = facing[i, 0], facing[i, 1]
        for v in range(boxes[i, 2], boxes[i, 3]):
            for u in range(boxes[i, 0], boxes[i, 1]):
                for k in range(3):
                    o[k] = origin[k, 0] * (u + 0.5) + origin[k, 1] * (v + 0.5) + origin[k, 2]
                    d[k] = direction[k, 0] * (u + 0.5) + direction[k, 1] * (v + 0.5) + direction[k, 2]
                best, part = np.inf, -1
                for e in range(2):
                    a = b = q = 0.0
                    for k in range(3):
                        x = o[k] - centre[i, e, k]
                        md = inverse[i, e, k, 0] * d[0] + inverse[i, e, k, 1] * d[1] + inverse[i, e, k, 2] * d[2]
                        a += d[k] * md
                        b += x * md
                        for j in range(3):
                            q += x * inverse[i, e, k, j] * (o[j] - centre[i, e, j])
                    root = b * b - a * (q - 1.0)
                    if root < 0.0:
                        continue
                    t = (-b - np.sqrt(root)) / a
                    if 0.0 < t < best:
                        best, part = t, e
                if part < 0:
                    continue
                amodal[i] += 1
                if best >= depth[v, u]:
                    continue
                depth[v, u] = best
                ids[v, u] = id[i]
                for k in range(3):
                    m[k] = o[k] + best * d[k] - centre[i, part, k]
                size = 0.0
                for k in range(3):
                    n[k] = inverse[i, part, k, 0] * m[0] + inverse[i, part, k, 1] * m[1] + inverse[i, part, k, 2] * m[2]
                    size += n[k] * n[k]
                size = np.sqrt(size)
                for k in range(3):
                    n[k] /= size
                along, across = n[0] * cos + n[1] * sin, n[1] * cos - n[0] * sin
                level = abs(along) + abs(across) + 1e-9
                round_ = 1.0 - along / level if across >= 0 else 3.0 + along / level
                level = np.sqrt(along * along + across * across) + 1e-9
                up = (m[2] + centre[i, part, 2] - foot[i]) / height[i]
                _wear(part, across / level, along / level, up, round_, styles[i], keys[i], colours[i], c)
                lit = max(0.0, n[0] * sun[0] + n[1] * sun[1] + n[2] * sun[2]) / max(sun[2], 0.3)
                light = min((1.0 - shadow) * (0.78 + 0.22 * n[2]) + shadow * lit, WHOLE)
                for k in range(3):
                    image[v, u, k] = c[k] * light


@njit(cache=True)
def shadows(place, boxes, centre, inverse, sun, softness, sunlit):  # type: ignore[no-untyped-def]
    """Take from sunlit (H, W) the share of the sun that people stand in.

    boxes (N, 4) where the shadow of each person can be; inverse (N, 2, 3): of P S Pᵀ packed; softness (N, 2): penumbra
    over the ellipse's mean radius.
    """
    for i in range(len(boxes)):
        for v in range(boxes[i, 2], boxes[i, 3]):
            for u in range(boxes[i, 0], boxes[i, 1]):
                x, y, z = place[v, u, 0], place[v, u, 1], place[v, u, 2]
                share = 0.0
                for e in range(2):
                    above = (centre[i, e, 2] - z) / sun[2]
                    if above <= 0.0:
                        continue
                    dx, dy = x - centre[i, e, 0] + sun[0] * above, y - centre[i, e, 1] + sun[1] * above
                    q = dx * dx * inverse[i, e, 0] + 2 * dx * dy * inverse[i, e, 1] + dy * dy * inverse[i, e, 2]
                    if q < (1.0 + softness[i, e]) ** 2:
                        inside = 1.0 if softness[i, e] == 0.0 else 0.5 - (np.sqrt(q) - 1.0) / softness[i, e]
                        share = max(share, min(inside, 1.0))
                if share > 0.0:
                    sunlit[v, u] *= 1.0 - share


@njit(cache=True)
def compose(colour, direct, sunlit, ids, people, gain, out):  # type: ignore[no-untyped-def]
    """The picture (H, W, 3) uint8: people where there are some, else the plate, darker where the sun is taken away."""
    height, width = ids.shape
    for v in range(height):
        for u in range(width):
            if ids[v, u] > 0:
                for k in range(3):
                    out[v, u, k] = np.uint8(min(gain * people[v, u, k] + 0.5, 255.0))
            else:
                light = gain * (1.0 - direct[v, u] * (1.0 - sunlit[v, u]))
                for k in range(3):
                    out[v, u, k] = np.uint8(min(light * colour[v, u, k] + 0.5, 255.0))


@njit(cache=True)
def seen_boxes(ids, row_of, count, box):  # type: ignore[no-untyped-def]
    """Pixels (N,) of each person in the id map, and the box (N, 4) first and last + 1 column and row round them."""
    height, width = ids.shape
    for i in range(len(box)):
        box[i, 0], box[i, 1], box[i, 2], box[i, 3] = width, 0, height, 0
    for v in range(height):
        for u in range(width):
            if ids[v, u] > 0:
                i = row_of[ids[v, u]]
                count[i] += 1
                box[i, 0], box[i, 1] = min(box[i, 0], u), max(box[i, 1], u + 1)
                box[i, 2], box[i, 3] = min(box[i, 2], v), max(box[i, 3], v + 1)


@njit(cache=True)
def disparities(depth, right, scale, tolerance, out):  # type: ignore[no-untyped-def]
    """Disparity scale / z of each pixel; nan where the right camera sees something nearer there, or nothing at all.

    right: the right view's depth (H, W). A point is seen where one of the two pixels about it has its depth.
    """
    height, width = depth.shape
    for v in range(height):
        for u in range(width):
            z = depth[v, u]
            out[v, u] = np.nan
            if not z < 1e9:
                continue
            d = scale / z
            there = u + 0.5 - d - 0.5
            low = int(np.floor(there))
            if low < 0 or low + 1 >= width:
                continue
            if right[v, low] >= z * (1 - tolerance) or right[v, low + 1] >= z * (1 - tolerance):
                out[v, u] = d
