"""Compiled loops of `sim.crowd.wayfinding`: who sees what, who files, who waits at a gate, and where each person walks to.

Segments `closed` (S, 4) are x1, y1, x2, y2 of walls, then of the K gates; `first` is the index of the first gate.
"""

from __future__ import annotations

from math import sqrt

import numpy as np

from sim.compiler import njit
from sim.crowd.forces import END, GATHER, LEAVE, X, Y

# columns of `gate_state` (K, 4): side whose people may pass, 1.0 or -1.0, 0.0 for none, BOTH; s for which it has been theirs;
# people within it; side that comes next
HOLDER, HELD, INSIDE, NEXT = range(4)
FREE = -1  # no gate
BOTH = 2.0

NEAR_GATE = 2.0  # m from a gate: a group goes on in file
PASSED = 0.35  # m behind a gate: a person has passed it
AIM_BEYOND, AIM_BEFORE = 0.6, 0.45  # m from a gate: where people walk to who are before its opening, or beside it
EDGE = 0.35  # m that people keep from the sides of a gate, if it is wide enough
LANES, CROWD_LANES = 1.4, 2.2  # m: in wider gates two people pass each other, and two crowds do
FEW = 2  # people are no crowd
DEMAND = 3.0  # m from a gate: people count who want to pass it
TURN = 5.0  # s after which a gate is the other side's, if people wait there
ROOM = 1.4  # m from a gate's middle: nearer nobody waits
ASIDE = 0.6  # cosine of the smallest angle between a gate's axis and the place of a waiting person
NEAR_POINT = 0.5  # m: a point of the way counts as passed
AHEAD, FAR_AHEAD = 1.5, 3.5  # m ahead of the last of the group: people slow down, and wait
SLOW = 0.4  # share of the speed of those who are ahead
ROOMY = 2.0  # m from a gate: nearer nobody waits for the group
LEAVE_RADIUS = 0.8  # m


@njit(cache=True)
def sees(ax, ay, bx, by, closed, skip, also):  # type: ignore[no-untyped-def]
    """Returns True if no closed segment but those of indices `skip` and `also` crosses the segment from a to b."""
    for k in range(len(closed)):
        if k == skip or k == also:
            continue
        px, py, qx, qy = closed[k, 0], closed[k, 1], closed[k, 2], closed[k, 3]
        if (max(px, qx) < min(ax, bx)) or (min(px, qx) > max(ax, bx)):
            continue
        if (max(py, qy) < min(ay, by)) or (min(py, qy) > max(ay, by)):
            continue
        ux, uy = bx - ax, by - ay
        s1, s2 = ux * (py - ay) - uy * (px - ax), ux * (qy - ay) - uy * (qx - ax)
        wx, wy = qx - px, qy - py
        s3, s4 = wx * (ay - py) - wy * (ax - px), wx * (by - py) - wy * (bx - px)
        if s1 * s2 < 0.0 and s3 * s4 < 0.0:
            return False
    return True


@njit(cache=True)
def in_sight(points, nodes, closed, first):  # type: ignore[no-untyped-def]
    """Returns the distances (M, N), m, of points (M, 2) from nodes (N, 2), the first of which are the middles of the gates;
    inf where a closed segment lies between them."""
    gates = len(closed) - first
    out = np.full((len(points), len(nodes)), np.inf)
    for i in range(len(points)):
        for n in range(len(nodes)):
            if sees(points[i, 0], points[i, 1], nodes[n, 0], nodes[n, 1], closed, first + n if n < gates else -1, -1):
                out[i, n] = sqrt((nodes[n, 0] - points[i, 0]) ** 2 + (nodes[n, 1] - points[i, 1]) ** 2)
    return out


