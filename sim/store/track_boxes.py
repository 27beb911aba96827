"""The boxes of stored tracks: the tracker's own if it gives any, else projections of upright people, if that can be."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal

import numpy as np

from sim.scene.body import PERSON_HEIGHT
from sim.types import Array, Camera, Tracks

WIDTH = 0.50  # m, diameter of the upright cylinder


def box_source(tracks: Sequence[Tracks], camera: Camera | None) -> Literal["measured", "projected", "none"]:
    """Returns the source of the boxes in stored tracks, as run.json names it under "boxes".

    "measured": the tracker gives boxes. "projected": people get upright boxes by the camera. "none": neither.
    """
    if any(t.box is not None and len(t.id) for t in tracks):
        return "measured"
    upright = not any(t.plane == "image" or t.unit == "group" for t in tracks)
    return "projected" if camera is not None and upright else "none"


def upright_boxes(camera: Camera, pos: Array) -> Array:
    """Returns the boxes (N, 4), left, top, width, height in px, of people at `pos` (N, 2 or 3) m.

    A person is 1.7 m tall and 0.5 m across. Not clipped to the image; nan for a person who is partly behind the camera,
    and for a nan position.
    """
    from sim.scene.camera import project

    angle = np.arange(16) * (np.pi / 8)
    rim = WIDTH / 2 * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    rim = np.concatenate([np.c_[rim, np.zeros(16)], np.c_[rim, np.full(16, PERSON_HEIGHT)]])
    foot = pos if pos.shape[1] == 3 else np.concatenate([pos, np.zeros((len(pos), 1))], axis=1)
    uv, depth = project(camera, (foot[:, None] + rim).reshape(-1, 3))
    uv = np.where((depth > 0)[:, None], uv, np.nan).reshape(len(pos), 32, 2)
    low, high = uv.min(axis=1), uv.max(axis=1)
    return np.concatenate([low, high - low], axis=1)
