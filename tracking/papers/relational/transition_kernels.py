"""Kernels of `relational`: motion given relations (sec. 3.2), and relations given motion.

The columns of the speed table are named here.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from sim.compiler import njit
from sim.types import Array, Bools, Ints

# Columns of a speed table (5, 3): upper end of a row's speeds, mean loss of speed in a step and standard deviation of
# the velocity after it, per axis; all in m/s.
SPEED, DRIFT, SPREAD = range(3)
# Slots of `coupling` (2,): share of the difference to the mean velocity of a group that a member loses in a step, and
# share of the variance of a member's noise that the group has in common; the paper: 1 and 0.
FOLLOW, COMMON = range(2)
# Slots of `rules` (4,): weight that the old relation loses in a step, 1 - exp(-rate dt); log odds of walking together
# at the same place, their loss per m of distance and per m/s of velocity difference.
RATE, BIAS, DISTANCE, VELOCITY = range(4)
NEWCOMER_SHARE = 0.5  # Probability that a new person near a group belongs to it (sec. 3.2).


def belonging(distance: Any, difference: Any, rules: Array) -> Any:
    """Returns the probability that two people walk together by their states (ours); 1 if BIAS is inf.

    distance: between them, m; difference: of their velocities, m/s: numbers or arrays; rules (4,).
    """
    return 1.0 / (1.0 + np.exp(rules[DISTANCE] * distance + rules[VELOCITY] * difference - rules[BIAS]))


_belonging = njit(cache=True)(belonging)


@njit(cache=True)
def move(
    pos: Array, vel: Array, exist: Array, pairs: Ints, related: Bools, noise: Array, shared: Array, table: Array,
    coupling: Array, alike: Array, spread: Array, dt: float,
) -> None:  # fmt: skip
    """Move everybody by a step of dt s: p(s^a_t | s^a_t-1, s^r_t-1), eq. 8 and sec. 3.2; pos and vel are changed.

    pos (P, K, 2), m; vel (P, K, 2), m/s; exist (P, K): probability of existence; pairs (N, 2), related (N,
    P): old relations; noise, shared (P, K, 2): standard normals; table (5, 3): the speed table of the step; coupling
    (2,); alike (4,): rules by which a partner counts; spread (N, 2): of `pair_spread`.

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
            i, j = pairs[k, 0], pairs[k, 1]
            if related[k, p]:
                dx, dy = pos[p, i, 0] - pos[p, j, 0], pos[p, i, 1] - pos[p, j, 1]
                du, dv = vel[p, i, 0] - vel[p, j, 0], vel[p, i, 1] - vel[p, j, 1]
                distance = math.sqrt(max(dx * dx + dy * dy - spread[k, 0], 0.0))
                w = _belonging(distance, math.sqrt(max(du * du + dv * dv - spread[k, 1], 0.0)), alike)
                for turn in range(2):
                    a, b = (j, i) if turn else (i, j)
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
def pair_spread(pos: Array, vel: Array, pairs: Ints) -> Array:
    """Returns what the filter's uncertainty adds on average to the squared distance, m^2, and to the squared velocity
    difference, m^2/s^2, of pairs in a particle, (N, 2): twice their variances over the particles, as a particle
    deviates from the mean, and the mean from the truth (ours).

    pos (P, K, 2), m; vel (P, K, 2), m/s; pairs i < j (N, 2).
    """
    particles, out = len(pos), np.zeros((len(pairs), 2))
    for k in range(len(pairs)):
        i, j = pairs[k, 0], pairs[k, 1]
        first, second = np.zeros(4), np.zeros(4)
        for p in range(particles):
            for d in range(2):
                apart, faster = pos[p, i, d] - pos[p, j, d], vel[p, i, d] - vel[p, j, d]
                first[d], second[d] = first[d] + apart, second[d] + apart * apart
                first[d + 2], second[d + 2] = first[d + 2] + faster, second[d + 2] + faster * faster
        for d in range(4):
            mean = first[d] / particles
            out[k, d // 2] += 2 * max(second[d] / particles - mean * mean, 0.0)
    return out


@njit(cache=True)
def relate(
    pos: Array, vel: Array, pairs: Ints, related: Bools, odds: Array, uniforms: Array, rules: Array
) -> None:  # fmt: skip
    """Draw new relations of pairs: p(s^r_t | s^a_t, s^r_t-1), eq. 7; related (N, P) is changed.

    pos (P, K, 2), m, and vel (P, K, 2), m/s: new places and velocities. pairs (N, 2); odds (N,): log odds of each pair,
    from which the losses of rules (4,) are taken, nan for pairs that stay as they are; uniforms (P, K, 2) in [0, 1).
    The paper leaves this distribution open. Ours: with g the probability that these log odds are, a person reconsiders
    all relations with the rate / 2, and walks together with those whose g is above one uniform number. So each pair is
    a chain of two states that starts and stops with the hazards rate g and rate (1 - g), and a person leaves or joins a
    group at once.
    """
    change = 1.0 - math.sqrt(1.0 - rules[RATE])
    for k in range(len(pairs)):
        if math.isnan(odds[k]):
            continue
        i, j = pairs[k, 0], pairs[k, 1]
        for p in range(len(pos)):
            # where both reconsider, j does so after i
            a = j if uniforms[p, j, 0] < change else i
            if uniforms[p, a, 0] >= change:
                continue
            dx, dy = pos[p, i, 0] - pos[p, j, 0], pos[p, i, 1] - pos[p, j, 1]
            du, dv = vel[p, i, 0] - vel[p, j, 0], vel[p, i, 1] - vel[p, j, 1]
            lost = rules[DISTANCE] * math.sqrt(dx * dx + dy * dy) + rules[VELOCITY] * math.sqrt(du * du + dv * dv)
            related[k, p] = uniforms[p, a, 1] < 1.0 / (1.0 + math.exp(lost - odds[k]))


@njit(cache=True)
def join(
    pos: Array, exist: Array, label: Ints, points: Array, near: Ints, start: Ints, uniforms: Array, rules: Array
) -> Bools:
    """Writes the groups label[:, new] of M new people, the last ones, in each particle, one after the other.

    Returns with which people before them each is in one group in some particle, (M, K).

    Arguments as of `particle_set.join`; near: who is near, all before the new person, ascending; those of person m are
    near[start[m] : start[m + 1]], start (M + 1,).
    """
    n = label.shape[1]
    old, ever = n - len(points), np.zeros((len(points), n), np.bool_)
    belongs, groups = np.zeros(n), np.empty(n, np.int64)  # by groups; the groups of who is near, ascending
    before, last = np.empty(n, np.int64), np.empty(n, np.int64)  # member before in the group; last member of a group
    for p in range(len(pos)):
        for i in range(n):
            if i >= old:
                label[p, i] = i
            g = label[p, i]
            before[i] = last[g] if g < i else -1
            last[g] = i
        for m in range(len(points)):
            new, count, total = old + m, 0, 0.0
            if uniforms[m, p] >= NEWCOMER_SHARE:  # alone, whoever is near
                continue
            for k in range(start[m], start[m + 1]):
                i, g = near[k], label[p, near[k]]
                dx, dy = pos[p, i, 0] - points[m, 0], pos[p, i, 1] - points[m, 1]
                likely = exist[p, i] * _belonging(math.sqrt(dx * dx + dy * dy), 0.0, rules)
                if likely > 0.0 and belongs[g] == 0.0:
                    at = count
                    while at > 0 and groups[at - 1] > g:
                        groups[at] = groups[at - 1]
                        at -= 1
                    groups[at] = g
                    count += 1
                belongs[g] = max(belongs[g], likely)
            for c in range(count):
                total += belongs[groups[c]]
            left, joined = uniforms[m, p] * max(total, 1.0), new
            for c in range(count):
                left -= NEWCOMER_SHARE * belongs[groups[c]]
                belongs[groups[c]] = 0.0
                if left < 0 and joined == new:
                    joined = groups[c]
            if joined < new:
                label[p, new], before[new], last[joined] = joined, last[joined], new
            i = before[new]
            while i >= 0:
                ever[m, i] = True
                i = before[i]
    return ever


@njit(cache=True)
def same_group(label: Ints, pairs: Ints) -> Bools:
    """Returns in which particles each pair i, j (N, 2) is in one group, (N, P); label (P, K)."""
    same = np.empty((len(pairs), len(label)), np.bool_)
    for k in range(len(pairs)):
        for p in range(len(label)):
            same[k, p] = label[p, pairs[k, 0]] == label[p, pairs[k, 1]]
    return same
