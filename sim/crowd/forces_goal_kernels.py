"""All forces on people as one kernel, `accelerate`, and its parts towards goals: ways of groups, formations, doors,
queues, stairs, and the sway of strides. A call from Python takes time for each array, so there is one call.

`sim.crowd.forces` names all columns, slots and units.
"""

from __future__ import annotations

from math import sqrt

import numpy as np

from sim.compiler import njit

# isort: off
# fmt: off
from sim.crowd.forces import (
    ALIGN, ALONE, AMPLITUDE, AVOIDED, COHERE, COS, COUNT, END, FLOCK_RANGE, GATHER,
    GATHER_RADIUS, GROUP, HASTE, IN_GROUP, MAX_OFF_PLACE, MEAN_AHEAD, MEAN_LEFT, MEAN_VX, MEAN_VY, MEAN_X, MEAN_Y,
    MODE, PASS, PASS_RADIUS, RADIUS, RELAXATION, SIN, SLOW_TIME, SLOWDOWN, STAND, STRAY_AHEAD, STRAY_LEFT,
    SWAY_X, SWAY_Y, TO_TARGET, TURN_TIME, USUAL_SPEED, VX, VY, WANDER_ALONG, WANDER_LEFT, WANTED_VX, WANTED_VY, X, Y,
)
# fmt: on
# isort: on
from sim.crowd.forces_avoidance_kernels import avoid
from sim.elementary_kernels import atan2, cos, sin
from sim.scene.terrain import AXIS_X, AXIS_Y, FOOT_X, FOOT_Y, HALF_WIDTH, LENGTH

STRIDES = 0.807  # strides per s at 1 m/s: 0.0064 m of step per step/min (Sekiya & Nagasaki 1998)
SWAYLESS = 2.70  # m/s: on the line through amplitudes of 0.0350 m at 0.7 m/s and 0.0193 m at 1.6 m/s (Orendurff 2004)
SLOW = 0.3  # m/s: below, the amplitude falls to 0 with the speed
PI = 3.141592653589793


@njit(cache=True)
def _sway(wanted, gait, dt, out):  # type: ignore[no-untyped-def]
    """Adds the acceleration by the sway of the strides to out (N, 2), and advances gait (N, 5) by dt (s).

    The sway is A(v) sin(phase) to the left of the wanted velocity (N, 2) of size v. The phase grows by 2 pi STRIDES
    sqrt(v) per s. A is the person's amplitude at USUAL_SPEED; it falls linearly to 0 at SWAYLESS, and below SLOW with
    the speed.
    """
    for i in range(len(gait)):
        pace = sqrt(wanted[i, X] * wanted[i, X] + wanted[i, Y] * wanted[i, Y])
        size = gait[i, AMPLITUDE] * max(0.0, (SWAYLESS - pace) / (SWAYLESS - USUAL_SPEED)) * min(1.0, pace / SLOW)
        rate = 2.0 * PI * STRIDES * sqrt(pace)
        half = 0.5 * rate * dt
        half += half * half * half / 3.0  # the tangent of half the angle by which the phase grows
        c, s, share = gait[i, COS], gait[i, SIN], 2.0 * half / (1.0 + half * half)
        gait[i, COS], gait[i, SIN] = c - share * (s + half * c), s + share * (c - half * s)
        per_speed = size * rate / max(pace, 1e-9)
        left_x, left_y = -per_speed * wanted[i, Y], per_speed * wanted[i, X]
        gait[i, SWAY_X], gait[i, SWAY_Y] = left_x * gait[i, COS], left_y * gait[i, COS]
        out[i, X] += left_x * (gait[i, COS] - c) / dt
        out[i, Y] += left_y * (gait[i, COS] - c) / dt


