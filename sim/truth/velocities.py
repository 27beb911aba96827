"""Velocities of people from their positions, by differences over a window of time (default 0.5 s).

`differentiate` is for labels, and looks half the window ahead. `chords` is for tracks, and looks back only. The unit is
that of the positions per second.
"""

from __future__ import annotations

import numpy as np

from sim.truth.merge_split_rules import frames_of
from sim.types import Array, Ints

WINDOW = 0.5  # s, length of the time window
# s, that of labelled boxes: they rest for some frames and then jump by pixels, which shorter windows pick up
CHORD = 1.0


def differentiate(frame: Ints, id: Ints, pos: Array, fps: float, window: float = WINDOW) -> Array:
    """Returns the velocity of each row (R, D), in the unit of `pos` per s: a difference over a centred window.

    frame, id (R,), pos (R, D): rows in any order, each id once in a frame. window: s. The velocity is 0 if an id
    has only one row in the window, nan if a position used is nan.
    """
    half = max(1, round(window * fps / 2))
    return _chords(frame, id, pos, fps, half, half, 0.0)


def chords(frame: Ints, id: Ints, pos: Array, fps: float, window: float = WINDOW) -> Array:
    """Returns the velocity of each row (R, D): displacement since the id's earliest row in the last `window` s, over
    time.

    frame, id (R,), pos (R, D): rows in any order, each id once in a frame. nan without an earlier row within the
    window.
    """
    return _chords(frame, id, pos, fps, frames_of(window, fps), 0, np.nan)


class RecentChords:
    """The velocities of `chords`, of rows that are added frame by frame. State: frame, id, pos, rows of the last 0.5
    s."""

    def __init__(self, fps: float, dims: int = 2) -> None:
        self.fps, self.frames = fps, frames_of(WINDOW, fps)
        self.frame, self.id = np.zeros((2, 0), np.int64)
        self.pos = np.zeros((0, dims))

    def add(self, frame: Ints, id: Ints, pos: Array) -> Array:
        """Returns the velocities (R, D) of rows of the next frames; arguments as of `chords`, frames ascending."""
        old = len(self.frame)
        frame, id, pos = np.append(self.frame, frame), np.append(self.id, id), np.concatenate([self.pos, pos])
        recent = frame > frame[-1] - self.frames if len(frame) else np.zeros(0, bool)
        self.frame, self.id, self.pos = frame[recent], id[recent], pos[recent]
        return chords(frame, id, pos, self.fps)[old:]


def _chords(frame: Ints, id: Ints, pos: Array, fps: float, back: int, ahead: int, alone: float) -> Array:
    """Returns the velocities from the id's first to its last row within `back` and `ahead` frames of each row."""
    order = np.lexsort((frame, id))
    f, rank = frame[order], np.unique(id[order], return_inverse=True)[1]
    # Keys of two people are further apart than a window, so one search serves all.
    key = rank * (int(f.max(initial=0)) + back + ahead + 2) + f
    first, last = np.searchsorted(key, key - back), np.searchsorted(key, key + ahead, side="right") - 1
    steps = f[last] - f[first]
    chord = (pos[order][last] - pos[order][first]) * fps / np.maximum(steps, 1)[:, None]
    out = np.empty_like(pos)
    out[order] = np.where(steps[:, None] > 0, chord, alone)
    return out
