"""Velocities of positions that were stored without any."""

from __future__ import annotations

import numpy as np

from sim.types import Array, Ints

WINDOW = 0.5  # s


def differentiate(frame: Ints, id: Ints, pos: Array, fps: float, window: float = WINDOW) -> Array:
    """(R, D) velocity per second: the chord over the frames of the same id within `window` seconds round each row.

    Rows in any order, ids unique in a frame. 0 where an id has no second row in the window.
    """
    if len(frame) == 0:
        return np.zeros_like(pos)
    half = max(1, round(window * fps / 2))
    order = np.lexsort((frame, id))
    f, rank = frame[order], np.unique(id[order], return_inverse=True)[1]
    stride = int(f.max() - f.min()) + 2 * half + 2
    key = rank * stride + (f - f.min()) + half
    first = np.searchsorted(key, key - half, side="left")
    last = np.searchsorted(key, key + half, side="right") - 1
    frames = f[last] - f[first]
    chord = pos[order][last] - pos[order][first]
    vel = np.empty_like(pos)
    vel[order] = np.where(frames[:, None] > 0, chord * fps / np.maximum(frames, 1)[:, None], 0.0)
    return vel
