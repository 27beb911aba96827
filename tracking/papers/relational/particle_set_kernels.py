"""Kernels of tracking.papers.relational.particle_set: groups, means over the particles.

Arrays are over P particles and K people, as in `transition_kernels`.
"""

from __future__ import annotations

import math

import numpy as np

from sim.compiler import njit
from sim.types import Array, Bools, Ints


@njit(cache=True)
def column_sums(a: Array, b: Array) -> Array:
    """Returns the sums over particles of the products of a and b (P, K), (K,).

    Each column is summed in the order of the particles. In numpy the order depends on the number of columns, so that
    the last bits of a person's sum would depend on who else is there.
    """
    out = np.zeros(a.shape[1])
    for p in range(a.shape[0]):
        for k in range(a.shape[1]):
            out[k] += a[p, k] * b[p, k]
    return out


@njit(cache=True)
def weigh(weights: Array, logs: Array) -> None:
    """Multiply weights (P, K) by exp(logs), and divide them by their sums over the particles; logs (P, K) or (P, 1)."""
    particles, n = weights.shape
    own = 1 if logs.shape[1] == n else 0
    for k in range(n):
        top, total = -np.inf, 0.0
        for p in range(particles):
            top = max(top, logs[p, own * k])
        for p in range(particles):
            weights[p, k] *= math.exp(logs[p, own * k] - top)
            total += weights[p, k]
        for p in range(particles):
            weights[p, k] /= total


@njit(cache=True)
def group_labels(pairs: Ints, related: Bools, label: Ints) -> None:
    """Writes the group of each person in each particle, (P, K): the least number of a person in it.

    pairs (N, 2), related (N, P): which pairs are related in each particle. Groups are connected components; a person
    alone has the own number.
    """
    particles, n = label.shape
    for p in range(particles):
        for i in range(n):
            label[p, i] = i
        for k in range(len(pairs)):
            if related[k, p]:
                a, b = _root(label, p, pairs[k, 0]), _root(label, p, pairs[k, 1])
                label[p, max(a, b)] = min(a, b)
        for i in range(n):
            label[p, i] = label[p, label[p, i]]  # that of someone before, which is final


@njit(cache=True)
def _root(label, p, i):  # type: ignore[no-untyped-def]
    while label[p, i] != i:
        label[p, i] = label[p, label[p, i]]
        i = label[p, i]
    return i


@njit(cache=True)
def moments(pos: Array, vel: Array, exist: Array, weights: Array, mean: Array, cov: Array, total: Array) -> None:
    """Writes mean (K, 4) and covariance (K, 4, 4) of each person's x, y, vx, vy, and the probability of existence (K,).

    Particles count by weight times existence, or by weight alone for a person who exists in none. pos, vel (P, K, 2), m
    and m/s; exist (P, K); weights (P, K), sum 1 for each person.
    """
    particles, n = exist.shape
    share, away = np.empty((particles, n)), np.empty(4)
    for p in range(particles):  # in the order in which arrays lie in memory
        for k in range(n):
            total[k] += weights[p, k] * exist[p, k]
    for p in range(particles):
        for k in range(n):
            w = weights[p, k] * exist[p, k] / total[k] if total[k] > 0.0 else weights[p, k]
            share[p, k] = w
            for d in range(2):
                mean[k, d] += w * pos[p, k, d]
                mean[k, d + 2] += w * vel[p, k, d]
    for p in range(particles):
        for k in range(n):
            for d in range(2):
                away[d], away[d + 2] = pos[p, k, d] - mean[k, d], vel[p, k, d] - mean[k, d + 2]
            for a in range(4):
                for b in range(a + 1):
                    cov[k, a, b] += share[p, k] * away[a] * away[b]
    for k in range(n):
        for a in range(4):
            for b in range(a):
                cov[k, b, a] = cov[k, a, b]


@njit(cache=True)
def reached(pos: Array, points: Array, most: float) -> Ints:
    """Returns the pairs (N, 2) of a person and a detection within reach of the box round the person's particles.

    pos (P, K, 2), m; points (M, 2), m; most: reach, squared distance in m^2.
    """
    particles, people, _ = pos.shape
    low, high = np.empty((people, 2)), np.empty((people, 2))
    for p in range(particles):
        for k in range(people):
            for axis in range(2):
                x = pos[p, k, axis]
                low[k, axis] = x if p == 0 else min(low[k, axis], x)
                high[k, axis] = x if p == 0 else max(high[k, axis], x)
    pairs, count = np.empty((people * len(points), 2), np.int64), 0
    for k in range(people):
        for j in range(len(points)):
            x = max(low[k, 0] - points[j, 0], points[j, 0] - high[k, 0], 0.0)
            y = max(low[k, 1] - points[j, 1], points[j, 1] - high[k, 1], 0.0)
            if x * x + y * y <= most:
                pairs[count, 0], pairs[count, 1] = k, j
                count += 1
    return pairs[:count].copy()
