"""Kernels of tracking.papers.relational.sensor: which detections are near whom, and the sums of each particle."""

from __future__ import annotations

import math

import numpy as np

from sim.compiler import njit
from sim.types import Array, Bools, Ints
from tracking.papers.relational.association_sums_kernels import sparse_sum


@njit(cache=True)
def particle_sums(
    pos: Array, exist: Array, detect: Array, points: Array, sd: float, clutter: float, reach: float,
    near: Bools, cluster: Ints, log_sums: Array, marginals: Array,
) -> None:  # fmt: skip
    """Write log-likelihoods (P, K) of each particle's clusters and its marginals (P, K, M): the probability of each
    pair.

    pos (P, K, 2), m: places of K people in each of P particles; exist (P, K): probability that each exists; detect
    (K,): probability that each is measured if existing; points (M, 2), m; sd: standard deviation of a point, m;
    clutter: false alarms per m^2. reach: pairs with a squared distance, in sd^2, above it are impossible; inf: none.
    near (K, M): False for pairs that are impossible in all particles. cluster (K,): the least slot of each slot's
    cluster, whose column has the cluster's log-likelihood.

    W = exist detect N(z; x, sd^2) / clutter, miss = 1 - exist detect, spare = 1. Without clutter (the paper's sensor)
    W = N(z; x, sd^2) and mappings are complete: the smaller side is mapped wholly. Underflow makes W exactly 0.
    """
    particles, n = exist.shape
    m = len(points)
    W, miss, spare = np.empty((n, m)), np.empty(n), np.ones(m)
    height = 1.0 / (2.0 * math.pi * sd * sd)
    for p in range(particles):
        for k in range(n):
            seen = exist[p, k] * detect[k]
            miss[k] = 1.0 - seen
            for j in range(m):
                if not near[k, j]:
                    W[k, j] = 0.0
                    continue
                dx, dy = points[j, 0] - pos[p, k, 0], points[j, 1] - pos[p, k, 1]
                d2 = (dx * dx + dy * dy) / (sd * sd)
                g = height * math.exp(-0.5 * d2) if d2 <= reach else 0.0
                W[k, j] = g if clutter == 0.0 else seen * g / clutter
        if clutter == 0.0:
            miss[:] = 0.0 if n <= m else 1.0
            spare[:] = 0.0 if n > m else 1.0
        sparse_sum(W, miss, spare, cluster, log_sums[p], marginals[p])


@njit(cache=True)
def near_detections(pos: Array, points: Array, most: float) -> Bools:
    """Return which people and detections (K, M) are within reach of each other, in some particle.

    pos (P, K, 2), m; points (M, 2), m; most: reach, squared distance in m^2.
    """
    particles, n, _ = pos.shape
    near = np.zeros((n, len(points)), np.bool_)
    for k in range(n):
        left, right, low, high = np.inf, -np.inf, np.inf, -np.inf
        for p in range(particles):
            left, right = min(left, pos[p, k, 0]), max(right, pos[p, k, 0])
            low, high = min(low, pos[p, k, 1]), max(high, pos[p, k, 1])
        for j in range(len(points)):
            x, y = points[j, 0], points[j, 1]
            dx, dy = max(left - x, x - right, 0.0), max(low - y, y - high, 0.0)
            if dx * dx + dy * dy > most:
                continue
            for p in range(particles):
                dx, dy = x - pos[p, k, 0], y - pos[p, k, 1]
                if dx * dx + dy * dy <= most:
                    near[k, j] = True
                    break
    return near
