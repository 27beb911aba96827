"""Kernels on partitions Z of K people into groups: labels, cluster validity, uniform partitions, votes.

A label (K,) is 0 for a person alone, else 1 + the least number of a person in the group. Such a label is the same for
equal partitions, so that no result depends on how groups are called. A cluster is a group or a person alone; its head
is its least person. Arrays of labels are (N_x, N_z, K): N_z partitions under each of N_x particles.
"""

from __future__ import annotations

import math

import numpy as np

from sim.compiler import njit
from sim.types import Array, Ints

# Slots of `scales` (2,): prior scatter s_0, virtual distance D_0; m.
SCATTER, APART = range(2)


@njit(cache=True)
def same_row(a: Ints, b: Ints) -> bool:
    """Returns True if two labels (K,) are equal."""
    k = 0
    while k < len(a) and a[k] == b[k]:
        k += 1
    return k == len(a)


@njit(cache=True)
def canonical(label: Ints) -> None:
    """Rename the groups of a label (K,) in place: 0 for a person alone, else 1 + the least person of the group.

    Negative labels count as alone, and so does a label that one person carries.
    """
    n, most = len(label), 0
    for k in range(n):
        most = max(most, label[k])
    head = np.empty(most + 1, np.int64)
    for name in range(most + 1):
        head[name] = -1
    for k in range(n):
        name = label[k]
        label[k] = 0
        if name > 0 and head[name] < 0:
            head[name] = k
        elif name > 0:
            label[k] = label[head[name]] = head[name] + 1


@njit(cache=True)
def relabel(label: Ints) -> None:
    """Bring all labels (N_x, N_z, K) into their canonical form, in place."""
    particles, partitions, _ = label.shape
    for i in range(particles):
        for j in range(partitions):
            canonical(label[i, j])


@njit(cache=True)
def clusters(label: Ints, cluster: Ints, head: Ints) -> int:
    """Writes the cluster of each person, (K,), numbered from 0 by their heads, and the heads; return their number G.

    head (K,): the first G entries are the least person of each cluster.
    """
    count = 0
    for k in range(len(label)):
        if label[k] == 0 or label[k] == k + 1:
            cluster[k] = count
            head[count] = k
            count += 1
        else:
            cluster[k] = cluster[label[k] - 1]
    return count


@njit(cache=True)
def validity_of(points: Array, cluster: Ints, count: int, scales: Array, centre: Array, scatter: Array) -> float:
    """Returns d_cl(Z, X) of one partition: the Davies-Bouldin index with a prior scatter (ours).

    points (K, D): the data that are clustered; the tracker gives the paper's X: states x, y, m, and vx, vy, m/s.
    cluster (K,): number of each person's cluster, below `count`; scales: as SCATTER, APART. centre (K, D), scatter
    (K,): work space. S_g = (sum |x - c_g| + s_0) / (n_g + 1); R_g = max(max_h (S_g + S_h) /
    max(|c_g - c_h|, s_0), S_g / D_0); the index is the mean of R_g over all clusters, people alone included.
    """
    n, dims = points.shape
    s0, apart = scales[SCATTER], scales[APART]
    size = np.zeros(count)
    for g in range(count):
        scatter[g] = s0
        for d in range(dims):
            centre[g, d] = 0.0
    for k in range(n):
        g = cluster[k]
        size[g] += 1
        for d in range(dims):
            centre[g, d] += points[k, d]
    for g in range(count):
        for d in range(dims):
            centre[g, d] /= size[g]
    for k in range(n):
        g, total = cluster[k], 0.0
        if size[g] > 1:
            for d in range(dims):
                total += (points[k, d] - centre[g, d]) ** 2
            scatter[g] += math.sqrt(total)
    for g in range(count):
        scatter[g] /= size[g] + 1
    worst = np.empty(count)
    for g in range(count):
        worst[g] = scatter[g] / apart
    for g in range(count):
        for h in range(g):
            ratio = _ratio(centre, scatter, g, h, s0)
            worst[g] = max(worst[g], ratio)
            worst[h] = max(worst[h], ratio)
    total = 0.0
    for g in range(count):
        total += worst[g]
    return total / count


@njit(cache=True)
def _ratio(centre, scatter, g, h, s0):  # type: ignore[no-untyped-def]
    total = 0.0
    for d in range(centre.shape[1]):
        total += (centre[g, d] - centre[h, d]) ** 2
    return (scatter[g] + scatter[h]) / max(math.sqrt(total), s0)


@njit(cache=True)
def validities(points: Array, label: Ints, scales: Array, out: Array) -> None:
    """Writes d_cl(Z, X) of each partition, (N_x, N_z); points (N_x, K, D); label (N_x, N_z, K).

    points: as validity_of.
    """
    particles, partitions, n = label.shape
    cluster, head = np.empty(n, np.int64), np.empty(n, np.int64)
    centre, scatter = np.empty((n, points.shape[2])), np.empty(n)
    for i in range(particles):
        for j in range(partitions):
            if j > 0 and same_row(label[i, j], label[i, j - 1]):
                out[i, j] = out[i, j - 1]
                continue
            count = clusters(label[i, j], cluster, head)
            out[i, j] = validity_of(points[i], cluster, count, scales, centre, scatter)


@njit(cache=True)
def pair_sums(worth: Array, label: Ints, out: Array) -> None:
    """Writes the sum of worth (K, K) over the pairs in one group of each partition, (N_x, N_z); label (N_x, N_z, K)."""
    particles, partitions, n = label.shape
    following, last = np.empty(n, np.int64), np.empty(n, np.int64)  # next member of a group; last one so far, by head
    for i in range(particles):
        for j in range(partitions):
            if j > 0 and same_row(label[i, j], label[i, j - 1]):
                out[i, j] = out[i, j - 1]
                continue
            total = 0.0
            for k in range(n):
                if label[i, j, k] > 0:
                    head = label[i, j, k] - 1
                    if k > head:
                        following[last[head]] = k
                    last[head] = k
                    other = head
                    while other != k:
                        total += worth[k, other]
                        other = following[other]
            out[i, j] = total


@njit(cache=True)
def uniform_partitions(cumulated: Array, uniforms: Array, label: Ints) -> None:
    """Writes partitions drawn uniformly from all partitions of K people, (N_x, N_z, K) (VAR2).

    Stam's sampler: a number of boxes m is drawn with probabilities proportional to m^K / m!, whose cumulated values
    for m = 1, 2, ... are `cumulated`; then each person is thrown into one of m boxes. uniforms (N_x, N_z, K + 1).
    """
    particles, partitions, n = label.shape
    for i in range(particles):
        for j in range(partitions):
            boxes = 1
            while boxes <= len(cumulated) and cumulated[boxes - 1] <= uniforms[i, j, n] * cumulated[-1]:
                boxes += 1
            for k in range(n):
                label[i, j, k] = 1 + int(uniforms[i, j, k] * boxes)
            canonical(label[i, j])


@njit(cache=True)
def head_votes(label: Ints, weights: Array, out: Array) -> None:
    """Adds the weighted histogram of Fig. 3 summed over i to `out`, (K, K): weight of partitions in which k has the
    cluster of head g. A person alone is the head of the own cluster (ours: nobody votes for group 0)."""
    particles, partitions, n = label.shape
    for i in range(particles):
        for j in range(partitions):
            for k in range(n):
                out[k, k if label[i, j, k] == 0 else label[i, j, k] - 1] += weights[i, j]
