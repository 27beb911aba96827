"""Compiled: what a ray meets of all that stands still: ground, walls, pillars, stairs.

Rays are o + t d. Stairs are drawn as steps: tread k of n lies at z = k rise/n, from (k - 1/2)/n to (k + 1/2)/n of the
way (the last: to the end of the landing), where the smooth height of sim.scene.terrain is exactly that in the middle.
"""

from __future__ import annotations

import numpy as np
from numba import njit

NOTHING, GROUND, WALL, PILLAR, TREAD, RISER = range(6)
TINY = 1e-9


@njit(cache=True)
def _wall(o, d, wall, height, hit, best, index):  # type: ignore[no-untyped-def]
    ex, ey = wall[2] - wall[0], wall[3] - wall[1]
    cross = d[0] * ey - d[1] * ex
    if cross == 0.0:
        return best
    ax, ay = wall[0] - o[0], wall[1] - o[1]
    t = (ax * ey - ay * ex) / cross
    s = (ax * d[1] - ay * d[0]) / cross
    z = o[2] + t * d[2]
    if TINY < t < best and 0 <= s <= 1 and 0 <= z <= height:
        length = np.hypot(ex, ey)
        side = 1.0 if d[0] * ey - d[1] * ex < 0 else -1.0
        hit[0], hit[1], hit[2], hit[3] = WALL, side * ey / length, -side * ex / length, 0
        hit[4], hit[5] = index, s * length
        return t
    return best


@njit(cache=True)
def _pillar(o, d, pillar, height, hit, best, index):  # type: ignore[no-untyped-def]
    px, py, r = o[0] - pillar[0], o[1] - pillar[1], pillar[2]
    a, b, c = d[0] * d[0] + d[1] * d[1], px * d[0] + py * d[1], px * px + py * py - r * r
    if d[2] < 0.0:
        t = (height - o[2]) / d[2]
        x, y = px + t * d[0], py + t * d[1]
        if TINY < t < best and x * x + y * y <= r * r:
            hit[0], hit[1], hit[2], hit[3], hit[4], hit[5] = PILLAR, 0, 0, 1, index, 0
            best = t
    root = b * b - a * c
    if root > 0 and a > 0:
        t = (-b - np.sqrt(root)) / a
        z = o[2] + t * d[2]
        if TINY < t < best and 0 <= z <= height:
            nx, ny = (px + t * d[0]) / r, (py + t * d[1]) / r
            hit[0], hit[1], hit[2], hit[3], hit[4], hit[5] = PILLAR, nx, ny, 0, index, np.arctan2(ny, nx) * r
            return t
    return best


@njit(cache=True)
def step_height(flight, along):  # type: ignore[no-untyped-def]
    """Height of the drawn step `along` m from the foot; 0 before the first riser."""
    n = flight[7]
    return flight[6] / n * min(max(np.floor(along / flight[4] * n + 0.5), 0.0), n)


@njit(cache=True)
def _turned(o, d, flight):  # type: ignore[no-untyped-def]
    """Origin and direction along and across a flight."""
    ux, uy = flight[2], flight[3]
    x, y = o[0] - flight[0], o[1] - flight[1]
    return x * ux + y * uy, y * ux - x * uy, d[0] * ux + d[1] * uy, d[1] * ux - d[0] * uy


@njit(cache=True)
def _put(hit, kind, flight, along, across, up, index, place):  # type: ignore[no-untyped-def]
    """Note a hit whose normal is given along, across and up a flight."""
    hit[0], hit[3], hit[4], hit[5] = kind, up, index, place
    hit[1] = along * flight[2] - across * flight[3]
    hit[2] = along * flight[3] + across * flight[2]


@njit(cache=True)
def _within(o, d, low, high, first, last):  # type: ignore[no-untyped-def]
    """The part of first <= t <= last in which low <= o + t d <= high (and a little more); empty: first > last."""
    low, high = low - TINY, high + TINY
    if d == 0.0:
        return (first, last) if low <= o <= high else (1.0, 0.0)
    a, b = (low - o) / d, (high - o) / d
    return max(first, min(a, b)), min(last, max(a, b))