TINY = 1e-9  # m
TARGET_TIME = 0.7  # s: time in which a person reaches a place in a queue, speed permitting
GATHER_TIME = 0.8  # s: time in which a member reaches its place at the gathering point, speed permitting
STANDING_SPEED = 0.3  # m/s: fastest shift of a group that has arrived; fluctuations grow up to this speed
TURN_DISTANCE = 0.3  # m: nearer to the waypoint the heading is kept
ARRIVED = 0.25  # m from the end
HELD_UP_TIME, HELD_UP_SPEED = 2.0, 0.2  # s, m/s: a group so slow for so long near its end is held up by others
NEAR_GOAL = 2.0  # m: others hold a group up there, and it slows down to turn
TURNING = 0.4  # share of the speed of a group that has the near next point of its way beside or behind it
STRAGGLING = 1.0  # m beyond its distance: the group ahead slows down
LOOSE = 2.2  # m: a group with a larger radius is not avoided as a whole


@njit(cache=True)
def _length(x, y):  # type: ignore[no-untyped-def]
    return sqrt(x * x + y * y)


@njit(cache=True)
def _average(state, noise, tag, status):  # type: ignore[no-untyped-def]
    """Overwrites status (G, 12): number of members, and means of position, velocity and stray of each group."""
    status[:, :AVOIDED] = 0.0
    status[:, MEAN_AHEAD:] = 0.0
    for i in range(len(state)):
        g = tag[i, GROUP]
        status[g, COUNT] += 1.0
        for k in range(4):
            status[g, MEAN_X + k] += state[i, k]
        for k in range(2):
            status[g, MEAN_AHEAD + k] += noise[i, STRAY_AHEAD + k]
    for g in range(len(status)):
        if status[g, COUNT] > 0.0:
            for k in range(MEAN_X, MEAN_VY + 1):
                status[g, k] /= status[g, COUNT]
            for k in range(MEAN_AHEAD, MEAN_LEFT + 1):
                status[g, k] /= status[g, COUNT]


@njit(cache=True)
def _spread(state, place, tag, route, kind, current, heading, status):  # type: ignore[no-untyped-def]
    """Raises RADIUS and MAX_OFF_PLACE of each group to the largest distance of a member, m."""
    for i in range(len(state)):
        g = tag[i, GROUP]
        dx, dy = state[i, X] - status[g, MEAN_X], state[i, Y] - status[g, MEAN_Y]
        status[g, RADIUS] = max(status[g, RADIUS], sqrt(dx * dx + dy * dy))
        hx, hy = heading[g, 0], heading[g, 1]
        mx, my = status[g, MEAN_X], status[g, MEAN_Y]
        w = current[g]
        if kind[g, w] == GATHER:
            mx, my = route[g, w, 0], route[g, w, 1]
        dx = state[i, X] - mx - place[i, 0] * hx + place[i, 1] * hy
        dy = state[i, Y] - my - place[i, 0] * hy - place[i, 1] * hx
        status[g, MAX_OFF_PLACE] = max(status[g, MAX_OFF_PLACE], sqrt(dx * dx + dy * dy))


@njit(cache=True)
def _ways_left(route, length, current, status, head):  # type: ignore[no-untyped-def]
    """Returns the length (G,) of the way that each group of a procession has before it, m; (0,) without processions."""
    n = len(head)
    out = np.zeros(n if (head != np.arange(n)).any() else 0)
    for g in range(len(out)):
        if head[g] != g or (g + 1 < n and head[g + 1] == g):
            x, y = status[g, MEAN_X], status[g, MEAN_Y]
            for w in range(current[g], length[g]):
                out[g] += _length(route[g, w, 0] - x, route[g, w, 1] - y)
                x, y = route[g, w, 0], route[g, w, 1]
    return out


@njit(cache=True)
def _room_ahead(g, left, head, gap, arrived, status):  # type: ignore[no-untyped-def]
    """Returns by how much a group of a procession is further than its gap from the one ahead, m; inf without one."""
    if head[g] == g or status[g - 1, COUNT] == 0.0:
        return np.inf
    if arrived[g - 1]:  # ways of groups that stand end where they are
        return _length(status[g - 1, MEAN_X] - status[g, MEAN_X], status[g - 1, MEAN_Y] - status[g, MEAN_Y]) - gap[g]
    return left[g] - left[g - 1] - gap[g]


