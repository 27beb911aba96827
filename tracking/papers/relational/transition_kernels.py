"""Kernels of `relational`: motion given relations (sec. 3.2), and relations given motion.

Arrays are over P particles and K people. related (P, K, K) bool, symmetric, is the relation "walking together" of each
pair; the groups of a particle are the connected components of its related pairs. The columns of the speed table are
named here.
"""

from __future__ import annotations

import math

import numpy as np

from sim.compiler import njit
from sim.types import Array, Bools, Ints

SPEED, DRIFT, SPREAD = range(3)
"""Columns of a speed table (5, 3): upper end of a row's speeds, mean loss of speed in a step and standard deviation of
the velocity after it, per axis; all in m/s."""
FOLLOW, COMMON = range(2)
"""Slots of `coupling` (2,): share of the difference to the mean velocity of a group that a member loses in a step, and
share of the variance of a member's noise that the group has in common; the paper: 1 and 0."""
RATE, BIAS, DISTANCE, VELOCITY = range(4)
"""Slots of `rules` (4,): weight that the old relation loses in a step, 1 - exp(-rate dt); log odds of walking together
at the same place, their loss per m of distance and per m/s of velocity difference."""


NEGLIGIBLE = 1e-4
"""Pairs whose belonging is below this in every particle do not start to walk together."""
FAR = 1e-6
"""A new person does not join people whose belonging is below this in every particle."""


@njit(cache=True)
def _boxes(pos):  # type: ignore[no-untyped-def]
    """Returns the boxes (K, 4) round all particles of each person: least x, greatest x, least y, greatest y."""
    particles, n, _ = pos.shape
    box = np.empty((n, 4))
    for i in range(n):
        box[i, 0], box[i, 1], box[i, 2], box[i, 3] = np.inf, -np.inf, np.inf, -np.inf
        for p in range(particles):
            x, y = pos[p, i, 0], pos[p, i, 1]
            box[i, 0], box[i, 1] = min(box[i, 0], x), max(box[i, 1], x)
            box[i, 2], box[i, 3] = min(box[i, 2], y), max(box[i, 3], y)
    return box


@njit(cache=True)
def move(
    pos: Array, vel: Array, exist: Array, related: Bools, noise: Array, shared: Array, table: Array, coupling: Array,
    alike: Array, pairs: Ints, spread: Array, dt: float,
) -> None:  # fmt: skip
    """Move everybody by a step of dt s: p(s^a_t | s^a_t-1, s^r_t-1), eq. 8 and sec. 3.2; pos and vel are changed.

    pos (P, K, 2), m; vel (P, K, 2), m/s; exist (P, K): probability of existence; related (P, K, K): old relations;
    noise, shared (P, K, 2): standard normals; table (5, 3): the speed table of the step; coupling (2,); alike (4,):
    rules by which a partner counts; pairs (N, 2): people i < j who walk together in some particle; spread (N, 2): of
    `pair_spread`.

    v_i = u - B u / |u| + C e_i, x_i = x_i + v_i dt, with B, C of the table's row for |u| (Table 3). For a person alone
    u = v_i and e_i = noise. A partner j who walks together with i counts with w_j = `belonging` by `alike` at their old
    distance and velocity difference, of whose squares `spread` is taken off, down to 0; the person itself with w_i = 1.
    With m the mean velocity of all these, weighted by w and existence, and c = COMMON max_j w_j: u = v_i + FOLLOW (m -
    v_i), e_i = sqrt(1 - c) noise + sqrt(c) s_i and s_i = sum w shared / sqrt(sum w^2). The weights, FOLLOW and COMMON
    are ours; the paper: BIAS inf, so that w = 1, FOLLOW 1 and COMMON 0, so that u = m and e_i = noise. If a group's
    pairs are not all related, m is not yet the group's mean velocity.
    """
    particles, n, _ = pos.shape
    sums = np.empty((n, 7))
    for p in range(particles):
        for i in range(n):
            sums[i, 0], sums[i, 1], sums[i, 2] = exist[p, i] * vel[p, i, 0], exist[p, i] * vel[p, i, 1], exist[p, i]
            sums[i, 3], sums[i, 4], sums[i, 5], sums[i, 6] = shared[p, i, 0], shared[p, i, 1], 1.0, 0.0
        for k in range(len(pairs)):
            i, j = pairs[k]
            if related[p, i, j]:
                dx, dy = pos[p, i, 0] - pos[p, j, 0], pos[p, i, 1] - pos[p, j, 1]
                du, dv = vel[p, i, 0] - vel[p, j, 0], vel[p, i, 1] - vel[p, j, 1]
                distance = math.sqrt(max(dx * dx + dy * dy - spread[k, 0], 0.0))
                w = belonging(distance, math.sqrt(max(du * du + dv * dv - spread[k, 1], 0.0)), alike)
                for a, b in ((i, j), (j, i)):
                    sums[a, 0] += w * exist[p, b] * vel[p, b, 0]
                    sums[a, 1] += w * exist[p, b] * vel[p, b, 1]
                    sums[a, 2] += w * exist[p, b]
                    sums[a, 3] += w * shared[p, b, 0]
                    sums[a, 4] += w * shared[p, b, 1]
                    sums[a, 5] += w * w
                    sums[a, 6] = max(sums[a, 6], w)
        for i in range(n):
            x, y, ex, ey = vel[p, i, 0], vel[p, i, 1], noise[p, i, 0], noise[p, i, 1]
            weight, square, most = sums[i, 2], sums[i, 5], sums[i, 6]
            if most > 0:
                own, part = math.sqrt(1.0 - most * coupling[COMMON]), math.sqrt(most * coupling[COMMON] / square)
                ex, ey = own * ex + part * sums[i, 3], own * ey + part * sums[i, 4]
            if most > 0 and weight > 0:
                x += coupling[FOLLOW] * (sums[i, 0] / weight - x)
                y += coupling[FOLLOW] * (sums[i, 1] / weight - y)
            speed = math.sqrt(x * x + y * y)
            row = 0
            while speed > table[row, SPEED]:
                row += 1
            keep = 1.0 - table[row, DRIFT] / speed if speed > 0 else 1.0
            vel[p, i, 0] = x * keep + table[row, SPREAD] * ex
            vel[p, i, 1] = y * keep + table[row, SPREAD] * ey
            pos[p, i, 0] += dt * vel[p, i, 0]
            pos[p, i, 1] += dt * vel[p, i, 1]


