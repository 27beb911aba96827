"""The forces of sim.steering as one numba kernel; its numpy twin is tests/reference_steering.py.

Column meanings and units: sim.steering. People are found through a cell list once there are more than BRUTE of them.
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
def _sum_groups(state, tag, now):  # type: ignore[no-untyped-def]
    now[:, :9] = 0.0
    for i in range(len(state)):
        g = tag[i, 0]
        now[g, 0] += 1.0
        for k in range(4):
            now[g, 1 + k] += state[i, k]
    for g in range(len(now)):
        if now[g, 0] > 0.0:
            for k in range(1, 5):
                now[g, k] /= now[g, 0]


@njit(cache=True)
def _spread(state, place, target, tag, groups, now):  # type: ignore[no-untyped-def]
    """Disc radius of each group, and the largest way of a member from its place."""
    for i in range(len(state)):
        g = tag[i, 0]
        dx, dy = state[i, 0] - now[g, 1], state[i, 1] - now[g, 2]
        now[g, 5] = max(now[g, 5], sqrt(dx * dx + dy * dy))
        hx, hy = groups.heading[g, 0], groups.heading[g, 1]
        mx, my = now[g, 1], now[g, 2]
        at = groups.at[g]
        if groups.kind[g, at] == 2:
            mx, my = groups.route[g, at, 0], groups.route[g, at, 1]
        dx = state[i, 0] - mx - place[i, 0] * hx + place[i, 1] * hy
        dy = state[i, 1] - my - place[i, 0] * hy - place[i, 1] * hx
        now[g, 6] = max(now[g, 6], sqrt(dx * dx + dy * dy))


@njit(cache=True)
def _lead_groups(groups, now, dt, p):  # type: ignore[no-untyped-def]
    """Advance each group along its way: next waypoint, heading, wanted velocity."""
    turn_time, slow_time, gather, radius = p[6], p[7], p[18], p[19]
    for g in range(len(now)):
        if now[g, 0] == 0.0 or groups.length[g] == 0:
            continue
        at, last = groups.at[g], groups.length[g] - 1
        kind = groups.kind[g, at]
        dx, dy = groups.route[g, at, 0] - now[g, 1], groups.route[g, at, 1] - now[g, 2]
        d = sqrt(dx * dx + dy * dy)
        if (kind == 0 and d < radius + 0.3 * now[g, 5]) or (kind == 2 and now[g, 6] < gather):
            if at < last:
                groups.at[g] = at + 1
                at += 1
                kind = groups.kind[g, at]
                dx, dy = groups.route[g, at, 0] - now[g, 1], groups.route[g, at, 1] - now[g, 2]
                d = sqrt(dx * dx + dy * dy)
            elif kind == 2:
                groups.arrived[g] = True
        pace = groups.speed[g]
        if at == last and kind == 3:
            if groups.finish[g] == 0:
                pace = min(pace, d / slow_time)
                if d < 0.25 or (groups.arrived[g] and d < 1.5):
                    groups.arrived[g] = True
            elif d < radius:
                groups.arrived[g] = True
        if d > 0.3 and kind != 2 and not groups.arrived[g]:
            _turn(groups.heading, g, dx / d, dy / d, dt / turn_time)
        if groups.arrived[g] and groups.finish[g] == 0:
            now[g, 7], now[g, 8] = dx / slow_time, dy / slow_time
            size = sqrt(now[g, 7] ** 2 + now[g, 8] ** 2)
            if size > 0.3:
                now[g, 7] *= 0.3 / size
                now[g, 8] *= 0.3 / size
        else:
            now[g, 7], now[g, 8] = pace * groups.heading[g, 0], pace * groups.heading[g, 1]


@njit(cache=True)
def _turn(heading, g, ex, ey, share):  # type: ignore[no-untyped-def]
    """Turn a heading towards e by this share of the angle between them."""
    hx, hy = heading[g, 0], heading[g, 1]
    angle = np.arctan2(hx * ey - hy * ex, hx * ex + hy * ey) * min(share, 1.0)
    c, s = np.cos(angle), np.sin(angle)
    hx, hy = c * hx - s * hy, s * hx + c * hy
    size = sqrt(hx * hx + hy * hy)
    heading[g, 0], heading[g, 1] = hx / size, hy / size


@njit(cache=True)
def _pace_on_stairs(x, y, stairs):  # type: ignore[no-untyped-def]
    for k in range(len(stairs)):
        dx, dy = x - stairs[k, 0], y - stairs[k, 1]
        s = dx * stairs[k, 2] + dy * stairs[k, 3]
        t = dy * stairs[k, 2] - dx * stairs[k, 3]
        if 0.0 <= s <= stairs[k, 4] and abs(t) <= stairs[k, 5] / 2:
            return stairs[k, 6]
    return 1.0


@njit(cache=True)
def _drive(state, people, groups, obstacles, p, out):  # type: ignore[no-untyped-def]
    """Goal seeking, cohesion to a place in the formation, alignment."""
    now = groups.now
    relax, cohesion, alignment, haste = p[0], p[1], p[2], p[5]
    for i in range(len(state)):
        g = people.tag[i, 0]
        x, y, vx, vy = state[i, 0], state[i, 1], state[i, 2], state[i, 3]
        at = groups.at[g]
        kind = groups.kind[g, at]
        align = 0.0
        if people.tag[i, 1] == 1:
            limit = people.pace[i]
            tx, ty = (people.target[i, 0] - x) / 0.7, (people.target[i, 1] - y) / 0.7
        elif kind == 1 and groups.length[g] > 0:
            limit = groups.speed[g]
            tx, ty = _through(groups, people, i, g, x, y, limit)
        else:
            hx, hy = groups.heading[g, 0], groups.heading[g, 1]
            ox = people.place[i, 0] * hx - people.place[i, 1] * hy
            oy = people.place[i, 0] * hy + people.place[i, 1] * hx
            if kind == 2:
                limit = groups.speed[g]
                tx, ty = (groups.route[g, at, 0] + ox - x) / 0.8, (groups.route[g, at, 1] + oy - y) / 0.8
            else:
                limit = groups.speed[g] * (1.0 + haste)
                tx = now[g, 7] + (now[g, 1] + ox - x) / cohesion
                ty = now[g, 8] + (now[g, 2] + oy - y) / cohesion
                if now[g, 0] > 1.0:
                    align = alignment
        limit *= _pace_on_stairs(x, y, obstacles.stairs)
        size = sqrt(tx * tx + ty * ty)
        if size > limit:
            tx, ty = tx * limit / size, ty * limit / size
        share = min(1.0, size / 0.3)
        tx += share * people.wander[i, 0]
        ty += share * people.wander[i, 1]
        out[i, 0] = (tx - vx) / relax + align * (now[g, 3] - vx)
        out[i, 1] = (ty - vy) / relax + align * (now[g, 4] - vy)


@njit(cache=True)
def _through(groups, people, i, g, x, y, limit):  # type: ignore[no-untyped-def]
    """Wanted velocity of one person of a group at a door: to it, then slowly on."""
    at = groups.at[g]
    w = max(people.tag[i, 3], at)
    dx, dy = groups.route[g, w, 0] - x, groups.route[g, w, 1] - y
    d = max(sqrt(dx * dx + dy * dy), STILL)
    if w == at and d < 0.45:
        people.tag[i, 3] = at + 1
    if w > at:
        limit *= 0.6
    return dx / d * limit, dy / d * limit


@njit(cache=True)
def _pass_doors(groups, people, now):  # type: ignore[no-untyped-def]
    """A group is through a door when its last member is."""
    for g in range(len(now)):
        groups.now[g, 9] = 1.0
    for i in range(len(people.tag)):
        g = people.tag[i, 0]
        if groups.kind[g, groups.at[g]] == 1 and people.tag[i, 3] <= groups.at[g]:
            groups.now[g, 9] = 0.0
    for g in range(len(now)):
        if now[g, 0] > 0.0 and groups.length[g] > 0 and groups.kind[g, groups.at[g]] == 1 and groups.now[g, 9] > 0.0:
            groups.at[g] += 1


@njit(cache=True)
def _disc_weight(groups, g):  # type: ignore[no-untyped-def]
    """Whether others avoid this group as a whole: it is together, and not inside a door."""
    now = groups.now
    if now[g, 0] == 0.0 or now[g, 5] > 2.2:
        return 0.0
    return 0.0 if groups.kind[g, groups.at[g]] == 1 else 1.0


@njit(cache=True)
def _avoid_groups(groups, n_members, p, push):  # type: ignore[no-untyped-def]
    """Groups as discs: acceleration of each group as a whole; the smaller yields more."""
    now = groups.now
    strength, horizon, radius, reach, cap = p[9], p[10], p[11], p[13], p[14]
    push[:] = 0.0
    live = np.empty(len(now), np.int64)
    m = 0
    for g in range(len(now)):
        live[m] = g
        m += n_members[g] > 0 and _disc_weight(groups, g) > 0.0
    live = live[:m][np.argsort(now[live[:m], 1])]
    rows = np.empty((6, m))  # count, middle x y, velocity x y, disc radius; sorted by x
    for s in range(m):
        for k in range(6):
            rows[k, s] = now[live[s], k]
    found = np.empty(m + 1, np.int64)
    for s in range(m):
        a = live[s]
        for k in range(_near_discs(rows, s, m, reach, radius, found)):
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
def _near_discs(rows, s, m, reach, radius, found):  # type: ignore[no-untyped-def]
    """Write to `found` which discs after s, sorted by x, are within reach, about to collide, not both of one person."""
    count, x, y, vx, vy, disc = rows[0], rows[1], rows[2], rows[3], rows[4], rows[5]
    k = 0
    for t in range(s + 1, m):
        dx, dy = x[s] - x[t], y[s] - y[t]
        if dx < -reach:
            break
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
def _walls(state, obstacles, p, out):  # type: ignore[no-untyped-def]
    strength, decay, body = p[16], p[17], 0.2
    for i in range(len(state)):
        x, y = state[i, 0], state[i, 1]
        for k in range(len(obstacles.walls)):
            ax, ay = obstacles.walls[k, 0], obstacles.walls[k, 1]
            ux, uy = obstacles.walls[k, 2] - ax, obstacles.walls[k, 3] - ay
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
        for k in range(len(obstacles.pillars)):
            dx, dy = x - obstacles.pillars[k, 0], y - obstacles.pillars[k, 1]
            r = obstacles.pillars[k, 2]
            d = max(sqrt(dx * dx + dy * dy), STILL)
            if d < r + 6.0:
                f = strength * exp(-(d - body - r) / decay) / d
                fx, fy = _power_law(dx, dy, state[i, 2], state[i, 3], r + 1.2 * p[11], p[8], p[10], p[14])
                out[i, 0] += f * dx + fx
                out[i, 1] += f * dy + fy


@njit(cache=True)
def accelerate(state, people, groups, obstacles, dt, p, push, out):  # type: ignore[no-untyped-def]
    """Accelerations of all into out (N, 2); advances the groups' ways and headings by dt.

    state (N, 4): x, y, vx, vy. push (G, 2): scratch. Returns False where a state is not finite.
    """
    for i in range(len(state)):
        if not abs(state[i, 0]) + abs(state[i, 1]) + abs(state[i, 2]) + abs(state[i, 3]) < 1e9:
            return False
    now = groups.now
    _sum_groups(state, people.tag, now)
    _spread(state, people.place, people.target, people.tag, groups, now)
    _pass_doors(groups, people, now)
    _lead_groups(groups, now, dt, p)
    _drive(state, people, groups, obstacles, p, out)
    _avoid_groups(groups, now[:, 0], p, push)
    _pairs(state, people.tag, p, out)
    _walls(state, obstacles, p, out)
    cap = p[20]
    for i in range(len(state)):
        if people.tag[i, 1] == 0:
            out[i, 0] += push[people.tag[i, 0], 0]
            out[i, 1] += push[people.tag[i, 0], 1]
        size = sqrt(out[i, 0] ** 2 + out[i, 1] ** 2)
        if size > cap:
            out[i, 0] *= cap / size
            out[i, 1] *= cap / size
    return True
