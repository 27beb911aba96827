"""Compiled loops of `sim.crowd.wayfinding`: who sees what, who files, who waits at a gate, where each person walks to.

Segments `closed` (S, 4) are x1, y1, x2, y2 of walls, then of the K gates, m; `first` is the index of the first gate.
Arrays of people (P, …) are by column, those of groups (G, …) by index, as in GroupState and GroupArrays.
"""

from __future__ import annotations

from math import sqrt

import numpy as np

from sim.compiler import njit
from sim.crowd.forces import BOTH, CORNER, END, FREE, GATHER, HELD, HOLDER, LEAVE, NEXT, SHUT, X, Y

BODY, TOUCH = 0.2, 0.01  # m: people walk no nearer past the end of a wall; ends so near are one
STEP_ASIDE = 0.5  # m ahead: past ends of walls so near to them people squeeze
NEAR_GATE = 2.0  # m from a gate: a group goes on in file
PASSED = 0.35  # m behind a gate: a person has passed it
AIM_BEYOND, AIM_BEFORE = 0.6, 0.45  # m from a gate: where people walk to who are before its opening, or beside it
EDGE, MIDDLE = 0.35, 0.15  # m that people keep from the sides of a gate, and from its middle while others come
LANES = 1.4  # m: in wider gates two people pass each other
DEMAND = 3.0  # m from a gate: people count who want to pass it
TURN = 8.0  # s after which a gate is the other side's, if people wait there
CLEARED = 4.0  # s after which a gate counts as left, whoever is in it
ROOM, RING = 1.4, 0.6  # m from a gate's middle, and m beyond: nobody waits there, or not before the opening
ASIDE = 0.6  # cosine of the smallest angle between a gate's axis and the place of a waiting person
BESIDE = 1.0  # m beside a gate, behind it: it is passed, too
NEAR_POINT = 0.5  # m: a point of the way counts as passed
AHEAD, FAR_AHEAD = 1.5, 3.5  # m ahead of the last of the group: people slow down, and wait
SLOW = 0.4  # share of the speed of those who are ahead
ROOMY = 2.0  # m from a gate: nearer nobody waits for the group
LEAVE_RADIUS = 0.8  # m


@njit(cache=True)
def _ends(x, y, closed, k):  # type: ignore[no-untyped-def]
    """Returns True if (x, y) is an end of the closed segment k; k < 0: False."""
    if k < 0:
        return False
    first = abs(closed[k, 0] - x) + abs(closed[k, 1] - y) < TOUCH
    return first or abs(closed[k, 2] - x) + abs(closed[k, 3] - y) < TOUCH


@njit(cache=True)
def sees(ax, ay, bx, by, closed, first, skip, also):  # type: ignore[no-untyped-def]
    """Returns True if a body has room on the segment from a to b: no closed segment but those of indices `skip` and
    `also` crosses it, and no end of a wall further along than STEP_ASIDE, but at their sides, is nearer than BODY."""
    ux, uy = bx - ax, by - ay
    size = ux * ux + uy * uy
    step = STEP_ASIDE * sqrt(size)
    for k in range(len(closed)):
        px, py, qx, qy = closed[k, 0], closed[k, 1], closed[k, 2], closed[k, 3]
        if max(px, qx) < min(ax, bx) - BODY or min(px, qx) > max(ax, bx) + BODY or k in (skip, also):
            continue
        if max(py, qy) < min(ay, by) - BODY or min(py, qy) > max(ay, by) + BODY:
            continue
        s1, s2 = ux * (py - ay) - uy * (px - ax), ux * (qy - ay) - uy * (qx - ax)
        wx, wy = qx - px, qy - py
        s3, s4 = wx * (ay - py) - wy * (ax - px), wx * (by - py) - wy * (bx - px)
        if s1 * s2 < 0.0 and s3 * s4 < 0.0:
            return False
        if k < first:
            along, further = ux * (px - ax) + uy * (py - ay), ux * (qx - ax) + uy * (qy - ay)
            near = step < along < size and s1 * s1 < BODY * BODY * size
            if near and not (_ends(px, py, closed, skip) or _ends(px, py, closed, also)):
                return False
            near = step < further < size and s2 * s2 < BODY * BODY * size
            if near and not (_ends(qx, qy, closed, skip) or _ends(qx, qy, closed, also)):
                return False
    return True


@njit(cache=True)
def _apart(ax, ay, bx, by):  # type: ignore[no-untyped-def]
    return sqrt((ax - bx) * (ax - bx) + (ay - by) * (ay - by))


