"""Compiled finish of an image: blur of what was drawn, brightness, noise, rounding to eight bits.

Input: a canvas in int16, BGR grey levels times UNIT = 64. Output: the image in uint8. Inner loops run over whole rows
from index 0, so that the compiler can use vector instructions.
"""

from __future__ import annotations

import numpy as np

from sim.compiler import njit
from sim.render.canvas import MID_GREY, TILE_H, TILE_W, UNIT

SCALE, HALF, LOW, HIGH = np.float32(1.0 / UNIT), np.float32(0.5), np.float32(0.0), np.float32(255.0)
ONE, GREY = np.float32(1.0), np.float32(1.0 / (MID_GREY * UNIT))


@njit(cache=True)
def _add_line(line, weight, many, out):  # type: ignore[no-untyped-def]
    """Adds weight times the first `many` numbers of line to out."""
    for i in range(many):
        out[i] += weight * np.float32(line[i])


@njit(cache=True)
def _blur_five_lines(a, b, c, d, e, w, x, y, many, out):  # type: ignore[no-untyped-def]
    """Sets out to the blur of radius 2, the usual one: w a + x b + y c + x d + w e."""
    for i in range(many):
        out[i] = (
            w * (np.float32(a[i]) + np.float32(e[i])) + x * (np.float32(b[i]) + np.float32(d[i])) + y * np.float32(c[i])
        )


@njit(cache=True)
# At MID_GREY the noise has the standard deviation of the pool: read + slope x is 1 there.
def _with_noise(x, grain, read, slope):  # type: ignore[no-untyped-def]
    """Returns the grey level of canvas value x with the noise grain * sqrt(read + slope x)."""
    x = (x + np.float32(grain) * np.sqrt(read + slope * x)) * SCALE + HALF
    x = x if x > LOW else LOW
    return np.uint8(np.int32(x if x < HIGH else HIGH))


@njit(cache=True)
def _show_line(line, gain, lift, grain, shot, many, out):  # type: ignore[no-untyped-def]
    """Sets out to a line of canvas values times gain (many,), plus lift, plus noise, as grey levels."""
    read, slope = ONE - shot, shot * GREY
    for i in range(many):
        out[i] = _with_noise(np.float32(line[i]) * gain[i] + lift, grain[i], read, slope)


@njit(cache=True)
def brightness_row(nodes, step, v, width, cast, out):  # type: ignore[no-untyped-def]
    """Sets out to the brightness of image row v times cast (3,), B, G, R per pixel, linear between nodes (J, I)."""
    y = (v + np.float32(0.5)) / np.float32(step)
    j = min(int(y), nodes.shape[0] - 2)
    b = np.float32(y - j)
    for i in range(nodes.shape[1] - 1):
        low = nodes[j, i] + b * (nodes[j + 1, i] - nodes[j, i])
        rise = (nodes[j, i + 1] + b * (nodes[j + 1, i + 1] - nodes[j, i + 1]) - low) / np.float32(step)
        for u in range(i * step, min((i + 1) * step, width)):
            bright = low + rise * (np.float32(u - i * step) + HALF)
            out[3 * u], out[3 * u + 1], out[3 * u + 2] = bright * cast[0], bright * cast[1], bright * cast[2]


@njit(cache=True)
def _blur_block(canvas, top, left, rows, cols, weights, edge, wide, out):  # type: ignore[no-untyped-def]
    """Sets out (rows, 3 cols) to the blur of a block of at most TILE_H rows; edge, wide: scratch."""
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
            _blur_five_lines(
                line, line[3:], line[6:], line[9:], line[12:], weights[0], weights[1], weights[2], many, wide[r]
            )
            continue
        for i in range(many):
            wide[r, i] = 0
        for k in range(2 * radius + 1):
            _add_line(line[3 * k :], weights[k], many, wide[r])
    for r in range(rows):
        if radius == 2:
            a, b, c, d, e = wide[r], wide[r + 1], wide[r + 2], wide[r + 3], wide[r + 4]
            _blur_five_lines(a, b, c, d, e, weights[0], weights[1], weights[2], many, out[r])
            continue
        for i in range(many):
            out[r, i] = 0
        for k in range(2 * radius + 1):
            _add_line(wide[r + k], weights[k], many, out[r])


@njit(cache=True)
def _scratch(radius, width):  # type: ignore[no-untyped-def]
    """Returns scratch for `_blur_block`: a padded line, lines blurred across, and TILE_H lines for its result."""
    return (
        np.empty(3 * (width + 2 * radius), np.int16),
        np.empty((TILE_H + 2 * radius, 3 * width), np.float32),
        np.empty((TILE_H, 3 * width), np.float32),
    )


@njit(cache=True)
def blur_all(canvas, weights, out):  # type: ignore[no-untyped-def]
    """Sets out (H, 3 W) int16 to the blur of the whole canvas (H, 3 W) int16, whose edges repeat."""
    height, width = canvas.shape[0], canvas.shape[1] // 3
    edge, wide, tile = _scratch(len(weights) // 2, width)
    for top in range(0, height, TILE_H):
        rows = min(TILE_H, height - top)
        _blur_block(canvas, top, 0, rows, width, weights, edge, wide, tile)
        for r in range(rows):
            for i in range(3 * width):
                out[top + r, i] = np.int16(tile[r, i] + HALF)


@njit(cache=True)
def finish_image(  # type: ignore[no-untyped-def]
    canvas, empty, dirty, weights, nodes, step, cast, lift, noise, shot, offsets, out
):
    """Sets out (H, 3 W) uint8 to the image: the blurred canvas times brightness, plus noise, clipped to 0 … 255.

    canvas (H, 3 W) int16: the sharp scene. empty (H, 3 W) int16: the blurred empty scene, for clean tiles. dirty: tiles
    to blur anew. nodes (J, I): brightness at every `step`-th pixel, (1, 1) if it is the same everywhere. cast (3,):
    further factors of B, G, R. lift: added to all, grey levels times UNIT. noise: the
    pool, which row v reads from offsets[v] on. shot: share of the noise's variance that grows with brightness.
    """
    height, width = canvas.shape[0], canvas.shape[1] // 3
    edge, wide, tile = _scratch(len(weights) // 2, width)
    bright, uniform = np.empty((TILE_H, 3 * width), np.float32), nodes.size == 1
    for i in range(3 * width):
        bright[:, i] = nodes[0, 0] * cast[i % 3]
    for top in range(0, height, TILE_H):
        rows, marks = min(TILE_H, height - top), dirty[top // TILE_H]
        for r in range(0 if uniform else rows):
            brightness_row(nodes, step, top + r, width, cast, bright[r])
        last = 0
        while last < width:  # runs of tiles, dirty or clean
            left, drawn = last, marks[last // TILE_W]
            while last < width and marks[last // TILE_W] == drawn:
                last += TILE_W
            cols = min(last, width) - left
            if drawn:
                _blur_block(canvas, top, left, rows, cols, weights, edge, wide, tile)
            for r in range(rows):
                grain, to = noise[offsets[top + r] + 3 * left :], out[top + r, 3 * left :]
                gain = bright[r, 3 * left :]
                if drawn:
                    _show_line(tile[r], gain, lift, grain, shot, 3 * cols, to)
                else:
                    _show_line(empty[top + r, 3 * left :], gain, lift, grain, shot, 3 * cols, to)
