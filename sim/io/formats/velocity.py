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
    """Return the velocity of each row, (R, D), in the unit of `pos` per s, in the order of the rows.

    A row's velocity is the difference between the last and the first position of its id inside the window, divided by
    the time between them. It is 0 if the id has no other row there, nan if one of the two positions is nan. frame, id
    (R,), pos (R, D) float: rows in any order, each id once in a frame. fps: frames per second. window: length in s,
    default 0.5, centred on the row. Half of it is rounded to whole frames, at least one, to each side; both end frames
    count. Without rows the result has none.
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


def chords(frame: Ints, id: Ints, pos: Array, fps: float, window: float = WINDOW) -> Array:
    """Return the velocity of each row, (R, D), in the unit of `pos` per s: the chord from the id's earliest row within
    the last `window` s to the row.

    frame, id (R,), pos (R, D): rows in any order, each id once in a frame. fps: frames per second; the window is
    rounded up to whole frames, at least 1. nan in an id's first row and where it has no other row within the window.
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
