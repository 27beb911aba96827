"""Which way people face: along their velocity while they walk, towards their group while they stand."""

from __future__ import annotations

import numpy as np

from sim.types import Array, Bools, Ints

WALKING_SPEED = 0.25  # m/s: slower people turn to their group
TURN_TIME = 0.3  # s


def headings(pos: Array, vel: Array, present: Bools, intent: Ints, fps: float) -> Array:
    """Returns where each person faces in each frame, shape (T, P), radians from +x, nan while absent.

    pos, vel (T, P, 2): m, m/s; present (T, P); intent (T, P): group index, -1 while absent. A heading follows the
    wanted direction with time constant TURN_TIME. A slow person who is alone keeps the heading. A person who enters
    faces the wanted direction at once, +x if there is none.
    """
    out = np.full(present.shape, np.nan)
    facing = np.zeros((present.shape[1], 2))
    share = min(1.0, 1 / (fps * TURN_TIME))
    for t in range(len(present)):
        here = present[t]
        wanted = np.where(here[:, None], vel[t], 0.0)
        slow = here & (np.hypot(wanted[:, 0], wanted[:, 1]) < WALKING_SPEED)
        if slow.any():
            wanted[slow] = _towards_group(pos[t], intent[t], slow, facing)
        size = np.linalg.norm(wanted, axis=1, keepdims=True)
        wanted = np.divide(wanted, size, out=np.zeros_like(wanted), where=size > 1e-9)
        fresh = here & ~facing.any(axis=1)
        facing[fresh] = np.where(wanted[fresh].any(axis=1, keepdims=True), wanted[fresh], [1.0, 0.0])
        facing = np.where(here[:, None], facing + share * (wanted - facing) * wanted.any(axis=1, keepdims=True), facing)
        out[t, here] = np.arctan2(facing[here, 1], facing[here, 0])
    return out


def _towards_group(pos: Array, intent: Ints, slow: Bools, facing: Array) -> Array:
    """Directions (K, 2) from the K slow people to the middle of their group; of people alone, their present facing."""
    here = intent >= 0
    groups = np.where(here, intent, 0)
    n = int(groups.max()) + 1
    count = np.bincount(groups[here], minlength=n)
    total = np.stack([np.bincount(groups[here], pos[here, k], minlength=n) for k in (0, 1)], 1)
    middle = total / np.maximum(count, 1)[:, None]
    alone = count[groups[slow]] < 2
    return np.asarray(np.where(alone[:, None], facing[slow], middle[groups[slow]] - pos[slow]))