@njit(cache=True)
def _in_procession(g, pace, left, head, gap, boids, arrived, status):  # type: ignore[no-untyped-def]
    """Returns the pace of group g, m/s, by which it follows the group ahead and waits for the one behind, and the room
    ahead, m."""
    room = _room_ahead(g, left, head, gap, arrived, status)
    most = pace * (1.0 + HASTE)
    if room < np.inf:
        follows = _length(status[g - 1, MEAN_VX], status[g - 1, MEAN_VY]) + boids[g, COHERE] * room
        pace = min(max(follows, 0.0), most)
    if g + 1 < len(head) and head[g + 1] == head[g] and status[g + 1, COUNT] > 0.0:
        behind = _room_ahead(g + 1, left, head, gap, arrived, status) - STRAGGLING
        pace = min(pace, max(most - boids[g, COHERE] * max(behind, 0.0), TURNING * most))
    return pace, room


@njit(cache=True)
def _lead_groups(  # type: ignore[no-untyped-def]
    route, kind, length, current, speed, heading, finish, filing, held_up, arrived, status, boids, head, gap, dt
):
    """Advances each group on its way by dt (s), and sets its wanted velocity."""
    left = _ways_left(route, length, current, status, head)
    for g in range(len(status)):
        if status[g, COUNT] == 0.0 or length[g] == 0:
            continue
        w, last = current[g], length[g] - 1
        goal = kind[g, w]
        dx, dy = route[g, w, 0] - status[g, MEAN_X], route[g, w, 1] - status[g, MEAN_Y]
        d = sqrt(dx * dx + dy * dy)
        if (goal == PASS and d < PASS_RADIUS + 0.3 * status[g, RADIUS] and not filing[g]) or (
            goal == GATHER and status[g, MAX_OFF_PLACE] < GATHER_RADIUS
        ):
            if w < last:
                current[g] = w + 1
                w += 1
                goal = kind[g, w]
                dx, dy = route[g, w, 0] - status[g, MEAN_X], route[g, w, 1] - status[g, MEAN_Y]
                d = sqrt(dx * dx + dy * dy)
            elif goal == GATHER:
                arrived[g] = True
        pace, room = speed[g], np.inf
        if len(left):
            pace, room = _in_procession(g, pace, left, head, gap, boids, arrived, status)
            if room < ARRIVED and arrived[g - 1] and finish[g] == STAND:
                arrived[g] = True
        if w == last and goal == END:
            if finish[g] == STAND:
                # A group slows down before an end where it stands.
                pace = min(pace, d / SLOW_TIME)
                if d < ARRIVED:
                    arrived[g] = True
            elif d < PASS_RADIUS:
                arrived[g] = True
            moves = _length(status[g, MEAN_VX], status[g, MEAN_VY]) > HELD_UP_SPEED or arrived[g]
            held_up[g] = 0.0 if moves or d > NEAR_GOAL else held_up[g] + dt
            if held_up[g] > HELD_UP_TIME:
                arrived[g] = True
        if d > TURN_DISTANCE and goal != GATHER and not arrived[g]:
            if d < NEAR_GOAL and heading[g, 0] * dx + heading[g, 1] * dy < 0.5 * d:
                pace *= TURNING  # else it walks round the point for ever
            _turn(heading, g, dx / d, dy / d, dt / TURN_TIME)
        if arrived[g] and finish[g] == STAND:
            # It drifts back to the end of its way.
            status[g, WANTED_VX], status[g, WANTED_VY] = dx / SLOW_TIME, dy / SLOW_TIME
            size = _length(status[g, WANTED_VX], status[g, WANTED_VY])
            if size > STANDING_SPEED:
                status[g, WANTED_VX] *= STANDING_SPEED / size
                status[g, WANTED_VY] *= STANDING_SPEED / size
        else:
            status[g, WANTED_VX], status[g, WANTED_VY] = pace * heading[g, 0], pace * heading[g, 1]


