"""Forces that keep people, groups, walls and pillars apart, as numba kernels; numpy twins: tests/reference_steering.py.

`avoid` is the entry. sim.crowd.forces names all columns, slots and units. Neighbours are found through a cell list once
there are more than BRUTE (48) people. Only pairs that may act on each other go through the formulas. Indices of inner
loops are unsigned: of signed ones numba looks each time whether they count from the end.
"""

from __future__ import annotations

from math import sqrt

import numpy as np

from sim.compiler import njit
from sim.elementary_kernels import exp, sort_by

# isort: off
# fmt: off
from sim.crowd.forces import (
    AVOID_GROUP, AVOID_MAX, AVOID_PERSON, AVOID_TIME, AVOIDED, COUNT, EVADING, GROUP, GROUP_RANGE, IN_GROUP,
    MAX_ACCELERATION, MEAN_VX, MEAN_VY, MEAN_X, MEAN_Y, MODE, PERSON_RADIUS, PERSON_RANGE, PILLAR_RADIUS,
    PILLAR_X, PILLAR_Y, PROCESSION, QUEUE, RADIUS, REACH, REPULSION, ROOM_AHEAD, SEPARATION,
    SHOVE, SLOWING, USUAL_SPEED, VX, VY, WALL, WALL_RANGE, X1, X2,
    Y1, Y2, X, Y,
)
# fmt: on
# isort: on

GROUP_REACH = 64.00000000000001  # m²: the number after that of GROUP_RANGE
BRUTE = 48  # people, up to which all pairs are tried
TINY = 1e-9  # m
QUEUE_SEPARATION_RANGE = 0.5  # m: members of one queue repel each other up to this distance
WALL_REACH, PILLAR_REACH = 1.2, 6.0  # m from a wall, from the edge of a pillar: no force beyond
SLOW = 0.6  # m/s: below, people give way less, and walls push them less
STRAIGHT = 0.1  # sine of the angle between a walker's way and who counts as straight ahead
BODY = 0.2  # m: distance from a wall or a pillar's edge at contact
PILLAR_MARGIN = 1.2  # person radii that are added to a pillar's radius in the power law


@njit(cache=True)
def _power_law(dx, dy, wx, wy, radius, strength):  # type: ignore[no-untyped-def]
    """Returns the avoidance acceleration (fx, fy), m/s², of one of two discs whose radii add up to `radius`.

    (dx, dy), (wx, wy) = own - other position and velocity. Minus the gradient of strength exp(-tau / T) / tau²
    over the relative position (Karamouzas 2014, eq. 2-3), tau the time to collision, T = AVOID_TIME, cut to length
    AVOID_MAX. *Ours*: tau ≥ 0.05 s, and zero for tau > 4 T.
    """
    a = wx * wx + wy * wy
    c = dx * dx + dy * dy - radius * radius
    b = -(dx * wx + dy * wy)
    if a < 1e-6 or c <= 0.0 or b <= 0.0:
        return 0.0, 0.0
    cross = dx * wy - dy * wx
    root = a * radius * radius - cross * cross  # = b^2 - a c, without its cancellation
    if root <= 1e-12:
        return 0.0, 0.0
    root = sqrt(root)
    tau = (b - root) / a
    if tau <= 0.0 or tau > 4.0 * AVOID_TIME:
        return 0.0, 0.0
    tau = max(tau, 0.05)
    size = strength * exp(-tau / AVOID_TIME) / (a * tau * tau) * (2.0 / tau + 1.0 / AVOID_TIME)
    fx = -size * (wx - (b * wx + a * dx) / root)
    fy = -size * (wy - (b * wy + a * dy) / root)
    f = sqrt(fx * fx + fy * fy)
    if f > AVOID_MAX:
        fx, fy = fx * AVOID_MAX / f, fy * AVOID_MAX / f
    return fx, fy