@njit(cache=True)
def in_sight(points, nodes, closed, first):  # type: ignore[no-untyped-def]
    """Returns the distances (M, N), m, of points (M, 2) from nodes (N, 2); inf if a closed segment is between them.

    The first nodes are the middles of the gates.
    """
    gates = len(closed) - first
    out = np.full((len(points), len(nodes)), np.inf)
    for i in range(len(points)):
        for n in range(len(nodes)):
            if sees(
                points[i, 0], points[i, 1], nodes[n, 0], nodes[n, 1], closed, first, first + n if n < gates else -1, -1
            ):
                out[i, n] = _apart(nodes[n, 0], nodes[n, 1], points[i, 0], points[i, 1])
    return out


@njit(cache=True)
def between(nodes, closed, first):  # type: ignore[no-untyped-def]
    """Returns the distances (N, N), m, of nodes as in `in_sight`; inf where a closed segment lies between them."""
    gates, n = len(closed) - first, len(nodes)
    out = np.full((n, n), np.inf)
    for i in range(n):
        for j in range(i):
            a, b = first + i if i < gates else -1, first + j if j < gates else -1
            if sees(nodes[i, 0], nodes[i, 1], nodes[j, 0], nodes[j, 1], closed, first, a, b):
                out[i, j] = _apart(nodes[i, 0], nodes[i, 1], nodes[j, 0], nodes[j, 1])
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
        if not sees(x, y, nodes[n, 0], nodes[n, 1], closed, first, through, -1):
            continue
        here = _apart(nodes[n, 0], nodes[n, 1], x, y)
        if here >= best:
            continue
        for m in range(len(nodes)):
            whole = here + far[n, m]
            if whole >= best:
                continue
            if gate >= 0 and m == gate:
                best, found = whole, n
                continue
            whole += _apart(nodes[m, 0], nodes[m, 1], tx, ty)
            if whole < best and sees(
                tx, ty, nodes[m, 0], nodes[m, 1], closed, first, first + m if m < gates else -1, own
            ):
                best, found = whole, n
    return found


@njit(cache=True)
def _across(gates, k, x, y):  # type: ignore[no-untyped-def]
    """Returns the distances of (x, y) from the middle of gate k, along it and to its left, and the gate's width, m."""
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
    """Returns the point to walk to for a person at (x, y) who wants to pass gate k from `side`, and if to walk at all.

    opposed: people come from the other side. may_pass: False if it is not this side's turn.
    """
    along, across, width = _across(gates, k, x, y)
    low = -max(0.5 * width - EDGE, 0.0)
    high = -low
    if opposed and width > LANES:  # keeps to the right
        if side > 0.0:
            high = -MIDDLE
        else:
            low = MIDDLE
    q = min(max(along, low), high)
    before = across * side  # positive: not passed yet
    if not may_pass and before > 0.0:
        d = sqrt(along * along + across * across)
        c = abs(across) / max(d, 1e-9)
        if d > ROOM and (c < ASIDE or d > ROOM + RING):
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
def _take_turns(gates, state, wants, side, gate_state, dt):  # type: ignore[no-untyped-def]
    """Decides which side may pass each narrow gate; returns flags (K, 2): people come from the left, from the right.

    wants (P,): the gate to which a person walks, FREE for none. side (P,): from its left (1.0) or right (-1.0). dt: s.
    """
    n = len(gates)
    opposed = np.zeros((n, 2), np.bool_)
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
        if abs(along) < 0.5 * width and across * side[i] < PASSED:
            inside[k] += 1
        if d < DEMAND:
            waiting[k, s] += 1
            nearest[k, s] = min(nearest[k, s], d)
    for k in range(n):
        opposed[k, 0], opposed[k, 1] = waiting[k, 1] > 0, waiting[k, 0] > 0
        _, _, width = _across(gates, k, 0.0, 0.0)
        if gate_state[k, HOLDER] >= SHUT:
            continue
        if width > LANES and gate_state[k, HELD] >= 0.0:
            gate_state[k, HOLDER], gate_state[k, HELD] = BOTH, 0.0
            continue
        h = gate_state[k, HOLDER] if gate_state[k, HOLDER] != BOTH else 0.0
        gate_state[k, HOLDER] = h
        gate_state[k, HELD] += dt
        if h == 0.0:
            if inside[k] == 0 or gate_state[k, HELD] > CLEARED:
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
    return opposed


@njit(cache=True)
def _near(gates, k, x, y, reach):  # type: ignore[no-untyped-def]
    """Returns True if (x, y) is within `reach` m of gate k."""
    along, across, width = _across(gates, k, x, y)
    beside = max(abs(along) - 0.5 * width, 0.0)
    return beside * beside + across * across <= reach * reach


@njit(cache=True)
def _sees_point(x, y, point, k, closed, first):  # type: ignore[no-untyped-def]
    """Returns True if a point (2,) of a way, in the middle of gate k or of none (FREE), is seen from (x, y)."""
    return sees(x, y, point[X], point[Y], closed, first, first + k if k >= 0 else -1, -1)