@njit(cache=True)
def between(nodes, closed, first):  # type: ignore[no-untyped-def]
    """Returns the distances (N, N), m, of nodes as in `in_sight`; inf where a closed segment lies between them."""
    gates, n = len(closed) - first, len(nodes)
    out = np.full((n, n), np.inf)
    for i in range(n):
        for j in range(i):
            a, b = first + i if i < gates else -1, first + j if j < gates else -1
            if sees(nodes[i, 0], nodes[i, 1], nodes[j, 0], nodes[j, 1], closed, a, b):
                out[i, j] = sqrt((nodes[i, 0] - nodes[j, 0]) ** 2 + (nodes[i, 1] - nodes[j, 1]) ** 2)
                out[j, i] = out[i, j]
    return out


@njit(cache=True)
def first_hop(x, y, tx, ty, gate, nodes, far, closed, first):  # type: ignore[no-untyped-def]
    """Returns the node at which the shortest way from (x, y) to (tx, ty) begins; -1 if there is none.

    gate: that the point is the middle of, FREE for none. nodes (N, 2): middles of gates, then points round the ends of
    walls. far (N, N): lengths of the shortest ways between nodes, inf for none.
    """
    gates, best, found = len(closed) - first, np.inf, -1
    own = first + gate if gate >= 0 else -1
    for n in range(len(nodes)):
        through = first + n if n < gates else -1
        if not sees(x, y, nodes[n, 0], nodes[n, 1], closed, through, -1):
            continue
        here = sqrt((nodes[n, 0] - x) ** 2 + (nodes[n, 1] - y) ** 2)
        if here >= best:
            continue
        for m in range(len(nodes)):
            whole = here + far[n, m]
            if whole >= best:
                continue
            if gate >= 0 and m == gate:
                best, found = whole, n
                continue
            whole += sqrt((nodes[m, 0] - tx) ** 2 + (nodes[m, 1] - ty) ** 2)
            if whole < best and sees(tx, ty, nodes[m, 0], nodes[m, 1], closed, first + m if m < gates else -1, own):
                best, found = whole, n
    return found


@njit(cache=True)
def _across(gates, k, x, y):  # type: ignore[no-untyped-def]
    """Returns the distances of (x, y) from gate k, along it from its middle and across it to its left, and its length."""
    ux, uy = gates[k, 2] - gates[k, 0], gates[k, 3] - gates[k, 1]
    width = sqrt(ux * ux + uy * uy)
    ux, uy = ux / width, uy / width
    dx, dy = x - 0.5 * (gates[k, 0] + gates[k, 2]), y - 0.5 * (gates[k, 1] + gates[k, 3])
    return dx * ux + dy * uy, dy * ux - dx * uy, width


@njit(cache=True)
def _point(gates, k, along, across):  # type: ignore[no-untyped-def]
    """Returns the point of these distances from the middle of gate k, as of `_across`."""
    ux, uy = gates[k, 2] - gates[k, 0], gates[k, 3] - gates[k, 1]
    width = sqrt(ux * ux + uy * uy)
    ux, uy = ux / width, uy / width
    mx, my = 0.5 * (gates[k, 0] + gates[k, 2]), 0.5 * (gates[k, 1] + gates[k, 3])
    return mx + along * ux - across * uy, my + along * uy + across * ux


@njit(cache=True)
def _walk_through(gates, k, x, y, side, opposed, may_pass):  # type: ignore[no-untyped-def]
    """Returns the point to walk to for a person at (x, y) who wants to pass gate k from `side`, and if they walk at all.

    opposed: people come from the other side. may_pass: False if they have the gate.
    """
    along, across, width = _across(gates, k, x, y)
    low = -max(0.5 * width - EDGE, 0.0)
    high = -low
    if opposed and width > LANES:  # keeps to the right
        if side > 0.0:
            high = 0.0 + min(high, 0.0)
            low, high = low, -0.15
        else:
            low, high = 0.15, high
    q = min(max(along, low), high)
    before = across * side  # positive: not passed yet
    if not may_pass and before > 0.0:
        d = sqrt(along * along + across * across)
        c = abs(across) / max(d, 1e-9)
        if d > ROOM and (c < ASIDE or d > ROOM + 0.6):
            return x, y, False
        turn = 1.0 if along > 0.0 else -1.0
        if abs(along) < 0.1:  # to the right
            turn = -side
        c = min(c, ASIDE)
        d = max(d, ROOM + 0.1)
        s = sqrt(1.0 - c * c)
        a, b = _point(gates, k, turn * s * d, side * c * d)
        return a, b, True
    beside = abs(along - q)
    if beside > 0.15 + 0.8 * max(before, 0.0):
        a, b = _point(gates, k, q, side * AIM_BEFORE)
    else:
        a, b = _point(gates, k, q, -side * AIM_BEYOND)
    return a, b, True


