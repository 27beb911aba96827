"""Kernels of tracking.papers.relational.particle_set: groups, resampled relations, means over the particles.

Arrays are over P particles and K people, as in `transition_kernels`.
"""

from __future__ import annotations

import numpy as np

from sim.compiler import njit
from sim.types import Array, Bools, Ints


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
def redraw_relations(related: Bools, people: Ints, chosen: Ints) -> None:
    """Replace the relations of resampled people, one after the other; related (P, K, K) is changed.

    What the partners' weights say of a relation is lost where the person alone is resampled: the particles of both are
    independent then.

    people (R,): who; chosen (P, R): the particle from which each takes the own relations.
    """
    particles, n, _ = related.shape
    some = np.empty(n, np.bool_)
    for column in range(len(people)):
        k = people[column]
        old = related[:, k].copy()
        some[:] = False
        for p in range(particles):
            some |= old[p]
        for j in np.flatnonzero(some):
            for p in range(particles):
                related[p, k, j] = related[p, j, k] = old[chosen[p, column], j]


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


@njit(cache=True)
def pairs_together(related: Bools, exist: Array, weights: Array, one_weight: bool) -> Array:
    """Return the probability (K, K) that i and j walk together, given that both exist; 1 on the diagonal.

    related (P, K, K): relations; exist (P, K): probabilities of existence; weights (P, K): of the particles;
    one_weight: whether all columns are one weight, else a pair has the product. 0 for a pair that does not exist.
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
                if not one_weight:
                    w *= weights[p, j]
                both += w
                if related[p, i, j]:
                    same += w
            if both > 0:
                out[i, j] = out[j, i] = same / both
    return out