@njit(cache=True)
def _middles(state, walks, group_of, groups):  # type: ignore[no-untyped-def]
    """Returns number (G,) and mean place (G, 2) of the people of each group who walk."""
    count, middle = np.zeros(groups, np.int64), np.zeros((groups, 2))
    for i in range(len(state)):
        if walks[i]:
            g = group_of[i]
            count[g] += 1
            middle[g, X] += state[i, X]
            middle[g, Y] += state[i, Y]
    for g in range(groups):
        if count[g]:
            middle[g] /= count[g]
    return count, middle


@njit(cache=True)
def _start_files(  # type: ignore[no-untyped-def]
    t, state, walks, group_of, count, middle, waypoint, route, kind, gate, length, current, filing, since, closed, first
):
    """Lets groups go in file from time t (s) that are at a gate, or of which one does not see the middle, or the middle
    not the next point of the way."""
    for g in range(len(length)):
        w = current[g]
        if count[g] and length[g] and not filing[g] and kind[g, w] != GATHER:
            x, y = middle[g, X], middle[g, Y]
            while gate[g, w] == CORNER and _sees_point(x, y, route[g, w + 1], gate[g, w + 1], closed, first):
                w += 1
            current[g] = w
            k = gate[g, w]
            at_gate = k >= 0 and _near(closed[first:], k, x, y, NEAR_GATE)
            if at_gate or not _sees_point(x, y, route[g, w], k, closed, first):
                filing[g], since[g] = True, t
    for i in range(len(state)):
        g = group_of[i]
        if walks[i] and not filing[g]:
            waypoint[i] = current[g]
            if kind[g, current[g]] != GATHER and not _sees_point(
                state[i, X], state[i, Y], middle[g], FREE, closed, first
            ):
                filing[g], since[g] = True, t
    for i in range(len(state)):
        if walks[i] and filing[group_of[i]] and since[group_of[i]] == t:
            waypoint[i] = current[group_of[i]]


@njit(cache=True)
def _passes(x, y, g, w, route, gate, beyond, closed, first):  # type: ignore[no-untyped-def]
    """Returns True if a person at (x, y) has passed point w of the way of group g, which is not its last."""
    k = gate[g, w]
    if k >= 0:
        along, across, width = _across(closed[first:], k, x, y)
        return across * beyond[g, w] > PASSED and abs(along) < 0.5 * width + BESIDE
    if _apart(route[g, w, X], route[g, w, Y], x, y) <= NEAR_POINT:
        return True
    return k == CORNER and _sees_point(x, y, route[g, w + 1], gate[g, w + 1], closed, first)


@njit(cache=True)
def _end_files(  # type: ignore[no-untyped-def]
    state, walks, group_of, count, middle, waypoint, route, gate, current, filing, closed, first
):
    """Lets groups walk together again whose people have passed the same points and see each other, off their gate."""
    groups = len(current)
    least, most = np.full(groups, 1 << 30), np.full(groups, -1)
    for i in range(len(state)):
        if walks[i]:
            g = group_of[i]
            least[g], most[g] = min(least[g], waypoint[i]), max(most[g], waypoint[i])
    together = np.zeros(groups, np.bool_)
    for g in range(groups):
        if filing[g] and count[g]:
            current[g] = least[g]
            w, k = least[g], gate[g, least[g]]
            x, y = middle[g, X], middle[g, Y]
            at_gate = k >= 0 and _near(closed[first:], k, x, y, NEAR_GATE + 0.5)
            together[g] = least[g] == most[g] and not at_gate and _sees_point(x, y, route[g, w], k, closed, first)
    for i in range(len(state)):
        if walks[i] and together[group_of[i]]:
            together[group_of[i]] = _sees_point(state[i, X], state[i, Y], middle[group_of[i]], FREE, closed, first)
    for g in range(groups):
        filing[g] = filing[g] and not together[g]


@njit(cache=True)
def _share_of_waiting(i, state, walks, group_of, waypoint, route, gates):  # type: ignore[no-untyped-def]
    """Returns the share of the speed of person i, who is ahead of others of the group and waits for them."""
    g, w, x, y = group_of[i], waypoint[i], state[i, X], state[i, Y]
    own, gap = _apart(route[g, w, X], route[g, w, Y], x, y), 0.0
    for j in range(len(state)):
        if j != i and walks[j] and group_of[j] == g:
            other = _apart(route[g, w, X], route[g, w, Y], state[j, X], state[j, Y])
            if waypoint[j] < w or (waypoint[j] == w and other > own):
                gap = max(gap, _apart(state[j, X], state[j, Y], x, y))
    if gap <= AHEAD:
        return 1.0
    if gap > FAR_AHEAD:
        clear = True
        for k in range(len(gates)):
            clear = clear and not _near(gates, k, x, y, ROOMY)
        if clear:
            return 0.0
    return SLOW


