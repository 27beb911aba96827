"""Frames with points on the ground, and what a tracker makes of them."""

from __future__ import annotations

import numpy as np

from sim.types import Context, Detections, Frame

FPS = 10.0


def detections(index, points, fps=FPS):
    pos = np.array(points, float).reshape(-1, 2)
    return Detections(index, (index - 1) / fps, "ground", pos, None, None, np.ones(len(pos)))


def stepped(tracker, frames, seed=0, fps=FPS):
    """The tracks of frames given as lists of points, None for a frame without information."""
    tracker.reset(Context(fps, float("nan")), seed)
    given = (None if points is None else detections(k, points, fps) for k, points in enumerate(frames, 1))
    return [tracker.step(Frame(k, (k - 1) / fps), found) for k, found in enumerate(given, 1)]
