"""How people avoid each other, groups, walls and pillars, as numba kernels; numpy twins: tests/reference_steering.py.

Column meanings and units: sim.crowd.steering. Neighbours are found through a cell list once there are more than BRUTE
people,
without branches, so that the search is done in vectors; only those who may act on each other go on to the formulas.
"""

from __future__ import annotations

from math import exp, sqrt

import numpy as np
from numba import njit

BRUTE = 48
STILL = 1e-9


@njit(cache=True, inline="always")
def _power_law(dx, dy, wx, wy, radius, strength, horizon, cap):  # type: ignore[no-untyped-def]
    """Acceleration of one at distance vector d from the other (self - other), closing with w = v_self - v_other.

    The gradient of exp(-tau / horizon) / tau^2 over the relative position (Karamouzas 2014, eq. 2-3).
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
    if tau <= 0.0 or tau > 4.0 * horizon:
        return 0.0, 0.0
    tau = max(tau, 0.05)
    size = strength * exp(-tau / horizon) / (a * tau * tau) * (2.0 / tau + 1.0 / horizon)
    fx = -size * (wx - (b * wx + a * dx) / root)
    fy = -size * (wy - (b * wy + a * dy) / root)
    f = sqrt(fx * fx + fy * fy)
    if f > cap:
        fx, fy = fx * cap / f, fy * cap / f
    return fx, fy


@njit(cache=True)
def _avoid_groups(now, p, push):  # type: ignore[no-untyped-def]
    """Groups as discs: acceleration of each group as a whole; the smaller yields more."""
    strength, horizon, radius, reach, cap = p[9], p[10], p[11], p[13], p[14]
    push[:] = 0.0
    live = np.empty(len(now), np.int64)
    m = 0
    for g in range(len(now)):
        live[m] = g
        m += now[g, 9] > 0.0
    live = live[:m][np.argsort(now[live[:m], 1])]
    rows = np.empty((6, m))  # count, middle x y, velocity x y, disc radius; sorted by x
    for s in range(m):
        for k in range(6):
            rows[k, s] = now[live[s], k]
    found = np.empty(m + 1, np.int64)
    last = 0
    for s in range(m):
        a = live[s]
        while last < m and rows[1, s] - rows[1, last] >= -reach:
            last += 1
        for k in range(_near_discs(rows, s, last, reach, radius, found)):
            b = live[found[k]]
            dx, dy = now[a, 1] - now[b, 1], now[a, 2] - now[b, 2]
            wx, wy = now[a, 3] - now[b, 3], now[a, 4] - now[b, 4]
            size = now[a, 5] + now[b, 5] + 2.0 * radius
            fx, fy = _power_law(dx, dy, wx, wy, size, strength, horizon, cap)
            if fx == 0.0 and fy == 0.0:
                continue
            share = 2.0 * now[b, 0] / (now[a, 0] + now[b, 0])
            push[a, 0] += share * fx
            push[a, 1] += share * fy
            push[b, 0] -= (2.0 - share) * fx
            push[b, 1] -= (2.0 - share) * fy


@njit(cache=True, inline="always")
def _near_discs(rows, s, last, reach, radius, found):  # type: ignore[no-untyped-def]
    """Write to `found` which discs from s to last are within reach, about to collide, and not both of one person."""
    count, x, y, vx, vy, disc = rows[0], rows[1], rows[2], rows[3], rows[4], rows[5]
    k = 0
    for t in range(s + 1, last):
        dx, dy = x[s] - x[t], y[s] - y[t]
        wx, wy = vx[s] - vx[t], vy[s] - vy[t]
        size = disc[s] + disc[t] + 2.0 * radius
        cross = dx * wy - dy * wx
        root = (wx * wx + wy * wy) * size * size - cross * cross
        found[k] = t
        near = (dx * dx + dy * dy <= reach * reach) & (count[s] + count[t] >= 2.5)
        k += near & (dx * wx + dy * wy < 0.0) & (root > 1e-12)
    return k


@njit(cache=True, inline="always")
def _pair(state, tag, i, j, dx, dy, d2, p, out):  # type: ignore[no-untyped-def]
    """Forces between two people: separation in a group, avoidance and shoving between strangers."""
    if tag[i, 0] == tag[j, 0]:
        if d2 >= p[4] * p[4]:
            return
        d = max(sqrt(d2), STILL)
        f = p[3] * (1.0 - d / p[4]) / d
        fx, fy = f * dx, f * dy
    elif tag[i, 2] >= 0 and tag[i, 2] == tag[j, 2]:
        if d2 >= 0.25:
            return
        d = max(sqrt(d2), STILL)
        f = p[3] * (1.0 - d / 0.5) / d
        fx, fy = f * dx, f * dy
    else:
        size = 2.0 * p[11]
        wx, wy = state[i, 2] - state[j, 2], state[i, 3] - state[j, 3]
        if d2 < size * size:
            d = max(sqrt(d2), STILL)
            f = p[15] * (1.0 - d / size) / d
            fx, fy = f * dx, f * dy
        else:
            fx, fy = _power_law(dx, dy, wx, wy, size, p[8], p[10], p[14])
            if fx == 0.0 and fy == 0.0:
                return
    out[i, 0] += fx
    out[i, 1] += fy
    out[j, 0] -= fx
    out[j, 1] -= fy


@njit(cache=True)
def _cells(state, reach):  # type: ignore[no-untyped-def]
    """People sorted by square cells at least `reach` wide: order (N,), start of each cell in it, cells per row."""
    n = len(state)
    if n <= BRUTE:
        return np.arange(n), np.array([0, n]), 1
    x0, y0 = state[0, 0], state[0, 1]
    x1, y1 = x0, y0
    for i in range(n):
        x0, x1 = min(x0, state[i, 0]), max(x1, state[i, 0])
        y0, y1 = min(y0, state[i, 1]), max(y1, state[i, 1])
    cell = max(reach, sqrt((x1 - x0) * (y1 - y0) / (4.0 * n)), (x1 - x0) / 1000.0, (y1 - y0) / 1000.0)
    nx, ny = int((x1 - x0) / cell) + 1, int((y1 - y0) / cell) + 1
    start = np.zeros(nx * ny + 1, np.int64)
    cells = np.empty(n, np.int64)
    for i in range(n):
        cells[i] = int((state[i, 1] - y0) / cell) * nx + int((state[i, 0] - x0) / cell)
        start[cells[i] + 1] += 1
    for c in range(nx * ny):
        start[c + 1] += start[c]
    fill = start[:-1].copy()
    order = np.empty(n, np.int64)
    for i in range(n):
        order[fill[cells[i]]] = i
        fill[cells[i]] += 1
    return order, start, nx


@njit(cache=True, inline="always")
def _candidates(rows, s, first, last, reach, touch, radius, found, m):  # type: ignore[no-untyped-def]
    """Append to `found` who of first … last may act on s: touching, or on the way to a collision. No branches."""
    x, y, vx, vy = rows[0], rows[1], rows[2], rows[3]
    for t in range(first, last):
        dx, dy = x[s] - x[t], y[s] - y[t]
        wx, wy = vx[s] - vx[t], vy[s] - vy[t]
        d2 = dx * dx + dy * dy
        cross = dx * wy - dy * wx
        root = (wx * wx + wy * wy) * radius * radius - cross * cross
        found[m] = t
        m += (d2 < reach) & ((d2 < touch) | ((dx * wx + dy * wy < 0.0) & (root > 1e-12)))
    return m


@njit(cache=True)
def _pairs(state, tag, p, out):  # type: ignore[no-untyped-def]
    """Forces between all pairs within reach, each pair once."""
    n = len(state)
    order, start, nx = _cells(state, p[12])
    reach, radius = p[12] * p[12], 2.0 * p[11]
    touch = max(p[4], 0.5, radius) ** 2
    rows = np.empty((4, n))
    for s in range(n):
        for k in range(4):
            rows[k, s] = state[order[s], k]
    found = np.empty(n + 1, np.int64)
    for c in range(len(start) - 1):
        left, right = c % nx > 0, c % nx + 1 < nx
        above = c + nx < len(start) - 1
        for s in range(start[c], start[c + 1]):
            m = _candidates(rows, s, s + 1, start[c + 1 + right], reach, touch, radius, found, 0)
            if above:
                first, last = start[c + nx - left], start[c + nx + right + 1]
                m = _candidates(rows, s, first, last, reach, touch, radius, found, m)
            i = order[s]
            for k in range(m):
                j = order[found[k]]
                dx, dy = state[i, 0] - state[j, 0], state[i, 1] - state[j, 1]
                _pair(state, tag, i, j, dx, dy, dx * dx + dy * dy, p, out)


@njit(cache=True)
def _walls(state, walls, pillars, p, out):  # type: ignore[no-untyped-def]
    strength, decay, body = p[16], p[17], 0.2
    for i in range(len(state)):
        x, y = state[i, 0], state[i, 1]
        for k in range(len(walls)):
            ax, ay = walls[k, 0], walls[k, 1]
            ux, uy = walls[k, 2] - ax, walls[k, 3] - ay
            side = (x - ax) * uy - (y - ay) * ux
            if side * side > 1.5 * (ux * ux + uy * uy):  # further than 1.2 m from its line: the common case
                continue
            s = ((x - ax) * ux + (y - ay) * uy) / (ux * ux + uy * uy + STILL)
            s = min(1.0, max(0.0, s))
            dx, dy = x - ax - s * ux, y - ay - s * uy
            d = max(sqrt(dx * dx + dy * dy), STILL)
            if d < 1.2:
                f = strength * exp(-(d - body) / decay) / d
                out[i, 0] += f * dx
                out[i, 1] += f * dy
        for k in range(len(pillars)):
            dx, dy = x - pillars[k, 0], y - pillars[k, 1]
            r = pillars[k, 2]
            d = max(sqrt(dx * dx + dy * dy), STILL)
            if d < r + 6.0:
                f = strength * exp(-(d - body - r) / decay) / d
                fx, fy = _power_law(dx, dy, state[i, 2], state[i, 3], r + 1.2 * p[11], p[8], p[10], p[14])
                out[i, 0] += f * dx + fx
                out[i, 1] += f * dy + fy


@njit(cache=True)
def avoid(state, tag, now, walls, pillars, p, push, out):  # type: ignore[no-untyped-def]
    """Add all avoidance to out (N, 2) and cap the sum; now (G, 10) as `drive` left it, push (G, 2) is scratch."""
    _avoid_groups(now, p, push)
    _pairs(state, tag, p, out)
    _walls(state, walls, pillars, p, out)
    cap = p[20]
    for i in range(len(state)):
        if tag[i, 1] == 0:
            out[i, 0] += push[tag[i, 0], 0]
            out[i, 1] += push[tag[i, 0], 1]
        size = sqrt(out[i, 0] ** 2 + out[i, 1] ** 2)
        if size > cap:
            out[i, 0] *= cap / size
            out[i, 1] *= cap / size
