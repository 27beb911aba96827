"""Where people want to go, as numba kernels: groups' ways and headings, places in the formation, doors, stairs.

Column meanings and units: sim.crowd.steering. Each kernels' file calls none of another: numba's cache does not see
changes
in other files.
"""

from __future__ import annotations

from math import sqrt

import numpy as np
from numba import njit

from sim.crowd.steering import Groups, People

STILL = 1e-9


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
def _spread(state, place, tag, groups, now):  # type: ignore[no-untyped-def]
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
def _seek(state, people, groups, stairs, p, out):  # type: ignore[no-untyped-def]
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
        limit *= _pace_on_stairs(x, y, stairs)
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
def _pace_on_stairs(x, y, stairs):  # type: ignore[no-untyped-def]
    for k in range(len(stairs)):
        dx, dy = x - stairs[k, 0], y - stairs[k, 1]
        s = dx * stairs[k, 2] + dy * stairs[k, 3]
        t = dy * stairs[k, 2] - dx * stairs[k, 3]
        if 0.0 <= s <= stairs[k, 4] and abs(t) <= stairs[k, 5] / 2:
            return stairs[k, 6]
    return 1.0


@njit(cache=True)
def _mark_discs(groups):  # type: ignore[no-untyped-def]
    """Whether others avoid a group as a whole: it is together, and not inside a door."""
    now = groups.now
    for g in range(len(now)):
        together = now[g, 0] > 0.0 and now[g, 5] <= 2.2
        now[g, 9] = 1.0 if together and groups.kind[g, groups.at[g]] != 1 else 0.0


@njit(cache=True)
def drive(  # type: ignore[no-untyped-def]
    state, place, target, pace, wander, tag,
    route, kind, length, at, speed, heading, finish, arrived, now,
    stairs, dt, p, out,
):  # fmt: skip
    """Accelerations by goals into out (N, 2); advances the groups' ways and headings by dt and writes `now`.

    The arrays of People and Groups come one by one, because numba takes 3 us to unpack a named tuple. Returns False
    where a state is not finite.
    """
    for i in range(len(state)):
        if not abs(state[i, 0]) + abs(state[i, 1]) + abs(state[i, 2]) + abs(state[i, 3]) < 1e9:
            return False
    people = People(place, target, pace, wander, tag)
    groups = Groups(route, kind, length, at, speed, heading, finish, arrived, now)
    _sum_groups(state, tag, now)
    _spread(state, place, tag, groups, now)
    _pass_doors(groups, people, now)
    _lead_groups(groups, now, dt, p)
    _seek(state, people, groups, stairs, p, out)
    _mark_discs(groups)
    return True
