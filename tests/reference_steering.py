"""The forces between people and from walls, slow and obvious: loops over all pairs, formulas as in the docstrings."""

from __future__ import annotations

import numpy as np

from sim.steering import Steering
from sim.types import Array, Ints


def power_law(d: Array, w: Array, radius: float, strength: float, horizon: float, cap: float) -> Array:
    """Karamouzas 2014: minus the gradient of strength * exp(-tau / horizon) / tau^2, capped; d = self - other."""
    a, b, c = w @ w, -(d @ w), d @ d - radius**2
    squared = a * radius**2 - (d[0] * w[1] - d[1] * w[0]) ** 2
    if a < 1e-6 or c <= 0 or b <= 0 or squared <= 1e-12:
        return np.zeros(2)
    root = np.sqrt(squared)
    tau = (b - root) / a
    if tau <= 0 or tau > 4 * horizon:
        return np.zeros(2)
    tau = max(tau, 0.05)
    f = -strength * np.exp(-tau / horizon) / (a * tau**2) * (2 / tau + 1 / horizon) * (w - (b * w + a * d) / root)
    return np.asarray(f * min(1.0, cap / max(np.linalg.norm(f), 1e-12)))


def between_people(state: Array, tag: Ints, s: Steering) -> Array:
    """Separation within groups and queues, avoidance and shoving between strangers, (N, 2)."""
    out = np.zeros((len(state), 2))
    for i in range(len(state)):
        for j in range(len(state)):
            d = state[i, :2] - state[j, :2]
            distance = np.linalg.norm(d)
            if i == j or distance >= s.person_range:
                continue
            if tag[i, 0] == tag[j, 0]:
                reach, strength = s.separation_range, s.separation
            elif tag[i, 2] >= 0 and tag[i, 2] == tag[j, 2]:
                reach, strength = 0.5, s.separation
            elif distance < 2 * s.person_radius:
                reach, strength = 2 * s.person_radius, s.shove
            else:
                w = state[i, 2:] - state[j, 2:]
                out[i] += power_law(d, w, 2 * s.person_radius, s.avoid_person, s.avoid_time, s.avoid_max)
                continue
            out[i] += strength * max(0.0, 1 - distance / reach) * d / distance
    return out
