"""Keyed random streams: one generator per (seed, role, keys), so that one draw more moves nobody else."""

from __future__ import annotations

import numpy as np

# Numbers are part of every stored hash: add at the end, never change one.
ROLE = {
    "layout": 0,
    "group": 1,
    "person": 2,
    "event": 3,
    "service": 4,
    "gait": 5,
    "detect": 6,
    "clutter": 7,
    "texture": 8,
    "light": 9,
    "noise": 10,
    "tracker": 11,
    "camera": 12,
    "wind": 13,
    "label": 14,
}


def rng(seed: int, role: str, *keys: int, repeat: int = 0) -> np.random.Generator:
    """A generator over `SeedSequence(seed, spawn_key=(ROLE[role], *keys))`.

    `repeat` (the n of a suite's `name-n`) is one more key where it is not zero. Keys are non-negative.
    """
    spawn_key = (ROLE[role], *keys) if repeat == 0 else (ROLE[role], *keys, 1_000_000 + repeat)
    return np.random.default_rng(np.random.SeedSequence(seed, spawn_key=spawn_key))