@njit(cache=True)
def _candidates(rows, s, first, last, reach, touch, found, m):  # type: ignore[no-untyped-def]
    """Appends to found[m:] the discs first … last - 1 that may act on disc s; returns the new length.

    Those within `touch`, and within `reach` those who come nearer; both are squares of distances, m². rows (4, M): x,
    y, vx, vy.
    """
    x, y, vx, vy = rows[X], rows[Y], rows[VX], rows[VY]
    for t in range(np.uint64(first), np.uint64(last)):
        dx, dy = x[s] - x[t], y[s] - y[t]
        d2 = dx * dx + dy * dy
        if d2 < reach:
            wx, wy = vx[s] - vx[t], vy[s] - vy[t]
            found[m] = t
            m += np.uint64((d2 < touch) | (dx * wx + dy * wy < 0.0))
    return m


@njit(cache=True)
def _avoid_groups(status, push, by_x, head):  # type: ignore[no-untyped-def]
    """Overwrites push (G, 2) with each group's acceleration from avoiding other groups, and sorts by_x (G,)."""
    push[:] = 0.0
    sort_by(status[:, MEAN_X].copy(), by_x)
    live, m = np.empty(len(status), np.int64), 0
    for g in by_x:
        live[m] = g
        m += status[g, AVOIDED] > 0.0
    rows = np.empty((4, m))  # columns MEAN_X … MEAN_VY of `status` as rows, groups sorted by x
    for s in range(m):
        for k in range(4):
            rows[k, s] = status[live[s], MEAN_X + k]
    found = np.empty(m + 1, np.uint32)
    last = 0
    for s in range(np.uint64(m)):
        a = np.uint64(live[s])
        while last < m and rows[X, s] - rows[X, last] >= -GROUP_RANGE:
            last += 1
        for k in range(_candidates(rows, s, s + np.uint64(1), last, GROUP_REACH, 0.0, found, np.uint64(0))):
            b = np.uint64(live[found[k]])
            if status[a, COUNT] + status[b, COUNT] < 2.5 or head[a] == head[b]:
                continue
            dx, dy = status[a, MEAN_X] - status[b, MEAN_X], status[a, MEAN_Y] - status[b, MEAN_Y]
            wx, wy = status[a, MEAN_VX] - status[b, MEAN_VX], status[a, MEAN_VY] - status[b, MEAN_VY]
            size = status[a, RADIUS] + status[b, RADIUS] + 2.0 * PERSON_RADIUS
            fx, fy = _power_law(dx, dy, wx, wy, size, AVOID_GROUP)
            # The smaller group yields more.
            share = 2.0 * status[b, COUNT] / (status[a, COUNT] + status[b, COUNT])
            push[a, 0] += share * fx
            push[a, 1] += share * fy
            push[b, 0] -= (2.0 - share) * fx
            push[b, 1] -= (2.0 - share) * fy


@njit(cache=True)
def _give_way(state, i, j, dx, dy, d, out):  # type: ignore[no-untyped-def]
    """Adds to out (N, 2) what a stranger j ahead does to person i, at distance d in the direction -(dx, dy).

    Who walks the same way slows i down within ROOM_AHEAD, against the velocity. Others who come nearer i evades, across
    it: to the side on which i is, to the right of who is straight ahead. Both fade below SLOW.
    """
    vx, vy = state[i, VX], state[i, VY]
    towards = -(vx * dx + vy * dy) / d
    if towards <= 0.0:
        return
    size = max(sqrt(vx * vx + vy * vy), SLOW)
    if vx * state[j, VX] + vy * state[j, VY] > 0.0:
        f = SLOWING * max(0.0, ROOM_AHEAD - d) * towards / (size * size)
        out[i, X] -= f * vx
        out[i, Y] -= f * vy
    elif (vx - state[j, VX]) * dx + (vy - state[j, VY]) * dy < 0.0:
        side = 1.0 if vx * dy - vy * dx > STRAIGHT * d * size else -1.0
        f = side * EVADING * (PERSON_RANGE - d) * towards / (size * size)
        out[i, X] -= f * vy
        out[i, Y] += f * vx