@njit(cache=True)
def _stairs(o, d, flight, hit, best, index):  # type: ignore[no-untyped-def]
    """Nearest hit with treads, risers, both sides and the back of one flight."""
    oa, oc, da, dc = _turned(o, d, flight)
    length, half, rise, n, end = flight[4], flight[5], flight[6], int(flight[7]), flight[4] + flight[8]
    first = 0.5 / n * length
    enter, leave = _within(oa, da, first, end, 0.0, best)
    enter, leave = _within(oc, dc, -half, half, enter, leave)
    enter, leave = _within(o[2], d[2], min(0.0, rise), max(0.0, rise), enter, leave)
    if enter > leave + TINY:
        return best
    for k in range(1, n + 1):
        low, z = (k - 0.5) / n * length, k * rise / n
        high = end if k == n else (k + 0.5) / n * length
        if d[2] != 0.0:
            t = (z - o[2]) / d[2]
            a = oa + t * da
            if TINY < t < best and low <= a <= high and abs(oc + t * dc) <= half:
                _put(hit, TREAD, flight, 0.0, 0.0, 1.0, index, a)
                best = t
        if da != 0.0:
            t = (low - oa) / da
            h = o[2] + t * d[2]
            if TINY < t < best and abs(oc + t * dc) <= half and min(z, z - rise / n) <= h <= max(z, z - rise / n):
                _put(hit, RISER, flight, -1.0 if da > 0 else 1.0, 0.0, 0.0, index, oc + t * dc)
                best = t
    for side in (-1.0, 1.0):
        if dc != 0.0:
            t = (side * half - oc) / dc
            a, h = oa + t * da, o[2] + t * d[2]
            z = step_height(flight, a)
            if TINY < t < best and first <= a <= end and min(0.0, z) <= h <= max(0.0, z):
                _put(hit, RISER, flight, 0.0, -1.0 if dc > 0 else 1.0, 0.0, index, a)
                best = t
    if da != 0.0:
        t = (end - oa) / da
        h = o[2] + t * d[2]
        if TINY < t < best and abs(oc + t * dc) <= half and min(0.0, rise) <= h <= max(0.0, rise):
            _put(hit, RISER, flight, -1.0 if da > 0 else 1.0, 0.0, 0.0, index, oc + t * dc)
            best = t
    return best


@njit(cache=True)
def _on_stairs(x, y, flights):  # type: ignore[no-untyped-def]
    """Whether a flight takes the place of level ground here."""
    for k in range(len(flights)):
        f = flights[k]
        dx, dy = x - f[0], y - f[1]
        along, across = dx * f[2] + dy * f[3], dy * f[2] - dx * f[3]
        if 0.5 / f[7] * f[4] < along <= f[4] + f[8] and abs(across) <= f[5]:
            return True
    return False


@njit(cache=True)
def nearest(o, d, still, hit):  # type: ignore[no-untyped-def]
    """t of the first thing on the ray, inf if none; still: see sim.render.background.solids; hit: kind, normal (3),
    index, place
    along it (m)."""
    walls, wall_height, pillars, pillar_height, flights = still
    best = np.inf
    hit[0] = NOTHING
    if d[2] != 0.0:
        t = -o[2] / d[2]
        if t > TINY and not _on_stairs(o[0] + t * d[0], o[1] + t * d[1], flights):
            best = t
            hit[0], hit[1], hit[2], hit[3], hit[4], hit[5] = GROUND, 0, 0, 1, 0, 0
    for k in range(len(walls)):
        best = _wall(o, d, walls[k], wall_height, hit, best, k)
    for k in range(len(pillars)):
        best = _pillar(o, d, pillars[k], pillar_height, hit, best, k)
    for k in range(len(flights)):
        best = _stairs(o, d, flights[k], hit, best, k)
    return best
