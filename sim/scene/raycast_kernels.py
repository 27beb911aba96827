"""Compiled ray casting: the first thing that a ray meets among the ground, walls, pillars, stairs and boxes.

A ray is o + t d: origin o, direction d, t above 0. t counts lengths of d; for rays of a PixelRays it is the depth, m.
Stairs are drawn as steps: tread k of n lies at z = k rise/n, from (k - 1/2)/n to (k + 1/2)/n of the way; the last tread
reaches to the end of the landing. In the middle of a tread, the smooth height of `sim.scene.terrain` equals the
tread's.
"""

from __future__ import annotations

import numpy as np

from sim.compiler import njit
from sim.elementary_kernels import atan2
from sim.scene.boxes import AXES, HALF, MIDDLE, REACH

# isort: off
# fmt: off
from sim.scene.raycast import (
    BOX, CENTRE_X, CENTRE_Y, GROUND, HIT_INDEX, HIT_KIND, HIT_PLACE, NORMAL_X, NORMAL_Y, NORMAL_Z, NOTHING, PILLAR,
    RADIUS, RISER, TREAD, WALL, X1, X2, Y1, Y2,
)
# fmt: on
# isort: on
from sim.scene.terrain import AXIS_X, AXIS_Y, FOOT_X, FOOT_Y, HALF_WIDTH, LANDING, LENGTH, RISE, STEPS

TINY = 1e-9


@njit(cache=True)
def at_pixel(field, u, v, out):  # type: ignore[no-untyped-def]
    """Sets out (3,) to field (3, 3) times (u, v, 1): origin or direction of the ray through image point (u, v)."""
    for k in range(3):
        out[k] = field[k, 0] * u + field[k, 1] * v + field[k, 2]


@njit(cache=True)
def has_solids(solids):  # type: ignore[no-untyped-def]
    """Returns True if there are walls, pillars, stairs or boxes."""
    return len(solids.walls) + len(solids.pillars) + len(solids.flights) + len(solids.boxes) > 0


@njit(cache=True)
def _set_hit(hit, kind, normal_x, normal_y, normal_z, index, place):  # type: ignore[no-untyped-def]
    hit[HIT_KIND], hit[NORMAL_X], hit[NORMAL_Y], hit[NORMAL_Z] = kind, normal_x, normal_y, normal_z
    hit[HIT_INDEX], hit[HIT_PLACE] = index, place


@njit(cache=True)
def hit_wall(o, d, wall, height, hit, best, index):  # type: ignore[no-untyped-def]
    """Returns the t at which the ray o + t d meets one wall (4,) if below `best`, and sets hit; else `best`."""
    ex, ey = wall[X2] - wall[X1], wall[Y2] - wall[Y1]
    cross = d[0] * ey - d[1] * ex
    if cross == 0.0:
        return best
    ax, ay = wall[X1] - o[0], wall[Y1] - o[1]
    t = (ax * ey - ay * ex) / cross
    s = (ax * d[1] - ay * d[0]) / cross
    z = o[2] + t * d[2]
    if TINY < t < best and 0 <= s <= 1 and 0 <= z <= height:
        length = np.sqrt(ex * ex + ey * ey)
        side = 1.0 if d[0] * ey - d[1] * ex < 0 else -1.0
        _set_hit(hit, WALL, side * ey / length, -side * ex / length, 0.0, index, s * length)
        return t
    return best


@njit(cache=True)
def hit_pillar(o, d, pillar, height, hit, best, index):  # type: ignore[no-untyped-def]
    """Returns the t at which the ray o + t d meets one pillar (3,) if below `best`, and sets hit; else `best`."""
    px, py, r = o[0] - pillar[CENTRE_X], o[1] - pillar[CENTRE_Y], pillar[RADIUS]
    a, b, c = d[0] * d[0] + d[1] * d[1], px * d[0] + py * d[1], px * px + py * py - r * r
    # The top is hit from above only, the side from outside only.
    if d[2] < 0.0:
        t = (height - o[2]) / d[2]
        x, y = px + t * d[0], py + t * d[1]
        if TINY < t < best and x * x + y * y <= r * r:
            _set_hit(hit, PILLAR, 0.0, 0.0, 1.0, index, 0.0)
            best = t
    root = b * b - a * c
    if root > 0 and a > 0:
        t = (-b - np.sqrt(root)) / a
        z = o[2] + t * d[2]
        if TINY < t < best and 0 <= z <= height:
            nx, ny = (px + t * d[0]) / r, (py + t * d[1]) / r
            _set_hit(hit, PILLAR, nx, ny, 0.0, index, atan2(ny, nx) * r)
            return t
    return best