@njit(cache=True)
def _pair(state, tag, boids, i, j, dx, dy, d2, out):  # type: ignore[no-untyped-def]
    """Adds the forces between persons i and j to out (N, 2); (dx, dy) = position i - position j, d2 its square."""
    strength, reach, strangers = SHOVE, 2.0 * PERSON_RADIUS, False
    if tag[i, PROCESSION] == tag[j, PROCESSION]:
        g, h = tag[i, GROUP], tag[j, GROUP]
        strength, reach = boids[g, REPULSION], max(boids[g, REACH], boids[h, REACH])
    elif tag[i, QUEUE] >= 0 and tag[i, QUEUE] == tag[j, QUEUE]:
        strength, reach = SEPARATION, QUEUE_SEPARATION_RANGE
    else:
        strangers = True
    d = max(sqrt(d2), TINY)
    if strangers:
        _give_way(state, i, j, dx, dy, d, out)
        _give_way(state, j, i, -dx, -dy, d, out)
    if d < reach:
        f = strength * (1.0 - d / reach) / d
        fx, fy = f * dx, f * dy
    elif strangers:
        wx, wy = state[i, VX] - state[j, VX], state[i, VY] - state[j, VY]
        fx, fy = _power_law(dx, dy, wx, wy, reach, AVOID_PERSON)
    else:
        return
    out[i, X] += fx
    out[i, Y] += fy
    out[j, X] -= fx
    out[j, Y] -= fy


@njit(cache=True)
def _cells(state, reach):  # type: ignore[no-untyped-def]
    """Sorts people into grid cells at least `reach` wide; returns order (N,), start of each cell (C + 1,), cells along
    x.
    """
    n = len(state)
    x0, y0, x1, y1 = np.inf, np.inf, -np.inf, -np.inf
    for i in range(n):
        x0, x1 = min(x0, state[i, X]), max(x1, state[i, X])
        y0, y1 = min(y0, state[i, Y]), max(y1, state[i, Y])
    cell, nx, ny = 1.0, 1, 1
    if n > BRUTE:
        cell = max(reach, sqrt((x1 - x0) * (y1 - y0) / (4.0 * n)), (x1 - x0) / 1000.0, (y1 - y0) / 1000.0)
        nx, ny = int((x1 - x0) / cell) + 1, int((y1 - y0) / cell) + 1
    start = np.zeros(nx * ny + 1, np.int64)
    cells = np.empty(n, np.int64)
    for i in range(n):
        cells[i] = int((state[i, Y] - y0) / cell) * nx + int((state[i, X] - x0) / cell) if n > BRUTE else 0
        start[cells[i] + 1] += 1
    for c in range(nx * ny):
        start[c + 1] += start[c]
    order = np.empty(n, np.int64)
    for i in range(n - 1, -1, -1):  # from the last place of each cell, which is the start of the next
        start[cells[i] + 1] -= 1
        order[start[cells[i] + 1]] = i
    for c in range(nx * ny):
        start[c] = start[c + 1]
    start[nx * ny] = n
    return order, start, nx


@njit(cache=True)
def _pairs(state, tag, boids, out):  # type: ignore[no-untyped-def]
    """Adds the forces between people closer than PERSON_RANGE to out (N, 2), each pair once."""
    n = len(state)
    order, start, nx = _cells(state, PERSON_RANGE)
    reach, touch, rows = PERSON_RANGE * PERSON_RANGE, ROOM_AHEAD * ROOM_AHEAD, np.zeros((4, n))
    for g in range(len(boids)):
        touch = max(touch, boids[g, REACH] * boids[g, REACH])
    for s in range(n):
        for k in range(4):
            rows[k, s] = state[order[s], k]
    found = np.empty(n + 1, np.uint32)
    for c in range(len(start) - 1):
        left, right = c % nx > 0, c % nx + 1 < nx
        above = c + nx < len(start) - 1
        for s in range(np.uint64(start[c]), np.uint64(start[c + 1])):
            next_one, m = s + np.uint64(1), np.uint64(0)
            m = _candidates(rows, s, next_one, start[c + 1 + right], reach, touch, found, m)
            if above:
                first, last = start[c + nx - left], start[c + nx + right + 1]
                m = _candidates(rows, s, first, last, reach, touch, found, m)
            i = np.uint64(order[s])
            for k in range(m):
                j = np.uint64(order[found[k]])
                dx, dy = state[i, X] - state[j, X], state[i, Y] - state[j, Y]
                _pair(state, tag, boids, i, j, dx, dy, dx * dx + dy * dy, out)