@njit(cache=True)
def find_ways(  # type: ignore[no-untyped-def]
    t, state, there, waits, group_of, target, waypoint, alone, aim, share, gone,
    route, kind, gate, beyond, length, current, filing, since, finish,
    nodes, far, closed, first, gate_state, dt, wait_time,
):  # fmt: skip
    """Decides at time t (s) how all people walk for the next dt s.

    state (P, 4), m, m/s; there (P,): who is present. waits (P,): True for people who walk to `target` (P, 2), m, and
    stand there. beyond (G, W): side of the gate to which a way leads, 1.0 for its left, or -1.0. wait_time: s for which
    a group in file waits for its last. Returns whether somebody walks alone, or did before, and whether a group has
    waited so long. Overwritten: alone (P,), and for those who walk alone aim (P, 2), m, and share (P,) of the speed;
    gone (P,): True for who has come to the end of the way alone and leaves. Updated: waypoint (P,), filing (G,), since
    (G,), s, current (G,), gate_state (K, 3).
    """
    people, gates, walks, changed = len(state), closed[first:], there & ~waits, alone.any()
    count, middle = _middles(state, walks, group_of, len(length))
    _start_files(
        t, state, walks, group_of, count, middle, waypoint, route, kind, gate, length, current, filing, since, closed,
        first,
    )  # fmt: skip
    for i in range(people):
        g = group_of[i]
        while walks[i] and filing[g] and waypoint[i] < length[g] - 1:
            if not _passes(state[i, X], state[i, Y], g, waypoint[i], route, gate, beyond, closed, first):
                break
            waypoint[i] += 1
    _end_files(state, walks, group_of, count, middle, waypoint, route, gate, current, filing, closed, first)
    wants, side, lost = np.full(people, FREE), np.zeros(people), np.zeros(people, np.bool_)
    for i in range(people):
        alone[i] = gone[i] = False
        if not there[i]:
            continue
        g, x, y, k = group_of[i], state[i, X], state[i, Y], FREE
        alone[i] = walks[i] and filing[g]
        if waits[i]:
            tx, ty = target[i, X], target[i, Y]
        elif filing[g] or kind[g, current[g]] == GATHER:
            w = waypoint[i] if filing[g] else current[g]
            tx, ty, k = route[g, w, X], route[g, w, Y], gate[g, w]
        else:
            continue
        if not sees(x, y, tx, ty, closed, first, first + k if k >= 0 else -1, -1):
            n = first_hop(x, y, tx, ty, k, nodes, far, closed, first)
            if n >= 0:
                alone[i] = lost[i] = True
                tx, ty, k = nodes[n, X], nodes[n, Y], n if n < len(gates) else FREE
        aim[i, X], aim[i, Y], share[i] = tx, ty, 1.0
        if alone[i] and k >= 0:
            wants[i] = k
            _, across, _ = _across(gates, k, x, y)
            if not lost[i] and waypoint[i] < length[g] - 1:  # also for who stands behind the gate already
                across = -beyond[g, waypoint[i]]
            side[i] = 1.0 if across > 0.0 else -1.0
    late = False
    for g in range(len(length)):
        late = late or (filing[g] and t - since[g] >= wait_time)
    if not alone.any():
        return changed, late
    opposed = _take_turns(gates, state, wants, side, gate_state, dt)
    for i in range(people):
        if not there[i] or not alone[i]:
            continue
        g, k, x, y, may = group_of[i], wants[i], state[i, X], state[i, Y], True
        if k >= 0:
            along, across, width = _across(gates, k, x, y)
            within = across * side[i] < PASSED and abs(along) < 0.5 * width
            holder = gate_state[k, HOLDER]
            turn = holder != SHUT and (within or holder == BOTH or holder == side[i])
            may = turn or along * along + across * across > DEMAND * DEMAND
            against = opposed[k, 1 if side[i] > 0.0 else 0]
            aim[i, X], aim[i, Y], moves = _walk_through(gates, k, x, y, side[i], against, may)
            share[i] = 1.0 if moves else 0.0
        if not may or lost[i] or waits[i] or count[g] == 1:
            continue
        w = waypoint[i]
        if t - since[g] < wait_time:
            share[i] *= _share_of_waiting(i, state, walks, group_of, waypoint, route, gates)
        elif w == length[g] - 1 and kind[g, w] == END and finish[g] == LEAVE:
            gone[i] = _apart(route[g, w, X], route[g, w, Y], x, y) < LEAVE_RADIUS
    return True, late
