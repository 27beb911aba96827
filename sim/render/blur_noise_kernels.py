"""Compiled: from a canvas to a picture: blur where something was painted, brightness, noise, eight bits.

Inner loops run over whole rows from index 0, so that the compiler can take eight numbers at a time.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from sim.render.image_noise import MIDDLE
from sim.render.people_shadow_kernels import TILE_H, TILE_W, UNIT

SCALE, HALF, LOW, HIGH = np.float32(1.0 / UNIT), np.float32(0.5), np.float32(0.0), np.float32(255.0)
ONE, GREY = np.float32(1.0), np.float32(1.0 / (MIDDLE * UNIT))


@njit(cache=True)
def _add(line, weight, many, out):  # type: ignore[no-untyped-def]
    for i in range(many):
        out[i] += weight * np.float32(line[i])


@njit(cache=True)
def _five(a, b, c, d, e, w, x, y, many, out):  # type: ignore[no-untyped-def]
    """The usual blur, of radius 2: w, x, y, x, w times five lines."""
    for i in range(many):
        out[i] = (
            w * (np.float32(a[i]) + np.float32(e[i])) + x * (np.float32(b[i]) + np.float32(d[i])) + y * np.float32(c[i])
        )


@njit(cache=True)
def _noisy(x, grain, read, slope):  # type: ignore[no-untyped-def]
    """Eight bits of x, UNIT times a grey level, plus noise whose variance is read + slope x times the grain's."""
    x = (x + np.float32(grain) * np.sqrt(read + slope * x)) * SCALE + HALF
    x = x if x > LOW else LOW
    return np.uint8(np.int32(x if x < HIGH else HIGH))


@njit(cache=True)
def _shown(line, gain, grain, shot, many, out):  # type: ignore[no-untyped-def]
    """Eight bits of gain times a line, plus noise, whose variance grows with light by the share `shot`."""
    read, slope = ONE - shot, shot * GREY
    for i in range(many):
        out[i] = _noisy(np.float32(line[i]) * gain, grain[i], read, slope)


@njit(cache=True)
def _shown_in_parts(line, gain, grain, shot, many, out):  # type: ignore[no-untyped-def]
    """As `_shown`, of gains (many,)."""
    read, slope = ONE - shot, shot * GREY
    for i in range(many):
        out[i] = _noisy(np.float32(line[i]) * gain[i], grain[i], read, slope)


@njit(cache=True)
def brightness(nodes, step, v, width, out):  # type: ignore[no-untyped-def]
    """out (W * 3,): the brightness of row v, linear between its nodes (J, I) at every `step`-th pixel."""
    y = (v + np.float32(0.5)) / np.float32(step)
    j = min(int(y), nodes.shape[0] - 2)
    b = np.float32(y - j)
    for i in range(nodes.shape[1] - 1):
        low = nodes[j, i] + b * (nodes[j + 1, i] - nodes[j, i])
        rise = (nodes[j, i + 1] + b * (nodes[j + 1, i + 1] - nodes[j, i + 1]) - low) / np.float32(step)
        for u in range(i * step, min((i + 1) * step, width)):
            bright = low + rise * (np.float32(u - i * step) + HALF)
            out[3 * u], out[3 * u + 1], out[3 * u + 2] = bright, bright, bright


