"""Keyed random streams: one generator per (seed, role, keys), so that an extra draw changes no other stream."""

from __future__ import annotations

import numpy as np

# Every stored hash depends on these numbers: add at the end, never change one.
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
    """Return the generator over `SeedSequence(seed, spawn_key=(ROLE[role], *keys))`.

    The same arguments give the same numbers. role: a key of ROLE, else KeyError. keys: what the stream belongs to, as a
    person's id or a frame; non-negative. repeat: the n of a suite's entry `name-n`; 1,000,000 + repeat is a further key
    unless repeat is 0.
    """
    spawn_key = (ROLE[role], *keys) if repeat == 0 else (ROLE[role], *keys, 1_000_000 + repeat)
    return np.random.default_rng(np.random.SeedSequence(seed, spawn_key=spawn_key))
