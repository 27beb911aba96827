"""Compiled: from a canvas to a picture: blur where something was painted, brightness, noise, eight bits."""

from __future__ import annotations

import numpy as np
from numba import njit

from sim.paint_kernels import TILE_H, TILE_W, UNIT


@njit(cache=True)
def _blur_tile(canvas, top, left, rows, cols, weights, wide, out):  # type: ignore[no-untyped-def]
    """out (rows, cols * 3): the tile's separable blur, edges repeated; wide: scratch of rows + 2 radius rows."""
    height, width = canvas.shape[0], canvas.shape[1] // 3
    radius = len(weights) // 2
    inner = left >= radius and left + cols + radius <= width
    for r in range(rows + 2 * radius):
        line, to = canvas[min(max(top - radius + r, 0), height - 1)], wide[r]
        if inner:
            to[: 3 * cols] = np.float32(0.0)
            for k in range(2 * radius + 1):
                w, shift = weights[k], 3 * (left - radius + k)
                for i in range(3 * cols):
                    to[i] += w * np.float32(line[shift + i])
            continue
        for c in range(cols):
            for ch in range(3):
                total = np.float32(0.0)
                for k in range(2 * radius + 1):
                    total += weights[k] * np.float32(line[3 * min(max(left + c - radius + k, 0), width - 1) + ch])
                to[3 * c + ch] = total
    for r in range(rows):
        out[r, : 3 * cols] = np.float32(0.0)
        for k in range(2 * radius + 1):
            w = weights[k]
            for i in range(3 * cols):
                out[r, i] += w * wide[r + k, i]


@njit(cache=True)
def blurred(canvas, weights, out):  # type: ignore[no-untyped-def]
    """out: the whole canvas (H, W * 3) int16 blurred."""
    height, width = canvas.shape[0], canvas.shape[1] // 3
    radius = len(weights) // 2
    wide, tile = np.empty((TILE_H + 2 * radius, 3 * TILE_W), np.float32), np.empty((TILE_H, 3 * TILE_W), np.float32)
    for top in range(0, height, TILE_H):
        for left in range(0, width, TILE_W):
            rows, cols = min(TILE_H, height - top), min(TILE_W, width - left)
            _blur_tile(canvas, top, left, rows, cols, weights, wide, tile)
            for r in range(rows):
                for i in range(3 * cols):
                    out[top + r, 3 * left + i] = np.int16(tile[r, i] + np.float32(0.5))


@njit(cache=True)
def finish(canvas, plate, dirty, weights, gain, noise, offsets, out):  # type: ignore[no-untyped-def]
    """The picture, out (H, W * 3) uint8: gain times the blurred scene, plus noise.

    canvas (H, W * 3) int16: the sharp scene, of which only dirty tiles and their surroundings are read; plate: the
    blurred empty scene; weights (2 r + 1,) of the blur; noise (n,) int16, of which row v shows noise[offsets[v]:].
    """
    height, width = canvas.shape[0], canvas.shape[1] // 3
    radius = len(weights) // 2
    wide, tile = np.empty((TILE_H + 2 * radius, 3 * TILE_W), np.float32), np.empty((TILE_H, 3 * TILE_W), np.float32)
    scale, half, low, high = np.float32(1.0 / UNIT), np.float32(0.5), np.float32(0.0), np.float32(255.0)
    for top in range(0, height, TILE_H):
        rows = min(TILE_H, height - top)
        for r in range(rows):
            source, grain, to = plate[top + r], noise[offsets[top + r] :], out[top + r]
            for i in range(3 * width):
                x = (np.float32(source[i]) * gain + np.float32(grain[i])) * scale + half
                x = x if x > low else low
                to[i] = np.uint8(np.int32(x if x < high else high))
        for left in range(0, width, TILE_W):
            if not dirty[top // TILE_H, left // TILE_W]:
                continue
            cols = min(TILE_W, width - left)
            _blur_tile(canvas, top, left, rows, cols, weights, wide, tile)
            for r in range(rows):
                source, grain, to = tile[r], noise[offsets[top + r] + 3 * left :], out[top + r, 3 * left :]
                for i in range(3 * cols):
                    x = (source[i] * gain + np.float32(grain[i])) * scale + half
                    x = x if x > low else low
                    to[i] = np.uint8(np.int32(x if x < high else high))