@njit(cache=True)
def _turn(heading, g, ex, ey, share):  # type: ignore[no-untyped-def]
    """Turns row g of heading (G, 2) towards the unit vector (ex, ey) by `share` of the angle between them."""
    hx, hy = heading[g, 0], heading[g, 1]
    angle = atan2(hx * ey - hy * ex, hx * ex + hy * ey) * min(share, 1.0)
    c, s = cos(angle), sin(angle)
    hx, hy = c * hx - s * hy, s * hx + c * hy
    size = sqrt(hx * hx + hy * hy)
    heading[g, 0], heading[g, 1] = hx / size, hy / size


@njit(cache=True)
def _flock(state, tag, flock, middle):  # type: ignore[no-untyped-def]
    """Overwrites middle (N, 4) of the members of flocks: mean position and velocity of their neighbours, or their own.

    Neighbours are members of the flock within FLOCK_RANGE who walk with it.
    """
    for i in range(len(state)):
        if not flock[tag[i, GROUP]]:
            continue
        count = 0
        middle[i] = 0.0
        for j in range(len(state)):
            if j != i and tag[j, GROUP] == tag[i, GROUP] and tag[j, MODE] == IN_GROUP:
                dx, dy = state[i, X] - state[j, X], state[i, Y] - state[j, Y]
                if dx * dx + dy * dy < FLOCK_RANGE * FLOCK_RANGE:
                    middle[i] += state[j]
                    count += 1
        if count:
            middle[i] /= count
        else:
            middle[i] = state[i]


@njit(cache=True)
def _seek(  # type: ignore[no-untyped-def]
    state, place, target, pace, noise, wanted, tag,
    route, kind, length, current, speed, heading, status, flock, boids, middle, stairs, out,
):  # fmt: skip
    """Overwrites out (N, 2) with the acceleration of each person towards its goal."""
    for i in range(len(state)):
        g = tag[i, GROUP]
        x, y, vx, vy = state[i, X], state[i, Y], state[i, VX], state[i, VY]
        w = current[g]
        goal = kind[g, w]
        align, mvx, mvy, on_stairs = 0.0, 0.0, 0.0, 1.0
        if stairs is not None:
            on_stairs = _pace_on_stairs(x, y, stairs)
        if tag[i, MODE] == TO_TARGET:
            limit = pace[i]
            tx, ty = (target[i, 0] - x) / TARGET_TIME, (target[i, 1] - y) / TARGET_TIME
        elif tag[i, MODE] == ALONE:
            limit = pace[i]
            dx, dy = target[i, 0] - x, target[i, 1] - y
            d = max(_length(dx, dy), TINY)
            tx, ty = dx / d * limit, dy / d * limit
        else:
            hx, hy = heading[g, 0], heading[g, 1]
            ahead, left = place[i, 0], place[i, 1]
            if goal != GATHER:
                loose = min(1.0, _length(status[g, WANTED_VX], status[g, WANTED_VY]) / STANDING_SPEED)
                ahead += loose * (noise[i, STRAY_AHEAD] - status[g, MEAN_AHEAD])
                left += loose * (noise[i, STRAY_LEFT] - status[g, MEAN_LEFT])
            ox = ahead * hx - left * hy
            oy = ahead * hy + left * hx
            if goal == GATHER:
                limit = speed[g]
                tx = (route[g, w, 0] + ox - x) / GATHER_TIME
                ty = (route[g, w, 1] + oy - y) / GATHER_TIME
            else:
                own, align = 1.0, boids[g, ALIGN]
                if flock[g]:
                    own = pace[i] / speed[g]
                    mx, my, mvx, mvy = middle[i, X], middle[i, Y], middle[i, VX], middle[i, VY]
                else:
                    mx, my = status[g, MEAN_X] + ox, status[g, MEAN_Y] + oy
                    mvx, mvy = status[g, MEAN_VX], status[g, MEAN_VY]
                limit = speed[g] * (1.0 + HASTE) * own
                tx = on_stairs * own * status[g, WANTED_VX] + boids[g, COHERE] * (mx - x)
                ty = on_stairs * own * status[g, WANTED_VY] + boids[g, COHERE] * (my - y)
        limit *= on_stairs
        size = sqrt(tx * tx + ty * ty)
        if size > limit:
            tx, ty = tx * limit / size, ty * limit / size
            size = limit
        ex, ey = tx / max(size, TINY), ty / max(size, TINY)
        share = min(1.0, size / STANDING_SPEED)
        # Fluctuations are smaller for people who hardly move.
        tx += share * (noise[i, WANDER_ALONG] * ex - noise[i, WANDER_LEFT] * ey)
        ty += share * (noise[i, WANDER_ALONG] * ey + noise[i, WANDER_LEFT] * ex)
        wanted[i, 0], wanted[i, 1] = size * ex, size * ey
        out[i, 0] = (tx - vx) / RELAXATION + align * (mvx - vx)
        out[i, 1] = (ty - vy) / RELAXATION + align * (mvy - vy)