@njit(cache=True)
def _take_turns(gates, state, wants, side, gate_state, opposed, dt):  # type: ignore[no-untyped-def]
    """Decides which side may pass each narrow gate. wants (P,): the gate a person walks to, FREE for none; side (P,): from
    which. Overwrites opposed (K, 2): flags, people wait on the right side, on the left."""
    n = len(gates)
    waiting = np.zeros((n, 2), np.int64)
    nearest = np.full((n, 2), np.inf)
    inside = np.zeros(n, np.int64)
    for i in range(len(wants)):
        k = wants[i]
        if k < 0:
            continue
        along, across, width = _across(gates, k, state[i, X], state[i, Y])
        d = sqrt(along * along + across * across)
        s = 1 if side[i] > 0.0 else 0
        if abs(along) < 0.5 * width and (across * side[i] < 0.35):
            inside[k] += 1
        if d < DEMAND:
            waiting[k, s] += 1
            nearest[k, s] = min(nearest[k, s], d)
    for k in range(n):
        opposed[k, 0], opposed[k, 1] = waiting[k, 1] > 0, waiting[k, 0] > 0
        _, _, width = _across(gates, k, 0.0, 0.0)
        if width > CROWD_LANES or (width > LANES and min(waiting[k, 0], waiting[k, 1]) <= FEW):
            gate_state[k, HOLDER], gate_state[k, HELD] = BOTH, 0.0
            continue
        h = gate_state[k, HOLDER] if gate_state[k, HOLDER] != BOTH else 0.0
        gate_state[k, HOLDER] = h
        gate_state[k, HELD] += dt
        if h == 0.0:
            if inside[k] == 0 or gate_state[k, HELD] > 4.0:
                if waiting[k, 0] + waiting[k, 1] == 0:
                    continue
                to = gate_state[k, NEXT]
                if to == 0.0 or waiting[k, 1 if to > 0.0 else 0] == 0:
                    to = 1.0 if nearest[k, 1] < nearest[k, 0] else -1.0
                gate_state[k, HOLDER], gate_state[k, HELD] = to, 0.0
        else:
            own, other = waiting[k, 1 if h > 0.0 else 0], waiting[k, 0 if h > 0.0 else 1]
            if own == 0 or (other > 0 and gate_state[k, HELD] > TURN):
                gate_state[k, HOLDER], gate_state[k, HELD], gate_state[k, NEXT] = 0.0, 0.0, -h


