"""Kernels of tracking.papers.relational.sensor: which detections are near whom, and the sums of each particle."""

from __future__ import annotations

import math

import numpy as np

from sim.compiler import njit
from sim.types import Array, Bools, Ints
from tracking.papers.relational.association_sums_kernels import sparse_sum


@njit(cache=True)
def densities(
    pos: Array, points: Array, pairs: Ints, sd: float, wide: float, share: Array, eye: Array, reach: float
) -> Array:
    """Return the density of each pair's point in each particle, (P, N), 1/m^2: g = (1 - share) N(z; x, sd^2) + share
    D(z; x).

    pos (P, K, 2), m: places of K people in each of P particles; points (M, 2), m; pairs (N, 2): person and point; sd:
    standard deviation of a point per axis, m; wide: of a displaced point; share (K,): probability that the person's
    point is displaced. reach: g is 0 at squared distances, in m^2, above it; inf: none. Underflow makes g exactly 0.

    eye (2,): place of the camera, m, nan if unknown. A hidden foot displaces the point away from the camera: D is
    half-normal with `wide` along the line of sight and normal with `sd` across it. Without a camera D is N(z; x,
    wide^2).
    """
    known = not math.isnan(eye[0])
    height, flat = 1.0 / (2.0 * math.pi * sd**2), 1.0 / (2.0 * math.pi * wide**2)
    behind = 2.0 / (2.0 * math.pi * sd * wide)
    out = np.zeros((len(pos), len(pairs)))
    for n in range(len(pairs)):
        k, j = pairs[n]
        away_x, away_y = points[j, 0] - eye[0], points[j, 1] - eye[1]
        length = max(math.sqrt(away_x * away_x + away_y * away_y), 1e-9) if known else 1.0
        away_x, away_y = away_x / length, away_y / length
        for p in range(len(pos)):
            dx, dy = points[j, 0] - pos[p, k, 0], points[j, 1] - pos[p, k, 1]
            d2 = dx * dx + dy * dy
            if d2 > reach:
                continue
            out[p, n] = (1.0 - share[k]) * height * math.exp(-0.5 * d2 / sd**2)
            if share[k] <= 0.0:
                continue
            if not known:
                out[p, n] += share[k] * flat * math.exp(-0.5 * d2 / wide**2)
                continue
            along, across = dx * away_x + dy * away_y, dx * away_y - dy * away_x
            if along > 0.0:
                out[p, n] += share[k] * behind * math.exp(-0.5 * (across**2 / sd**2 + along**2 / wide**2))
    return out


@njit(cache=True)
def free_detections(W: Array, miss: Array, cluster: Ints) -> Array:
    """Return the probability that no person of another cluster has a detection, (K, M), for the cluster of each person.

    W (K, M): mean weight of each person and detection; miss (K,): mean weight of the person without detection; both
    over the particles; spare weights are 1. cluster (K,): the least slot of each slot's cluster. For a cluster it
    is that of the sum over all mappings of the other people.
    """
    n, m = W.shape
    free = np.ones((n, m))
    first, logs, found = np.zeros(n, np.int64), np.empty(n), np.empty((n, m))
    for head in range(n):
        if cluster[head] != head:
            continue
        contested = False
        for k in range(n):
            for j in range(m):
                if cluster[k] == head and W[k, j] > 0:
                    for other in range(n):
                        contested |= cluster[other] != head and W[other, j] > 0
        if not contested:
            continue
        others = W.copy()
        for k in range(n):
            if cluster[k] == head:
                others[k] = 0.0
        sparse_sum(others, miss, np.ones(m), first, logs, found)
        for j in range(m):
            left = max(1.0 - found[:, j].sum(), 0.0)
            for k in range(n):
                if cluster[k] == head:
                    free[k, j] = left
    return free


