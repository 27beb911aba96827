"""Kernels of choices by the cluster validity: parts of a group that splits, the group of a new person (ours)."""

from __future__ import annotations

import math

import numpy as np

from sim.compiler import njit
from sim.types import Array, Ints
from tracking.papers.joint.partition_kernels import clusters, same_row, validity_of

MOST_LISTED = 6
"""Largest group of which all divisions into two parts are tried."""


@njit(cache=True)
def divide(points: Array, cluster: Ints, g: int, uniform: float, sharpness: float, scales: Array, label: Ints) -> None:
    """Divide cluster g into two parts, drawn with probabilities exp(-sharpness d_cl) of the two parts (ours).

    points (K, D): m; cluster (K,); uniform in [0, 1); label (K,): changed in place. Up to MOST_LISTED people all
    divisions are candidates; of larger groups those that leave one person out, and cuts across the first principal axis
    of the points.
    """
    members = np.flatnonzero(cluster == g)
    n = len(members)
    own = points[members]
    sides = candidates(own)
    centre, scatter = np.empty((2, points.shape[1])), np.empty(2)
    energy = np.empty(len(sides))
    for c in range(len(sides)):
        energy[c] = sharpness * validity_of(own, sides[c], 2, scales, centre, scatter)
    least = energy.min()
    total = np.cumsum(np.exp(least - energy))
    chosen = sides[min(np.searchsorted(total, uniform * total[-1], side="right"), len(sides) - 1)]
    for side in range(2):
        first, size = -1, 0
        for k in range(n):
            if chosen[k] == side:
                size += 1
                if first < 0:
                    first = members[k]
        for k in range(n):
            if chosen[k] == side:
                label[members[k]] = 1 + first if size > 1 else 0


@njit(cache=True)
def candidates(points: Array) -> Ints:
    """Return the candidate divisions of n points (n, D), (C, n): the side of each point, 0 or 1; both sides occur."""
    n, dims = points.shape
    if n <= MOST_LISTED:
        count = 2 ** (n - 1) - 1
        sides = np.zeros((count, n), np.int64)
        for c in range(count):
            for k in range(1, n):
                sides[c, k] = ((c + 1) >> (k - 1)) & 1
        return sides
    sides = np.zeros((2 * n - 1, n), np.int64)
    for k in range(n):
        sides[k, k] = 1
    mean = np.zeros(dims)
    for k in range(n):
        mean += points[k] / n
    axis = points[0] - mean + 1e-9
    for _ in range(30):
        new = np.zeros(dims)
        for k in range(n):
            new += (points[k] - mean) * np.dot(points[k] - mean, axis)
        axis = new / max(math.sqrt(np.dot(new, new)), 1e-12)
    along = np.empty(n)
    for k in range(n):
        along[k] = np.dot(points[k] - mean, axis)
    ranked = np.argsort(along)
    for cut in range(1, n):
        for k in range(cut):
            sides[n + cut - 1, ranked[k]] = 1
    return sides


@njit(cache=True)
def place_newcomer(points: Array, label: Ints, person: int, uniforms: Array, sharpness: float, scales: Array) -> None:
    """Draw whether a person joins the nearest cluster, in all partitions in which the person is alone (ours).

    points (N_x, K, D): m; label (N_x, N_z, K): changed in place; uniforms (N_x, N_z). The probabilities of apart and
    together are proportional to exp(-sharpness d_cl) of the two clusters apart and as one.
    """
    particles, partitions, n = label.shape
    cluster, head = np.empty(n, np.int64), np.empty(n, np.int64)
    before, join, other = np.empty(n, np.int64), 0.0, -1
    for i in range(particles):
        for j in range(partitions):
            if j == 0 or not same_row(label[i, j], before):
                before[:] = label[i, j]
                count = clusters(before, cluster, head)
                other = _nearest_to(points[i], cluster, count, person) if before[person] == 0 else -1
                if other >= 0:
                    join = _join_probability(points[i], cluster, other, person, sharpness, scales)
            if other < 0 or uniforms[i, j] >= join:
                continue
            name = 1 + min(person, head[other])
            for k in range(n):
                if cluster[k] == other or k == person:
                    label[i, j, k] = name


@njit(cache=True)
def _nearest_to(points: Array, cluster: Ints, count: int, person: int) -> int:
    """Returns the cluster, not the own one, whose mean place is nearest to the person; -1 without another."""
    n = len(cluster)
    x, y, size = np.zeros(count), np.zeros(count), np.zeros(count)
    for k in range(n):
        x[cluster[k]] += points[k, 0]
        y[cluster[k]] += points[k, 1]
        size[cluster[k]] += 1
    best, least = -1, np.inf
    for g in range(count):
        far = (x[g] / size[g] - points[person, 0]) ** 2 + (y[g] / size[g] - points[person, 1]) ** 2
        if g != cluster[person] and far < least:
            best, least = g, far
    return best


@njit(cache=True)
def _join_probability(points: Array, cluster: Ints, other: int, person: int, sharpness: float, scales: Array) -> float:
    """Returns the probability that a person alone joins the cluster `other`."""
    members = np.flatnonzero(cluster == other)
    own = np.empty((len(members) + 1, points.shape[1]))
    own[0], own[1:] = points[person], points[members]
    centre, scatter = np.empty((2, points.shape[1])), np.empty(2)
    sides = np.ones(len(own), np.int64)
    sides[0] = 0
    apart = validity_of(own, sides, 2, scales, centre, scatter)
    together = validity_of(own, np.zeros(len(own), np.int64), 1, scales, centre, scatter)
    return 1 / (1 + math.exp(min(sharpness * (together - apart), 700.0)))
