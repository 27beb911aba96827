"""The direction in which each person faces, for a whole motion of C ticks and P people.

It is computed from positions, velocities, presence and groups. People who walk (0.25 m/s or faster) turn towards their
velocity; people who stand turn towards the middle of their group. A person who stands alone keeps the direction.
"""

from __future__ import annotations

import numpy as np

from sim.elementary import atan2, length
from sim.types import Array, Bools, Ints

WALKING_SPEED = 0.25  # m/s: slower people turn to their group
TURN_TIME = 0.3  # s


def facings(pos: Array, vel: Array, present: Bools, intent: Ints, rate: float) -> Array:
    """Returns the vector in which each person faces at each tick (C, P, 2), nan while absent.

    pos, vel (C, P, 2): m, m/s. present (C, P). intent (C, P): group index, -1 while absent. rate: ticks per s. In each
    tick the vector moves by the share 1 / (rate TURN_TIME) towards the wanted unit vector, so it may be shorter than 1.
    """
    out = np.full((*present.shape, 2), np.nan)
    facing = np.zeros((present.shape[1], 2))
    share = min(1.0, 1 / (rate * TURN_TIME))
    for t in range(len(present)):
        here = present[t]
        wanted = np.where(here[:, None], vel[t], 0.0)
        slow = here & (length(wanted) < WALKING_SPEED)
        if slow.any():
            wanted[slow] = _towards_group(pos[t], intent[t], slow, facing)
        size = length(wanted)[:, None]
        wanted = np.divide(wanted, size, out=np.zeros_like(wanted), where=size > 1e-9)
        fresh = here & ~facing.any(axis=1)
        facing[fresh] = np.where(wanted[fresh].any(axis=1, keepdims=True), wanted[fresh], [1.0, 0.0])
        facing = np.where(here[:, None], facing + share * (wanted - facing) * wanted.any(axis=1, keepdims=True), facing)
        out[t, here] = facing[here]
    return out


def headings(facing: Array) -> Array:
    """Returns the angles (...) of vectors (..., 2), radians counter-clockwise from +x."""
    return np.asarray(atan2(facing[..., 1], facing[..., 0]))


def _towards_group(pos: Array, intent: Ints, slow: Bools, facing: Array) -> Array:
    """Returns vectors (K, 2) from the slow people to the middle of their group; alone: the present facing."""
    here = intent >= 0
    groups = np.where(here, intent, 0)
    n = int(groups.max()) + 1
    count = np.bincount(groups[here], minlength=n)
    total = np.stack([np.bincount(groups[here], pos[here, k], minlength=n) for k in (0, 1)], 1)
    middle = total / np.maximum(count, 1)[:, None]
    alone = count[groups[slow]] < 2
    return np.asarray(np.where(alone[:, None], facing[slow], middle[groups[slow]] - pos[slow]))
