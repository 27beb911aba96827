"""People who walk in twos, as boxes before a camera that looks down on them."""

from __future__ import annotations

import numpy as np

from sim.scene.camera import camera_rotation, project
from sim.types import Camera, Tracks, Truth
from tests import hand_made

LOOK = camera_rotation(0.5, 0.0)
CAMERA = Camera("pinhole", (640, 480), (500.0, 500.0), (320.0, 240.0), np.array([8.0, -8.0, 6.0]), LOOK)


def place(*ys: float) -> Truth:
    """Two people in each row y who walk to the right for 8 s, one metre apart across the view of the camera."""
    at = [(4.0 + p, y) for y in ys for p in range(2)]
    scenes = [hand_made.Scene({p: (x + 0.1 * k, y) for p, (x, y) in enumerate(at, 1)}) for k in range(80)]
    return hand_made.truth(scenes, name="two")


def boxed(truth: Truth) -> list[Tracks]:
    """The people as tracks of boxes in the image, 1.70 m high."""
    found = []
    for k in range(1, truth.length + 1):
        now = truth.at(k)
        low, high = (project(CAMERA, np.c_[now.pos, np.full(len(now.id), z)])[0] for z in (0.0, 1.7))
        size = low[:, 1] - high[:, 1]
        box = np.c_[high[:, 0] - size / 6, high[:, 1], size / 3, size]
        none, pos = np.full(len(now.id), -1), box[:, :2] + box[:, 2:] / 2
        cov, vel = np.tile(np.eye(4), (len(now.id), 1, 1)), np.full_like(pos, np.nan)
        found.append(Tracks(k, now.t, "image", "person", now.id, none, pos, vel, cov, box, np.ones(len(now.id))))
    return found
