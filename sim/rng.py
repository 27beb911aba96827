"""Keyed random streams: each combination of seed, role and keys (such as a person's number) has a generator of its own.

An additional draw from one stream therefore changes no other stream.
"""

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
    "delivery": 15,
}


def rng(seed: int, role: str, *keys: int, repeat: int = 0) -> np.random.Generator:
    """Return the numpy Generator over `SeedSequence(seed, spawn_key=(ROLE[role], *keys))`.

    The same arguments give a generator of the same numbers. seed: 0 or more. role: a key of ROLE, as "layout",
    "person", "noise" or "tracker". keys: what the stream belongs to, as a person's id or a frame, each 0 or more, in
    any number. Streams of equal role and keys are equal, so each use needs keys of its own. repeat:
    number of the suite entry's copy, from 1; 0 without copies. A repeat other than 0 adds 1,000,000 + repeat as a last
    key.

    Raises KeyError for an unknown role, ValueError for a negative seed or key.
    """
    spawn_key = (ROLE[role], *keys) if repeat == 0 else (ROLE[role], *keys, 1_000_000 + repeat)
    return np.random.default_rng(np.random.SeedSequence(seed, spawn_key=spawn_key))