@njit(cache=True)
def step_height(flight, along):  # type: ignore[no-untyped-def]
    """Returns the height in m of the drawn step at a point `along` m from the foot of a flight (9,)."""
    n = flight[STEPS]
    return flight[RISE] / n * min(max(np.floor(along / flight[LENGTH] * n + 0.5), 0.0), n)


@njit(cache=True)
def _in_flight_axes(o, d, flight):  # type: ignore[no-untyped-def]
    """Returns a ray's origin along and across a flight, then its direction along and across."""
    ux, uy = flight[AXIS_X], flight[AXIS_Y]
    x, y = o[0] - flight[FOOT_X], o[1] - flight[FOOT_Y]
    return x * ux + y * uy, y * ux - x * uy, d[0] * ux + d[1] * uy, d[1] * ux - d[0] * uy


@njit(cache=True)
def _set_flight_hit(hit, kind, flight, along, across, up, index, place):  # type: ignore[no-untyped-def]
    """Sets hit (6,); along, across, up: the unit normal's parts in the axes of the flight."""
    ux, uy = flight[AXIS_X], flight[AXIS_Y]
    _set_hit(hit, kind, along * ux - across * uy, along * uy + across * ux, up, index, place)


@njit(cache=True)
def _clip_interval(o, d, low, high, first, last):  # type: ignore[no-untyped-def]
    """Returns the ends of the part of first <= t <= last in which low <= o + t d <= high; crossed if none."""
    low, high = low - TINY, high + TINY
    if d == 0.0:
        return (first, last) if low <= o <= high else (1.0, 0.0)
    a, b = (low - o) / d, (high - o) / d
    return max(first, min(a, b)), min(last, max(a, b))


@njit(cache=True)
def _hit_flight(o, d, flight, hit, best, index):  # type: ignore[no-untyped-def]
    """Returns the t at which the ray o + t d meets one flight (9,) if below `best`, and sets hit; else `best`."""
    oa, oc, da, dc = _in_flight_axes(o, d, flight)
    length, half, rise, n = flight[LENGTH], flight[HALF_WIDTH], flight[RISE], int(flight[STEPS])
    end = flight[LENGTH] + flight[LANDING]
    first = 0.5 / n * length
    enter, leave = _clip_interval(oa, da, first, end, 0.0, best)
    enter, leave = _clip_interval(oc, dc, -half, half, enter, leave)
    enter, leave = _clip_interval(o[2], d[2], min(0.0, rise), max(0.0, rise), enter, leave)
    if enter > leave + TINY:
        return best
    for k in range(1, n + 1):
        low, z = (k - 0.5) / n * length, k * rise / n
        high = end if k == n else (k + 0.5) / n * length
        if d[2] != 0.0:
            t = (z - o[2]) / d[2]
            a = oa + t * da
            if TINY < t < best and low <= a <= high and abs(oc + t * dc) <= half:
                _set_flight_hit(hit, TREAD, flight, 0.0, 0.0, 1.0, index, a)
                best = t
        if da != 0.0:
            t = (low - oa) / da
            h = o[2] + t * d[2]
            if TINY < t < best and abs(oc + t * dc) <= half and min(z, z - rise / n) <= h <= max(z, z - rise / n):
                _set_flight_hit(hit, RISER, flight, -1.0 if da > 0 else 1.0, 0.0, 0.0, index, oc + t * dc)
                best = t
    for side in (-1.0, 1.0):
        if dc != 0.0:
            t = (side * half - oc) / dc
            a, h = oa + t * da, o[2] + t * d[2]
            z = step_height(flight, a)
            if TINY < t < best and first <= a <= end and min(0.0, z) <= h <= max(0.0, z):
                _set_flight_hit(hit, RISER, flight, 0.0, -1.0 if dc > 0 else 1.0, 0.0, index, a)
                best = t
    if da != 0.0:
        t = (end - oa) / da
        h = o[2] + t * d[2]
        if TINY < t < best and abs(oc + t * dc) <= half and min(0.0, rise) <= h <= max(0.0, rise):
            _set_flight_hit(hit, RISER, flight, -1.0 if da > 0 else 1.0, 0.0, 0.0, index, oc + t * dc)
            best = t
    return best