@njit(cache=True)
def belonging(distance: float, difference: float, rules: Array) -> float:
    """Return the probability that two people walk together by their states (ours); 1 if BIAS is inf.

    distance: between them, m; difference: of their velocities, m/s; rules (4,).
    """
    return 1.0 / (1.0 + math.exp(rules[DISTANCE] * distance + rules[VELOCITY] * difference - rules[BIAS]))


@njit(cache=True)
def pair_spread(pos: Array, vel: Array, pairs: Ints) -> Array:
    """Return what the filter's uncertainty adds on average to the squared distance, m^2, and to the squared velocity
    difference, m^2/s^2, of pairs in a particle, (N, 2): twice their variances over the particles, as a particle
    deviates from the mean, and the mean from the truth (ours).

    pos (P, K, 2), m; vel (P, K, 2), m/s; pairs i < j (N, 2).
    """
    particles, out = len(pos), np.zeros((len(pairs), 2))
    for k in range(len(pairs)):
        i, j = pairs[k]
        first, second = np.zeros(4), np.zeros(4)
        for p in range(particles):
            for d in range(2):
                apart, faster = pos[p, i, d] - pos[p, j, d], vel[p, i, d] - vel[p, j, d]
                first[d], second[d] = first[d] + apart, second[d] + apart * apart
                first[d + 2], second[d + 2] = first[d + 2] + faster, second[d + 2] + faster * faster
        twice = 2 * np.maximum(second / particles - (first / particles) ** 2, 0.0)
        out[k] = twice[0] + twice[1], twice[2] + twice[3]
    return out