@njit(cache=True)
def particle_sums(
    density: Array, pairs: Ints, exist: Array, detect: Array, clutter: float, cluster: Ints, free: Array,
    log_sums: Array, marginals: Array,
) -> None:  # fmt: skip
    """Write log-likelihoods (P, K) of each particle's clusters and its marginals (P, K, M): the probability of each
    pair.

    density (P, N): of the N pairs (N, 2) of a person and a point, all others are impossible, as `densities` gives it;
    exist (P, K): probability that each person exists; detect (K,): probability that each is measured if existing;
    clutter: false alarms per m^2. cluster (K,): the least slot of each slot's cluster, whose column has the cluster's
    log-likelihood. free (K, M): probability that no person of another cluster has the detection.

    W = exist detect g free / clutter, miss = 1 - exist detect, spare = 1. A person who shares no detection with others
    of the cluster has the sum miss + sum of W. Without clutter (the paper's sensor) W = g and mappings are complete:
    the smaller side is mapped wholly.
    """
    particles, n, m = marginals.shape
    marginals[:], log_sums[:] = 0.0, 0.0
    alone = _alone(pairs, cluster, n, m) if clutter > 0.0 else np.zeros(n, np.bool_)
    place, total = np.full(n, -1), np.empty(n)
    W, miss, spare = np.zeros((n, m)), np.empty(n), np.ones(m)
    logs, found, first = np.empty(n), np.empty((n, m)), np.zeros(n, np.int64)
    order, cut, count = np.empty(n, np.int64), [0], 0
    for head in range(n):
        for k in range(n):
            if cluster[k] == head and not alone[k]:
                order[count], place[k] = k, count
                count += 1
        if count > cut[-1]:
            cut.append(count)
    for p in range(particles):
        for k in range(n):
            total[k] = 1.0 - exist[p, k] * detect[k]
        for a in range(count):
            miss[a] = total[order[a]]
        for c in range(len(pairs)):
            k, j = pairs[c]
            weight = density[p, c] if clutter == 0.0 else exist[p, k] * detect[k] * density[p, c] * free[k, j] / clutter
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
        for part in range(len(cut) - 1):
            low, high = cut[part], cut[part + 1]
            sparse_sum(W[low:high], miss[low:high], spare, first[: high - low], logs[low:high], found[low:high])
            log_sums[p, cluster[order[low]]] += logs[low:high].sum()
            for a in range(low, high):
                marginals[p, order[a]] = found[a]


@njit(cache=True)
def _alone(pairs: Ints, cluster: Ints, n: int, m: int) -> Bools:
    """Returns which of n people (n,) have no pair whose detection, of m, has a pair with another person of the
    cluster."""
    count, alone = np.zeros((n, m), np.int64), np.ones(n, np.bool_)
    for c in range(len(pairs)):
        count[cluster[pairs[c, 0]], pairs[c, 1]] += 1
    for c in range(len(pairs)):
        if count[cluster[pairs[c, 0]], pairs[c, 1]] > 1:
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


@njit(cache=True)
def partner_factors(related: Bools, weights: Array, missed: Bools, cluster: Ints, log_sums: Array) -> None:
    """Add to the log-likelihoods of each missed person those of the partners: what is seen of them tells where the
    person is.

    related (P, K, K): who walks together, before the frame's relations; weights (P, K): of the particles before the
    frame; missed (K,); cluster (K,); log_sums (P, K): log-likelihoods, in the column of each cluster's least slot;
    changed.

    The factor of a partner is l(p) / mean l in the particles in which the two walk together, 1 in all others. So the
    person has the posterior of the joint filter if the partner's is independent of it.
    """
    particles, n, _ = related.shape
    own = log_sums.copy()
    for v in range(n):
        top, mean = -np.inf, 0.0
        for p in range(particles):
            top = max(top, own[p, cluster[v]])
        if top == -np.inf:
            continue
        for p in range(particles):
            mean += weights[p, v] * math.exp(own[p, cluster[v]] - top)
        level = top + math.log(max(mean, 1e-300))
        for h in range(n):
            if missed[h] and cluster[h] != cluster[v]:
                for p in range(particles):
                    if related[p, h, v]:
                        log_sums[p, cluster[h]] += own[p, cluster[v]] - level