@njit(cache=True)
def find_ways(  # type: ignore[no-untyped-def]
    t, state, there, group_of, queue_mode, target, waypoint, alone_now, aim, share, alone_gone,
    route, kind, gate, length, current, filing, since, finish,
    nodes, far, closed, first, gate_state, dt, wait_time,
):  # fmt: skip
    """Decides for all people present how they walk until the next tick of the script.

    state (P, 4), there (P,), group_of (P,): as in World, by column. queue_mode (P,): True for people who walk to `target`
    (P, 2), m. Updated: waypoint (P,); filing (G,), since (G,) s, current (G,). Overwritten: alone_now (P,): IN_GROUP, TO_TARGET
    or ALONE; aim (P, 2) m and share (P,) of the speed, for people who walk alone; alone_gone (P,): True for who has come
    to the end of the way alone, and leaves.
    """
    people, groups, gates = len(state), len(length), closed[first:]
    count, mx, my = np.zeros(groups, np.int64), np.zeros(groups), np.zeros(groups)
    for i in range(people):
        alone_gone[i] = False
        if there[i] and not queue_mode[i]:
            g = group_of[i]
            count[g] += 1
            mx[g] += state[i, X]
            my[g] += state[i, Y]
    for g in range(groups):
        if count[g]:
            mx[g] /= count[g]
            my[g] /= count[g]
    # Which groups go in file. A group of which all see its middle, and whose middle sees the next point, walks together.
    together = np.ones(groups, np.bool_)
    least, most = np.full(groups, 1 << 30), np.full(groups, -1)
    for g in range(groups):
        if not count[g] or not length[g]:
            continue
        w = current[g]
        k = gate[g, w]
        if not filing[g]:
            if kind[g, w] == GATHER:
                continue
            if k >= 0:
                along, across, width = _across(gates, k, mx[g], my[g])
                beside = max(abs(along) - 0.5 * width, 0.0)
                together[g] = beside * beside + across * across > NEAR_GATE * NEAR_GATE
            if not sees(mx[g], my[g], route[g, w, 0], route[g, w, 1], closed, first + k if k >= 0 else -1, -1):
                together[g] = False
    for i in range(people):
        if not there[i] or queue_mode[i]:
            continue
        g = group_of[i]
        if not filing[g]:
            waypoint[i] = current[g]
            if count[g] > 1 and kind[g, current[g]] != GATHER:
                if not sees(state[i, X], state[i, Y], mx[g], my[g], closed, -1, -1):
                    together[g] = False
    for g in range(groups):
        if not filing[g] and not together[g]:
            filing[g] = True
            since[g] = t
    # Who files passes the points of the way alone.
    wants, side = np.full(people, FREE), np.zeros(people)
    lost = np.zeros(people, np.bool_)
    for i in range(people):
        alone_now[i] = False
        if not there[i]:
            continue
        g = group_of[i]
        x, y = state[i, X], state[i, Y]
        if queue_mode[i] or not filing[g]:
            continue
        last = length[g] - 1
        w = min(waypoint[i], last)
        while w < last:
            k = gate[g, w]
            if k >= 0:
                along, across, width = _across(gates, k, x, y)
                _, to, _ = _across(gates, k, route[g, w + 1, 0], route[g, w + 1, 1])
                ahead = 1.0 if to > 0.0 else -1.0
                if not (across * ahead > PASSED and abs(along) < 0.5 * width + 1.0):
                    break
            else:
                dx, dy = route[g, w, 0] - x, route[g, w, 1] - y
                if dx * dx + dy * dy > NEAR_POINT * NEAR_POINT:
                    k = gate[g, w + 1]
                    if not sees(x, y, route[g, w + 1, 0], route[g, w + 1, 1], closed, first + k if k >= 0 else -1, -1):
                        break
                    if dx * dx + dy * dy > 9.0:
                        break
            w += 1
        waypoint[i] = w
        least[g], most[g] = min(least[g], w), max(most[g], w)
    for g in range(groups):
        if filing[g] and count[g]:
            current[g] = least[g]
            w = current[g]
            k = gate[g, w]
            again = least[g] == most[g]
            if k >= 0:
                along, across, width = _across(gates, k, mx[g], my[g])
                beside = max(abs(along) - 0.5 * width, 0.0)
                again = again and beside * beside + across * across > (NEAR_GATE + 0.5) ** 2
            own = first + k if k >= 0 else -1
            together[g] = again and sees(mx[g], my[g], route[g, w, 0], route[g, w, 1], closed, own, -1)
    for i in range(people):
        if there[i] and not queue_mode[i] and filing[group_of[i]]:
            g = group_of[i]
            if not sees(state[i, X], state[i, Y], mx[g], my[g], closed, -1, -1):
                together[g] = False
    for g in range(groups):
        if filing[g] and together[g]:
            filing[g] = False
    # Where everybody walks to who does not walk in a formation.
    for i in range(people):
        if not there[i]:
            continue
        g = group_of[i]
        x, y = state[i, X], state[i, Y]
        w, k = waypoint[i], FREE
        if queue_mode[i]:
            tx, ty = target[i, 0], target[i, 1]
        elif filing[g]:
            tx, ty, k = route[g, w, 0], route[g, w, 1], gate[g, w]
        elif kind[g, current[g]] == GATHER:
            tx, ty = route[g, current[g], 0], route[g, current[g], 1]
        else:
            continue
        alone = filing[g] and not queue_mode[i]
        if not sees(x, y, tx, ty, closed, first + k if k >= 0 else -1, -1):
            n = first_hop(x, y, tx, ty, k, nodes, far, closed, first)
            if n >= 0:
                alone = True
                lost[i] = True
                tx, ty = nodes[n, 0], nodes[n, 1]
                k = n if n < len(gates) else FREE
        if not alone:
            continue
        alone_now[i] = True
        aim[i, 0], aim[i, 1], share[i] = tx, ty, 1.0
        if k >= 0:
            wants[i] = k
            _, across, _ = _across(gates, k, x, y)
            side[i] = 1.0 if across > 0.0 else -1.0
            if not lost[i] and w < length[g] - 1:
                _, to, _ = _across(gates, k, route[g, w + 1, 0], route[g, w + 1, 1])
                side[i] = -1.0 if to > 0.0 else 1.0
    opposed = np.zeros((len(gates), 2), np.bool_)
    _take_turns(gates, state, wants, side, gate_state, opposed, dt)
    for i in range(people):
        if not there[i] or not alone_now[i]:
            continue
        k = wants[i]
        x, y = state[i, X], state[i, Y]
        waits = False
        if k >= 0:
            h = gate_state[k, HOLDER]
            along, across, width = _across(gates, k, x, y)
            through = across * side[i] < 0.35 and abs(along) < 0.5 * width
            may = h == BOTH or h == side[i] or through
            against = opposed[k, 1 if side[i] > 0.0 else 0]
            aim[i, 0], aim[i, 1], moves = _walk_through(gates, k, x, y, side[i], against, may)
            share[i] = 1.0 if moves else 0.0
            waits = not may
        g = group_of[i]
        if waits or queue_mode[i] or not filing[g] or lost[i]:
            continue
        w = waypoint[i]
        # Who is ahead waits for the last of the group, but not at a gate.
        if count[g] > 1 and t - since[g] < wait_time:
            gap = 0.0
            dx, dy = route[g, w, 0] - x, route[g, w, 1] - y
            own = sqrt(dx * dx + dy * dy)
            for j in range(people):
                if there[j] and group_of[j] == g and j != i and not queue_mode[j]:
                    ex, ey = route[g, w, 0] - state[j, X], route[g, w, 1] - state[j, Y]
                    if waypoint[j] < w or (waypoint[j] == w and sqrt(ex * ex + ey * ey) > own):
                        gap = max(gap, sqrt((state[j, X] - x) ** 2 + (state[j, Y] - y) ** 2))
            if gap > AHEAD:
                share[i] *= SLOW
            if gap > FAR_AHEAD:
                clear = True
                for m in range(len(gates)):
                    along, across, width = _across(gates, m, x, y)
                    beside = max(abs(along) - 0.5 * width, 0.0)
                    clear = clear and beside * beside + across * across > ROOMY * ROOMY
                if clear:
                    share[i] = 0.0
        elif w == length[g] - 1 and kind[g, w] == END and finish[g] == LEAVE and count[g] > 1:
            dx, dy = route[g, w, 0] - x, route[g, w, 1] - y
            alone_gone[i] = dx * dx + dy * dy < LEAVE_RADIUS * LEAVE_RADIUS
