"""Computes velocities from positions by differences over a window of time (default 0.5 s).

`differentiate` is for labels, and looks half the window ahead. `chords` is for tracks, and looks back only. The unit is
that of the positions per second.
"""

from __future__ import annotations

import numpy as np

from sim.truth.merge_split_rules import frames_of
from sim.types import Array, Ints

WINDOW = 0.5  # s, length of the time window


def differentiate(frame: Ints, id: Ints, pos: Array, fps: float, window: float = WINDOW) -> Array:
    """Returns the velocity of each row (R, D), in the unit of `pos` per s: a difference over a centred window.

    frame, id (R,), pos (R, D): rows in any order, each id once in a frame. window: s. 0 where an id has one row there,
    nan if one of the two positions is.
    """
    if len(frame) == 0:
        return np.zeros_like(pos)
    half = max(1, round(window * fps / 2))
    order = np.lexsort((frame, id))
    f, rank = frame[order], np.unique(id[order], return_inverse=True)[1]
    # Keys of two people are further apart than a window, so one search serves all.
    stride = int(f.max() - f.min()) + 2 * half + 2
    key = rank * stride + (f - f.min()) + half
    first = np.searchsorted(key, key - half, side="left")
    last = np.searchsorted(key, key + half, side="right") - 1
    frames = f[last] - f[first]
    chord = pos[order][last] - pos[order][first]
    vel = np.empty_like(pos)
    vel[order] = np.where(frames[:, None] > 0, chord * fps / np.maximum(frames, 1)[:, None], 0.0)
    return vel


def chords(frame: Ints, id: Ints, pos: Array, fps: float, window: float = WINDOW) -> Array:
    """Returns the velocity of each row (R, D): the chord from the id's earliest row of the last `window` s to the row.

    frame, id (R,), pos (R, D): rows in any order, each id once in a frame. nan without an earlier row within the
    window.
    """
    order = np.lexsort((frame, id))
    rank = np.unique(id[order], return_inverse=True)[1]
    f, span = frame[order], frames_of(window, fps)
    key = rank * (int(f.max(initial=0)) + span + 2) + f
    first = np.searchsorted(key, key - span)
    steps = f - f[first]
    out = np.empty_like(pos)
    chord = (pos[order] - pos[order][first]) * fps / np.maximum(steps, 1)[:, None]
    out[order] = np.where(steps[:, None] > 0, chord, np.nan)
    return out
