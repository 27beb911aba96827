"""What people avoid, slow and obvious: loops over all pairs of people, groups, people and things."""

from __future__ import annotations

import numpy as np

from sim.crowd import forces as s
from sim.crowd.forces import AVOIDED, COUNT, MEAN_VX, MEAN_VY, MEAN_X, MEAN_Y, PROCESSION, QUEUE, RADIUS
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


def giving_way(d: Array, v: Array, other: Array) -> Array:
    """What a stranger does to a person of velocity v from whom they are -d away, and walk with velocity `other`."""
    distance, speed = max(np.linalg.norm(d), 1e-9), max(np.linalg.norm(v), 0.6)
    ahead, along, left = -(v @ d) / distance / speed, v / speed, np.array([-v[1], v[0]]) / speed
    if ahead <= 0:
        return np.zeros(2)
    if v @ other > 0:
        return np.asarray(-s.SLOWING * max(0.0, s.ROOM_AHEAD - distance) * ahead * along)
    if (v - other) @ d >= 0:
        return np.zeros(2)
    side = 1 if left @ d > 0.1 * distance else -1
    return np.asarray(side * s.EVADING * (s.PERSON_RANGE - distance) * ahead * left)


def between_people(state: Array, tag: Ints) -> Array:
    """Separation within groups, processions and queues, avoidance and shoving between strangers, (N, 2)."""
    out = np.zeros((len(state), 2))
    for i in range(len(state)):
        for j in range(len(state)):
            d = state[i, :2] - state[j, :2]
            distance = np.linalg.norm(d)
            if i == j or distance >= s.PERSON_RANGE:
                continue
            if tag[i, PROCESSION] == tag[j, PROCESSION]:
                reach, strength = s.SEPARATION_RANGE, s.SEPARATION
            elif tag[i, QUEUE] >= 0 and tag[i, QUEUE] == tag[j, QUEUE]:
                reach, strength = 0.5, s.SEPARATION
            elif distance < 2 * s.PERSON_RADIUS:
                out[i] += giving_way(d, state[i, 2:], state[j, 2:])
                reach, strength = 2 * s.PERSON_RADIUS, s.SHOVE
            else:
                w = state[i, 2:] - state[j, 2:]
                out[i] += giving_way(d, state[i, 2:], state[j, 2:])
                out[i] += power_law(d, w, 2 * s.PERSON_RADIUS, s.AVOID_PERSON, s.AVOID_TIME, s.AVOID_MAX)
                continue
            out[i] += strength * max(0.0, 1 - distance / reach) * d / max(distance, 1e-9)
    return out


def between_groups(status: Array, head: Ints) -> Array:
    """Acceleration of each group as a whole, (G, 2), `status` as in sim.crowd.forces; the larger of two yields less.
    Groups of one `head` (G,) do not avoid each other."""
    out = np.zeros((len(status), 2))
    for a in range(len(status)):
        for b in range(len(status)):
            d, w = (
                status[a, MEAN_X : MEAN_Y + 1] - status[b, MEAN_X : MEAN_Y + 1],
                status[a, MEAN_VX : MEAN_VY + 1] - status[b, MEAN_VX : MEAN_VY + 1],
            )
            alone = status[a, COUNT] == status[b, COUNT] == 1
            if (
                head[a] == head[b]
                or alone
                or not status[a, AVOIDED]
                or not status[b, AVOIDED]
                or np.linalg.norm(d) > s.GROUP_RANGE
            ):
                continue
            radius = status[a, RADIUS] + status[b, RADIUS] + 2 * s.PERSON_RADIUS
            share = 2 * status[b, COUNT] / (status[a, COUNT] + status[b, COUNT])
            out[a] += share * power_law(d, w, radius, s.AVOID_GROUP, s.AVOID_TIME, s.AVOID_MAX)
    return out


def from_things(state: Array, wanted: Array, walls: Array, pillars: Array) -> Array:
    """Repulsion of walls within 1.2 m and of pillars within 6 m of their edge, and anticipation of pillars, (N, 2)."""
    out, body = np.zeros((len(state), 2)), 0.2
    for i, (x, v) in enumerate(zip(state[:, :2], state[:, 2:], strict=True)):
        strength = s.WALL * min(1.0, max(np.linalg.norm(wanted[i]), 0.6) / s.USUAL_SPEED)
        for wall in walls:
            a, u = wall[:2], wall[2:] - wall[:2]
            d = x - a - np.clip((x - a) @ u / (u @ u + 1e-9), 0, 1) * u
            r = np.linalg.norm(d)
            out[i] += (r < 1.2) * strength * np.exp(-(r - body) / s.WALL_RANGE) * d / max(r, 1e-9)
        for pillar in pillars:
            d, radius = x - pillar[:2], pillar[2]
            r = np.linalg.norm(d)
            if r < radius + 6:
                out[i] += strength * np.exp(-(r - body - radius) / s.WALL_RANGE) * d / max(r, 1e-9)
                wide = radius + 1.2 * s.PERSON_RADIUS
                out[i] += power_law(d, v, wide, s.AVOID_PERSON, s.AVOID_TIME, s.AVOID_MAX)
    return out
