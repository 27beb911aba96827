"""Kernels of tracking.papers.relational.sensor: which detections are near whom, and the sums of each particle."""

from __future__ import annotations

import math

import numpy as np

from sim.compiler import njit
from sim.types import Array, Bools, Ints
from tracking.papers.relational.association_sums_kernels import sparse_sum

SD, WIDE, SHARE = range(3)
"""Slots of `noise` (3,): standard deviation of a point per axis, m; the same of a displaced point, m; share of
displaced points."""


@njit(cache=True)
def densities(pos: Array, points: Array, pairs: Ints, noise: Array, reach: float) -> Array:
    """Return the density of each pair's point in each particle, (P, N), 1/m^2: g = (1 - SHARE) N(z; x, SD^2) + SHARE
    N(z; x, WIDE^2).

    pos (P, K, 2), m: places of K people in each of P particles; points (M, 2), m; pairs (N, 2): person and point; noise
    (3,): SD, WIDE, SHARE. reach: g is 0 at squared distances, in m^2, above it; inf: none. Underflow makes g exactly 0.
    """
    narrow, wide, share = noise[SD] ** 2, noise[WIDE] ** 2, noise[SHARE]
    height, flat = (1.0 - share) / (2.0 * math.pi * narrow), share / (2.0 * math.pi * wide)
    out = np.zeros((len(pos), len(pairs)))
    for p in range(len(pos)):
        for n in range(len(pairs)):
            k, j = pairs[n]
            dx, dy = points[j, 0] - pos[p, k, 0], points[j, 1] - pos[p, k, 1]
            d2 = dx * dx + dy * dy
            if d2 > reach:
                continue
            out[p, n] = height * math.exp(-0.5 * d2 / narrow)
            if share > 0.0:
                out[p, n] += flat * math.exp(-0.5 * d2 / wide)
    return out


@njit(cache=True)
def particle_sums(
    density: Array, pairs: Ints, exist: Array, detect: Array, clutter: float, cluster: Ints,
    log_sums: Array, marginals: Array,
) -> None:  # fmt: skip
    """Write log-likelihoods (P, K) of each particle's clusters and its marginals (P, K, M): the probability of each
    pair.

    density (P, N): of the N pairs (N, 2) of a person and a point, all others are impossible, as `densities` gives it;
    exist (P, K): probability that each person exists; detect (K,): probability that each is measured if existing;
    clutter: false alarms per m^2. cluster (K,): the least slot of each slot's cluster, whose column has the cluster's
    log-likelihood.

    W = exist detect g / clutter, miss = 1 - exist detect, spare = 1. A person who shares no detection with others in
    any particle has the sum miss + sum of W. Without clutter (the paper's sensor) W = g and mappings are complete: the
    smaller side is mapped wholly.
    """
    particles, n, m = marginals.shape
    marginals[:], log_sums[:] = 0.0, 0.0
    alone = _alone(pairs, n, m) if clutter > 0.0 else np.zeros(n, np.bool_)
    rows = np.flatnonzero(~alone)
    place = np.full(n, -1)
    place[rows] = np.arange(len(rows))
    heads = np.arange(len(rows))
    for a in range(len(rows)):
        if place[cluster[rows[a]]] >= 0:
            heads[a] = place[cluster[rows[a]]]
    W, miss, spare = np.zeros((len(rows), m)), np.empty(len(rows)), np.ones(m)
    logs, found, total = np.empty(len(rows)), np.empty((len(rows), m)), np.empty(n)
    for p in range(particles):
        for k in range(n):
            total[k] = 1.0 - exist[p, k] * detect[k]
        for a in range(len(rows)):
            miss[a] = total[rows[a]]
        for c in range(len(pairs)):
            k, j = pairs[c]
            weight = density[p, c] if clutter == 0.0 else exist[p, k] * detect[k] * density[p, c] / clutter
            if alone[k]:
                total[k] += weight
                marginals[p, k, j] = weight
            else:
                W[place[k], j] = weight
        for k in range(n):
            if alone[k] and total[k] > 0.0:
                marginals[p, k] /= total[k]
                log_sums[p, cluster[k]] += math.log(total[k])
            elif alone[k]:
                log_sums[p, cluster[k]] = -math.inf
        if clutter == 0.0:
            miss[:] = 0.0 if n <= m else 1.0
            spare[:] = 0.0 if n > m else 1.0
        if len(rows) > 0:
            sparse_sum(W, miss, spare, heads, logs, found)
            for a in range(len(rows)):
                log_sums[p, cluster[rows[a]]] += logs[a]
                marginals[p, rows[a]] = found[a]


@njit(cache=True)
def _alone(pairs: Ints, n: int, m: int) -> Bools:
    """Returns which of n people (n,) have no pair whose detection, of m, has a pair with another person."""
    count, alone = np.zeros(m, np.int64), np.ones(n, np.bool_)
    for c in range(len(pairs)):
        count[pairs[c, 1]] += 1
    for c in range(len(pairs)):
        if count[pairs[c, 1]] > 1:
            alone[pairs[c, 0]] = False
    return alone


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