@njit(cache=True)
def _on_stairs(x, y, flights):  # type: ignore[no-untyped-def]
    """Returns True if a flight (S, 9) replaces the level ground at (x, y)."""
    for k in range(len(flights)):
        f = flights[k]
        dx, dy = x - f[FOOT_X], y - f[FOOT_Y]
        along, across = dx * f[AXIS_X] + dy * f[AXIS_Y], dy * f[AXIS_X] - dx * f[AXIS_Y]
        if 0.5 / f[STEPS] * f[LENGTH] < along <= f[LENGTH] + f[LANDING] and abs(across) <= f[HALF_WIDTH]:
            return True
    return False


@njit(cache=True)
def _hit_box(o, d, box, hit, best, index):  # type: ignore[no-untyped-def]
    """Returns the t at which the ray o + t d meets one box (22,) from outside if below `best`, and sets hit; else
    `best`. HIT_PLACE is the axis, 0 to 2, to which the side is perpendicular."""
    x, y, z = box[MIDDLE] - o[0], box[MIDDLE + 1] - o[1], box[MIDDLE + 2] - o[2]
    along, length = x * d[0] + y * d[1] + z * d[2], d[0] * d[0] + d[1] * d[1] + d[2] * d[2]
    # Most rays pass by the ball round the box.
    if (x * x + y * y + z * z - box[REACH] * box[REACH]) * length > along * along:
        return best
    enter, leave, side, sign = -np.inf, np.inf, 0, 0.0
    for k in range(3):
        a, b, c, half = box[AXES + 3 * k], box[AXES + 3 * k + 1], box[AXES + 3 * k + 2], box[HALF + k]
        to, speed = a * x + b * y + c * z, a * d[0] + b * d[1] + c * d[2]
        if speed == 0.0:
            if abs(to) > half:
                return best
            continue
        first, last = (to - half) / speed, (to + half) / speed
        if speed < 0.0:
            first, last = last, first
        if first > enter:
            enter, side, sign = first, k, -1.0 if speed > 0.0 else 1.0
        leave = min(leave, last)
    if enter > leave or not TINY < enter < best:
        return best
    k = AXES + 3 * side
    _set_hit(hit, BOX, sign * box[k], sign * box[k + 1], sign * box[k + 2], index, side)
    return enter


@njit(cache=True)
def first_hit(o, d, solids, hit):  # type: ignore[no-untyped-def]
    """Returns the t (in lengths of d) of the first thing that the ray o + t d meets; inf if it meets nothing.

    hit (6,) is set: slots HIT_KIND, unit normal, HIT_INDEX among its kind, HIT_PLACE along the thing in m. Without a
    hit only the kind is set.
    """
    best = np.inf
    hit[HIT_KIND] = NOTHING
    if d[2] != 0.0:
        t = -o[2] / d[2]
        if t > TINY and not _on_stairs(o[0] + t * d[0], o[1] + t * d[1], solids.flights):
            best = t
            _set_hit(hit, GROUND, 0.0, 0.0, 1.0, 0, 0.0)
    for k in range(len(solids.walls)):
        best = hit_wall(o, d, solids.walls[k], solids.wall_height, hit, best, k)
    for k in range(len(solids.pillars)):
        best = hit_pillar(o, d, solids.pillars[k], solids.pillar_height, hit, best, k)
    for k in range(len(solids.flights)):
        best = _hit_flight(o, d, solids.flights[k], hit, best, k)
    for k in range(len(solids.boxes)):
        best = _hit_box(o, d, solids.boxes[k], hit, best, k)
    return best


@njit(cache=True)
def look(rays, u, v, solids, o, d, hit):  # type: ignore[no-untyped-def]
    """Sets o and d (3,) to the ray through image point (u, v) px, and returns `first_hit` of it."""
    at_pixel(rays.origin, u, v, o)
    at_pixel(rays.direction, u, v, d)
    return first_hit(o, d, solids, hit)