@njit(cache=True)
def _walls(state, wanted, walls, pillars, out):  # type: ignore[no-untyped-def]
    """Adds the forces of walls within WALL_REACH and pillars within PILLAR_REACH to out (N, 2)."""
    for i in range(len(state)):
        x, y = state[i, X], state[i, Y]
        pace = sqrt(wanted[i, X] * wanted[i, X] + wanted[i, Y] * wanted[i, Y])
        strength = WALL * min(1.0, max(pace, SLOW) / USUAL_SPEED)  # else the slow are stuck in narrow doors
        for k in range(len(walls)):
            ax, ay = walls[k, X1], walls[k, Y1]
            ux, uy = walls[k, X2] - ax, walls[k, Y2] - ay
            side = (x - ax) * uy - (y - ay) * ux
            if side * side > 1.5 * (ux * ux + uy * uy):  # further from its line than WALL_REACH: the common case
                continue
            s = ((x - ax) * ux + (y - ay) * uy) / (ux * ux + uy * uy + TINY)
            s = min(1.0, max(0.0, s))
            dx, dy = x - ax - s * ux, y - ay - s * uy
            d = max(sqrt(dx * dx + dy * dy), TINY)
            if d < WALL_REACH:
                f = strength * exp(-(d - BODY) / WALL_RANGE) / d
                out[i, X] += f * dx
                out[i, Y] += f * dy
        for k in range(len(pillars)):
            dx, dy = x - pillars[k, PILLAR_X], y - pillars[k, PILLAR_Y]
            r = pillars[k, PILLAR_RADIUS]
            d = max(sqrt(dx * dx + dy * dy), TINY)
            if d < r + PILLAR_REACH:
                f = strength * exp(-(d - BODY - r) / WALL_RANGE) / d
                wide = r + PILLAR_MARGIN * PERSON_RADIUS
                vx, vy = state[i, VX], state[i, VY]
                fx, fy = _power_law(dx, dy, vx, vy, wide, AVOID_PERSON)
                out[i, X] += f * dx + fx
                out[i, Y] += f * dy + fy


@njit(cache=True)
def avoid(state, wanted, tag, status, push, by_x, boids, head, walls, pillars, out):  # type: ignore[no-untyped-def]
    """Adds all avoidance accelerations to out (N, 2), and cuts each sum to MAX_ACCELERATION.

    state (N, 4), tag (N, 4), status (G, 12), push (G, 2), by_x (G,), head (G,), walls (W, 4), pillars (P, 3): as in
    `forces`. walls: None if there are neither walls nor pillars, so that nothing of them is compiled.
    """
    _avoid_groups(status, push, by_x, head)
    _pairs(state, tag, boids, out)
    if walls is not None:
        _walls(state, wanted, walls, pillars, out)
    for i in range(len(state)):
        # People in a queue do not take part in the avoidance of their group as a whole.
        if tag[i, MODE] == IN_GROUP:
            out[i, X] += push[tag[i, GROUP], 0]
            out[i, Y] += push[tag[i, GROUP], 1]
        size = sqrt(out[i, X] * out[i, X] + out[i, Y] * out[i, Y])
        if size > MAX_ACCELERATION:
            out[i, X] *= MAX_ACCELERATION / size
            out[i, Y] *= MAX_ACCELERATION / size
