"""Boxes of upright people for trackers that answer on the ground: a cylinder 1.70 m high and 0.50 m across."""

from __future__ import annotations

import numpy as np

from sim.types import Array, Camera

HEIGHT = 1.70  # m
WIDTH = 0.50  # m


def upright_boxes(camera: Camera, pos: Array) -> Array:
    """(N, 4) ltwh px of cylinders standing at pos (N, 3) m, or on flat ground at (N, 2); nan behind the camera."""
    from sim.scene.camera import project

    angle = np.arange(16) * (np.pi / 8)
    rim = WIDTH / 2 * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    rim = np.concatenate([np.c_[rim, np.zeros(16)], np.c_[rim, np.full(16, HEIGHT)]])
    foot = pos if pos.shape[1] == 3 else np.concatenate([pos, np.zeros((len(pos), 1))], axis=1)
    uv, depth = project(camera, (foot[:, None] + rim).reshape(-1, 3))
    uv = np.where((depth > 0)[:, None], uv, np.nan).reshape(len(pos), 32, 2)
    low, high = uv.min(axis=1), uv.max(axis=1)
    return np.concatenate([low, high - low], axis=1)