@njit(cache=True)
def _blur_run(canvas, top, left, rows, cols, weights, edge, wide, out):  # type: ignore[no-untyped-def]
    """out (rows, cols * 3): blur from (top, left) on, edges repeated; edge, wide: scratch, a line and lines."""
    height, width = canvas.shape[0], canvas.shape[1] // 3
    radius, many = len(weights) // 2, 3 * cols
    inner = left >= radius and left + cols + radius <= width
    for r in range(rows + 2 * radius):
        v = min(max(top - radius + r, 0), height - 1)
        line = canvas[v, 3 * (left - radius) :] if inner else edge
        if not inner:
            for i in range(3 * (cols + 2 * radius)):
                edge[i] = canvas[v, 3 * min(max(left - radius + i // 3, 0), width - 1) + i % 3]
        if radius == 2:
            _five(line, line[3:], line[6:], line[9:], line[12:], weights[0], weights[1], weights[2], many, wide[r])
            continue
        for i in range(many):
            wide[r, i] = 0
        for k in range(2 * radius + 1):
            _add(line[3 * k :], weights[k], many, wide[r])
    for r in range(rows):
        if radius == 2:
            a, b, c, d, e = wide[r], wide[r + 1], wide[r + 2], wide[r + 3], wide[r + 4]
            _five(a, b, c, d, e, weights[0], weights[1], weights[2], many, out[r])
            continue
        for i in range(many):
            out[r, i] = 0
        for k in range(2 * radius + 1):
            _add(wide[r + k], weights[k], many, out[r])


@njit(cache=True)
def _scratch(radius, width):  # type: ignore[no-untyped-def]
    return (
        np.empty(3 * (width + 2 * radius), np.int16),
        np.empty((TILE_H + 2 * radius, 3 * width), np.float32),
        np.empty((TILE_H, 3 * width), np.float32),
    )


@njit(cache=True)
def blurred(canvas, weights, out):  # type: ignore[no-untyped-def]
    """out: the whole canvas (H, W * 3) int16 blurred."""
    height, width = canvas.shape[0], canvas.shape[1] // 3
    edge, wide, tile = _scratch(len(weights) // 2, width)
    for top in range(0, height, TILE_H):
        rows = min(TILE_H, height - top)
        _blur_run(canvas, top, 0, rows, width, weights, edge, wide, tile)
        for r in range(rows):
            for i in range(3 * width):
                out[top + r, i] = np.int16(tile[r, i] + HALF)


@njit(cache=True)
def finish(canvas, plate, dirty, weights, nodes, step, noise, shot, offsets, out):  # type: ignore[no-untyped-def]
    """The picture, out (H, W * 3) uint8: brightness times the blurred scene, plus noise.

    canvas (H, W * 3) int16: the sharp scene, of which only dirty tiles and their surroundings are read; plate: the
    blurred empty scene; weights (2 r + 1,) of the blur; nodes (J, I): brightness at every `step`-th pixel, or (1, 1)
    for one everywhere; noise (n,) int16, of which row v shows noise[offsets[v]:], and its share `shot`.
    """
    height, width = canvas.shape[0], canvas.shape[1] // 3
    edge, wide, tile = _scratch(len(weights) // 2, width)
    bright, even = np.empty((TILE_H, 3 * width), np.float32), nodes.size == 1
    for top in range(0, height, TILE_H):
        rows, marks = min(TILE_H, height - top), dirty[top // TILE_H]
        for r in range(0 if even else rows):
            brightness(nodes, step, top + r, width, bright[r])
        last = 0
        while last < width:  # runs of tiles, dirty or clean
            left, painted = last, marks[last // TILE_W]
            while last < width and marks[last // TILE_W] == painted:
                last += TILE_W
            cols = min(last, width) - left
            if painted:
                _blur_run(canvas, top, left, rows, cols, weights, edge, wide, tile)
            for r in range(rows):
                grain, to = noise[offsets[top + r] + 3 * left :], out[top + r, 3 * left :]
                line, gain, clean = tile[r], bright[r, 3 * left :], plate[top + r, 3 * left :]
                if even and painted:
                    _shown(line, nodes[0, 0], grain, shot, 3 * cols, to)
                elif even:
                    _shown(clean, nodes[0, 0], grain, shot, 3 * cols, to)
                elif painted:
                    _shown_in_parts(line, gain, grain, shot, 3 * cols, to)
                else:
                    _shown_in_parts(clean, gain, grain, shot, 3 * cols, to)


@njit(cache=True)
def _copy(line, many, out):  # type: ignore[no-untyped-def]
    for i in range(many):
        out[i] = line[i]


@njit(cache=True)
def wipe(dirty, plate, background, canvas, depth, taken):  # type: ignore[no-untyped-def]
    """Make the dirty tiles of canvas (H, W * 3), depth (H, W) and taken (H, W) those of the empty scene, and clean."""
    height, width = depth.shape
    for j in range(dirty.shape[0]):
        last = 0
        while last < dirty.shape[1]:  # runs of dirty tiles
            first = last
            while last < dirty.shape[1] and dirty[j, last]:
                dirty[j, last] = 0
                last += 1
            left, many = first * TILE_W, min(last * TILE_W, width) - first * TILE_W
            last += last == first
            for v in range(j * TILE_H, min((j + 1) * TILE_H, height)):
                _copy(plate[v, 3 * left :], 3 * many, canvas[v, 3 * left :])
                _copy(background[v, left:], many, depth[v, left:])
                taken[v, left : left + many] = 0
