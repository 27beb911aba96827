"""Kernels of `relational`: motion given relations (sec. 3.2), relations given motion, and what pairs have in common.

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


@njit(cache=True)
def group_labels(related: Bools, label: Ints) -> None:
    """Write the group of each person in each particle, (P, K): the least number of a person in it.

    related (P, K, K): which pairs are related, of each particle. Groups are connected components; a person alone has
    the own number.
    """
    particles, n, _ = related.shape
    waiting = np.empty(n, np.int64)
    for p in range(particles):
        label[p] = -1
        for start in range(n):
            if label[p, start] >= 0:
                continue
            label[p, start] = start
            waiting[0], count, head = start, 1, 0
            while head < count:
                i = waiting[head]
                head += 1
                for j in range(start + 1, n):
                    if label[p, j] < 0 and related[p, i, j]:
                        label[p, j] = start
                        waiting[count] = j
                        count += 1


@njit(cache=True)
def move(
    pos: Array, vel: Array, exist: Array, related: Bools, noise: Array, shared: Array, table: Array, coupling: Array,
    alike: Array, spread: Array, dt: float,
) -> None:  # fmt: skip
    """Move everybody by a step of dt s: p(s^a_t | s^a_t-1, s^r_t-1), eq. 8 and sec. 3.2; pos and vel are changed.

    pos (P, K, 2), m; vel (P, K, 2), m/s; exist (P, K): probability of existence; related (P, K, K): old relations;
    noise, shared (P, K, 2): standard normals; table (5, 3): the speed table of the step; coupling (2,); alike (4,):
    rules by which a partner counts; spread (K, K, 2): of `pair_spread`.

    v_i = u - B u / |u| + C e_i, x_i = x_i + v_i dt, with B, C of the table's row for |u| (Table 3). For a person alone
    u = v_i and e_i = noise. A partner j who walks together with i counts with w_j = `belonging` by `alike` at their old
    distance and velocity difference, of whose squares `spread` is taken off, down to 0; the person itself with w_i = 1.
    With m the mean velocity of all these, weighted by w and existence, and c = COMMON max_j w_j: u = v_i + FOLLOW (m -
    v_i), e_i = sqrt(1 - c) noise + sqrt(c) s_i and s_i = sum w shared / sqrt(sum w^2). The weights, FOLLOW and COMMON
    are ours; the paper: BIAS inf, so that w = 1, FOLLOW 1 and COMMON 0, so that u = m and e_i = noise.
    """
    particles, n, _ = pos.shape
    place, old = np.empty((n, 2)), np.empty((n, 2))
    for p in range(particles):
        place[:], old[:] = pos[p], vel[p]
        for i in range(n):
            x, y, weight = exist[p, i] * old[i, 0], exist[p, i] * old[i, 1], exist[p, i]
            a, b, square, most = shared[p, i, 0], shared[p, i, 1], 1.0, 0.0
            for j in range(n):
                if related[p, i, j]:
                    distance = _least_length(place[i] - place[j], spread[i, j, 0])
                    w = belonging(distance, _least_length(old[i] - old[j], spread[i, j, 1]), alike)
                    x += w * exist[p, j] * old[j, 0]
                    y += w * exist[p, j] * old[j, 1]
                    a, b = a + w * shared[p, j, 0], b + w * shared[p, j, 1]
                    weight += w * exist[p, j]
                    square += w * w
                    most = max(most, w)
            ex, ey = noise[p, i, 0], noise[p, i, 1]
            if most > 0:
                own, part = math.sqrt(1.0 - most * coupling[COMMON]), math.sqrt(most * coupling[COMMON] / square)
                ex, ey = own * ex + part * a, own * ey + part * b
            if most > 0 and weight > 0:
                x = old[i, 0] + coupling[FOLLOW] * (x / weight - old[i, 0])
                y = old[i, 1] + coupling[FOLLOW] * (y / weight - old[i, 1])
            else:
                x, y = old[i, 0], old[i, 1]
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
def _least_length(difference: Array, spread: float) -> float:
    """Returns the length of a difference (2,) without what errors add to its square."""
    return math.sqrt(max(difference[0] ** 2 + difference[1] ** 2 - spread, 0.0))


@njit(cache=True)
def pair_spread(pos: Array, vel: Array, pairs: Ints) -> Array:
    """Return what the filter's uncertainty adds on average to the squared distance, m^2, and to the squared velocity
    difference, m^2/s^2, of pairs in a particle, (K, K, 2): twice their variances over the particles, as a particle
    deviates from the mean, and the mean from the truth; 0 for other pairs (ours).

    pos (P, K, 2), m; vel (P, K, 2), m/s; pairs i < j (N, 2).
    """
    particles, n, _ = pos.shape
    out = np.zeros((n, n, 2))
    for k in range(len(pairs)):
        i, j = pairs[k]
        first, second = np.zeros(4), np.zeros(4)
        for p in range(particles):
            for d in range(2):
                apart, faster = pos[p, i, d] - pos[p, j, d], vel[p, i, d] - vel[p, j, d]
                first[d], second[d] = first[d] + apart, second[d] + apart * apart
                first[d + 2], second[d + 2] = first[d + 2] + faster, second[d + 2] + faster * faster
        twice = 2 * np.maximum(second / particles - (first / particles) ** 2, 0.0)
        out[i, j, 0] = out[j, i, 0] = twice[0] + twice[1]
        out[i, j, 1] = out[j, i, 1] = twice[2] + twice[3]
    return out


@njit(cache=True)
def near_pairs(pos: Array, related: Bools, rules: Array) -> Ints:
    """Return the pairs i < j (N, 2) whose relation may change, in order.

    pos (P, K, 2), m; related (K, K): pairs that walk together in any particle; rules (4,). Pairs that do not, and whose
    boxes round all particles are so far apart that their belonging is below NEGLIGIBLE, are left out (ours).
    """
    particles, n, _ = pos.shape
    box, found, count = np.empty((n, 4)), np.empty((n * (n - 1) // 2, 2), np.int64), 0
    for i in range(n):
        box[i, 0], box[i, 1], box[i, 2], box[i, 3] = np.inf, -np.inf, np.inf, -np.inf
        for p in range(particles):
            x, y = pos[p, i, 0], pos[p, i, 1]
            box[i, 0], box[i, 1] = min(box[i, 0], x), max(box[i, 1], x)
            box[i, 2], box[i, 3] = min(box[i, 2], y), max(box[i, 3], y)
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
    change = 1.0 - math.sqrt(1.0 - rules[RATE])
    for p in range(len(pos)):
        for k in range(len(pairs)):
            i, j = pairs[k]
            for a in (i, j):
                if uniforms[p, a, 0] >= change:
                    continue
                dx, dy = pos[p, i, 0] - pos[p, j, 0], pos[p, i, 1] - pos[p, j, 1]
                du, dv = vel[p, i, 0] - vel[p, j, 0], vel[p, i, 1] - vel[p, j, 1]
                lost = rules[DISTANCE] * math.sqrt(dx * dx + dy * dy) + rules[VELOCITY] * math.sqrt(du * du + dv * dv)
                g = 1.0 / (1.0 + math.exp(lost - odds[k]))
                related[p, i, j] = related[p, j, i] = uniforms[p, a, 1] < g


@njit(cache=True)
def join(pos: Array, exist: Array, label: Ints, place: Array, share: float, uniforms: Array, rules: Array) -> Ints:
    """Return the group (P,) that a new person at `place` (2,), m, joins in each particle, -1 for alone (sec. 3.2).

    pos (P, K, 2), m; exist (P, K); label (P, K): groups; uniforms (P,) in [0, 1); rules (4,). With the probability
    `share` (the paper: 1/2) the person joins a group, people alone being groups of one; which one is drawn in
    proportion to the belonging at the distance of the group's nearest member, at equal velocities (ours). Where these
    sum to less than 1, the person is alone with what is missing.
    """
    particles, n, _ = pos.shape
    chosen, near = np.full(particles, -1), np.empty(n)
    for p in range(particles):
        near[:] = 0.0
        for i in range(n):
            dx, dy = pos[p, i, 0] - place[0], pos[p, i, 1] - place[1]
            g = exist[p, i] * belonging(math.sqrt(dx * dx + dy * dy), 0.0, rules)
            near[label[p, i]] = max(near[label[p, i]], g)
        left = uniforms[p] * max(near.sum(), 1.0)
        for g in range(n):
            left -= share * near[g]
            if left < 0:
                chosen[p] = g
                break
    return chosen


@njit(cache=True)
def pairs_together(related: Bools, exist: Array, weights: Array, cluster: Ints) -> Array:
    """Return the probability (K, K) that i and j walk together, given that both exist; 1 on the diagonal.

    related (P, K, K): relations; exist (P, K): probabilities of existence; weights (P, K): of the particles; cluster
    (K,): people with equal numbers have one weight, others the product of theirs. 0 for a pair that does not exist.
    """
    particles, n = exist.shape
    out = np.eye(n)
    for i in range(n):
        for j in range(i):
            some = False
            for p in range(particles):
                if related[p, i, j]:
                    some = True
                    break
            if not some:
                continue
            both, same = 0.0, 0.0
            for p in range(particles):
                w = weights[p, i] * exist[p, i] * exist[p, j]
                if cluster[i] != cluster[j]:
                    w *= weights[p, j]
                both += w
                if related[p, i, j]:
                    same += w
            if both > 0:
                out[i, j] = out[j, i] = same / both
    return out


@njit(cache=True)
def moments(pos: Array, vel: Array, exist: Array, weights: Array, mean: Array, cov: Array, total: Array) -> None:
    """Write mean (K, 4) and covariance (K, 4, 4) of each person's x, y, vx, vy, and the probability of existence (K,).

    Particles count by weight times existence, or by weight alone for a person who exists in none. pos, vel (P, K, 2), m
    and m/s; exist (P, K); weights (P, K), sum 1 for each person.
    """
    particles, n = exist.shape
    state = np.empty(4)
    for k in range(n):
        for p in range(particles):
            total[k] += weights[p, k] * exist[p, k]
        alone = total[k] <= 0.0
        whole = 1.0 if alone else total[k]
        for p in range(particles):
            w = (weights[p, k] if alone else weights[p, k] * exist[p, k]) / whole
            mean[k, 0] += w * pos[p, k, 0]
            mean[k, 1] += w * pos[p, k, 1]
            mean[k, 2] += w * vel[p, k, 0]
            mean[k, 3] += w * vel[p, k, 1]
        for p in range(particles):
            w = (weights[p, k] if alone else weights[p, k] * exist[p, k]) / whole
            for d in range(2):
                state[d], state[d + 2] = pos[p, k, d] - mean[k, d], vel[p, k, d] - mean[k, d + 2]
            for a in range(4):
                for b in range(a + 1):
                    cov[k, a, b] += w * state[a] * state[b]
        for a in range(4):
            for b in range(a):
                cov[k, b, a] = cov[k, a, b]