@njit(cache=True)
def near_pairs(pos: Array, related: Bools, rules: Array) -> Ints:
    """Return the pairs i < j (N, 2) whose relation may change, in order.

    pos (P, K, 2), m; related (K, K): pairs that walk together in any particle; rules (4,). Pairs that do not, and whose
    boxes round all particles are so far apart that their belonging is below NEGLIGIBLE, are left out (ours).
    """
    n = pos.shape[1]
    box, found, count = _boxes(pos), np.empty((n * (n - 1) // 2, 2), np.int64), 0
    for i in range(n):
        for j in range(i + 1, n):
            dx = max(box[i, 0] - box[j, 1], box[j, 0] - box[i, 1], 0.0)
            dy = max(box[i, 2] - box[j, 3], box[j, 2] - box[i, 3], 0.0)
            if related[i, j] or belonging(math.sqrt(dx * dx + dy * dy), 0.0, rules) >= NEGLIGIBLE:
                found[count, 0], found[count, 1] = i, j
                count += 1
    return found[:count]


@njit(cache=True)
def relate(
    pos: Array, vel: Array, related: Bools, pairs: Ints, odds: Array, uniforms: Array, rules: Array
) -> None:  # fmt: skip
    """Draw new relations of pairs: p(s^r_t | s^a_t, s^r_t-1), eq. 7; related (P, K, K) is changed.

    pos (P, K, 2), m, and vel (P, K, 2), m/s: new places and velocities. pairs (N, 2): people i < j; odds (N,): log odds
    of each pair, from which the losses of rules (4,) are taken; uniforms (P, K, 2) in [0, 1). The paper leaves this
    distribution open. Ours: with g the probability that these log odds are, a person reconsiders all relations with the
    rate / 2, and walks together with those whose g is above one uniform number. So each pair is a chain of two states
    that starts and stops with the hazards rate g and rate (1 - g), and a person leaves or joins a group at once.
    """
    change, n = 1.0 - math.sqrt(1.0 - rules[RATE]), pos.shape[1]
    of, count = np.empty((n, n), np.int64), np.zeros(n, np.int64)
    for k in range(len(pairs)):
        for a in pairs[k]:
            of[a, count[a]] = k
            count[a] += 1
    for p in range(len(pos)):
        for a in range(n):
            if uniforms[p, a, 0] >= change:
                continue
            for k in of[a, : count[a]]:
                i, j = pairs[k]
                dx, dy = pos[p, i, 0] - pos[p, j, 0], pos[p, i, 1] - pos[p, j, 1]
                du, dv = vel[p, i, 0] - vel[p, j, 0], vel[p, i, 1] - vel[p, j, 1]
                lost = rules[DISTANCE] * math.sqrt(dx * dx + dy * dy) + rules[VELOCITY] * math.sqrt(du * du + dv * dv)
                related[p, i, j] = related[p, j, i] = uniforms[p, a, 1] < 1.0 / (1.0 + math.exp(lost - odds[k]))


@njit(cache=True)
def join(
    pos: Array, exist: Array, related: Bools, label: Ints, points: Array, share: float, uniforms: Array, rules: Array
) -> None:
    """Relate M new people, the last slots, to the groups that they join in each particle, one after the other (sec.
    3.2); related (P, K, K) and the groups label (P, K) of the new people are changed.

    pos (P, K, 2), m; exist (P, K): with the new people; points (M, 2), m: where they were detected; uniforms (M, P) in
    [0, 1); rules (4,). With the probability `share` (the paper: 1/2) a person joins a group, people alone being groups
    of one; which one is drawn in proportion to the belonging at the distance of the group's nearest member, at equal
    velocities (ours). Where these sum to less than 1, the person is alone with what is missing. People whose belonging
    is below FAR in all particles are left out, so that the cost of a person is that of the neighbours.
    """
    particles, n, _ = pos.shape
    old = n - len(points)
    box, near = _boxes(pos), np.zeros(n)
    groups, weight = np.empty(n, np.int64), np.empty(n)
    ends = np.empty(len(points), np.int64)
    some, count = [np.int64(0) for _ in range(0)], 0
    for m in range(len(points)):
        for i in range(old + m):
            dx = max(box[i, 0] - points[m, 0], points[m, 0] - box[i, 1], 0.0)
            dy = max(box[i, 2] - points[m, 1], points[m, 1] - box[i, 3], 0.0)
            if belonging(math.sqrt(dx * dx + dy * dy), 0.0, rules) >= FAR:
                some.append(np.int64(i))
                count += 1
        ends[m] = count
    for p in range(particles):
        begin = 0
        for m in range(len(points)):
            new, neighbours, begin = old + m, range(begin, ends[m]), ends[m]
            label[p, new] = new
            if uniforms[m, p] >= share:  # alone, whoever is near
                continue
            for c in neighbours:
                i = int(some[c])
                dx, dy = pos[p, i, 0] - points[m, 0], pos[p, i, 1] - points[m, 1]
                g = exist[p, i] * belonging(math.sqrt(dx * dx + dy * dy), 0.0, rules)
                near[label[p, i]] = max(near[label[p, i]], g)
            total, found = 0.0, 0
            for c in neighbours:
                g = label[p, some[c]]
                if near[g] > 0:
                    total += near[g]
                    at = found
                    while at > 0 and groups[at - 1] > g:
                        groups[at], weight[at] = groups[at - 1], weight[at - 1]
                        at -= 1
                    groups[at], weight[at] = g, near[g]
                    near[g], found = 0.0, found + 1
            left = uniforms[m, p] * max(total, 1.0)
            for k in range(found):
                left -= share * weight[k]
                if left < 0:
                    label[p, new] = groups[k]
                    for i in range(groups[k], new):
                        if label[p, i] == groups[k]:
                            related[p, new, i] = related[p, i, new] = True
                    break