@njit(cache=True)
def _pace_on_stairs(x, y, stairs):  # type: ignore[no-untyped-def]
    """Returns the share of the walking speed that is kept at (x, y); 1.0 off all stairs."""
    for k in range(len(stairs)):
        dx, dy = x - stairs[k, FOOT_X], y - stairs[k, FOOT_Y]
        s = dx * stairs[k, AXIS_X] + dy * stairs[k, AXIS_Y]
        t = dy * stairs[k, AXIS_X] - dx * stairs[k, AXIS_Y]
        if 0.0 <= s <= stairs[k, LENGTH] and abs(t) <= stairs[k, HALF_WIDTH]:
            return stairs[k, SLOWDOWN]
    return 1.0


@njit(cache=True)
def _mark_avoided(filing, status):  # type: ignore[no-untyped-def]
    """Sets AVOIDED of `status` to 1.0 if others avoid the group as a whole, else 0.0."""
    for g in range(len(status)):
        together = status[g, COUNT] > 0.0 and status[g, RADIUS] <= LOOSE
        status[g, AVOIDED] = 1.0 if together and not filing[g] else 0.0


@njit(cache=True)
def accelerate(  # type: ignore[no-untyped-def]
    state, place, target, pace, noise, gait, calm, wanted, tag,
    route, kind, length, current, speed, heading, finish, filing, held_up, arrived, status, push, by_x, flock, boids,
    head, gap, stairs, walls, pillars, dt, out,
):  # fmt: skip
    """Overwrites out (N, 2) with the accelerations of all people, m/s², and advances ways and strides by dt (s).

    state (N, 4): columns as in `forces`. The others are the fields of PeopleArrays, GroupArrays and Obstacles. Returns
    False, with nothing written, if a state is not below 1e9.
    """
    for i in range(len(state)):
        if not abs(state[i, X]) + abs(state[i, Y]) + abs(state[i, VX]) + abs(state[i, VY]) < 1e9:
            return False
    for i in range(len(state)):
        calm[i, X], calm[i, Y] = state[i, X], state[i, Y]
        calm[i, VX], calm[i, VY] = state[i, VX] - gait[i, SWAY_X], state[i, VY] - gait[i, SWAY_Y]
    _average(calm, noise, tag, status)
    _spread(calm, place, tag, route, kind, current, heading, status)
    _lead_groups(
        route, kind, length, current, speed, heading, finish, filing, held_up, arrived, status, boids, head, gap, dt
    )
    middle = np.empty((len(state) if flock.any() else 0, 4))
    if len(middle):
        _flock(calm, tag, flock, middle)
    _seek(
        calm, place, target, pace, noise, wanted, tag,
        route, kind, length, current, speed, heading, status, flock, boids, middle, stairs, out,
    )  # fmt: skip
    _mark_avoided(filing, status)
    _sway(wanted, gait, dt, out)
    avoid(calm, wanted, tag, status, push, by_x, boids, head, walls, pillars, out)
    return True
