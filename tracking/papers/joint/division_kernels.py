"""Kernels of choices by the cluster validity: parts of a group that splits, the group of a new person (ours)."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from sim.compiler import njit
from sim.types import Array, Ints
from tracking.papers.joint.partition_kernels import clusters, same_row, validity_of

MOST_LISTED = 6
"""Largest group of which all divisions into two parts are tried."""
ONE: Any
TWO: Any
ONE, TWO = np.int64(1), np.int64(2)
"""Numbers of clusters, of the type for which validity_of is compiled anyway."""


@njit(cache=True)
def divide(points: Array, cluster: Ints, g: int, uniform: float, sharpness: float, scales: Array, label: Ints) -> None:
    """Divide cluster g into two parts, drawn with probabilities exp(-sharpness d_cl) of the two parts (ours).

    points (K, D): as validity_of; cluster (K,); uniform in [0, 1); label (K,): changed in place. Up to MOST_LISTED
    people all divisions are candidates; of larger groups those that leave one person out, and cuts across the first
    principal axis of the points.
    """
    members = members_of(cluster, g)
    n, dims = len(members), points.shape[1]
    own = np.empty((n, dims))
    for k in range(n):
        own[k] = points[members[k]]
    sides = candidates(own)
    centre, scatter = np.empty((n, dims)), np.empty(n)
    energy, least = np.empty(len(sides)), np.inf
    for c in range(len(sides)):
        energy[c] = sharpness * validity_of(own, sides[c], TWO, scales, centre, scatter)
        least = min(least, energy[c])
    total = 0.0
    for c in range(len(sides)):
        energy[c] = math.exp(least - energy[c])
        total += energy[c]
    row, reached = 0, energy[0]
    while row < len(sides) - 1 and uniform * total >= reached:
        row += 1
        reached += energy[row]
    chosen = sides[row]
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
def members_of(cluster: Ints, g: int) -> Ints:
    """Return the people (n,) of cluster g, ascending; cluster (K,)."""
    n = 0
    out = np.empty(len(cluster), np.int64)
    for k in range(len(cluster)):
        if cluster[k] == g:
            out[n] = k
            n += 1
    return out[:n]


@njit(cache=True)
def rank(values: Array, n: int, out: Ints) -> None:
    """Write the order of the first n values, ascending, equal ones as they come, into out (n or more,)."""
    for k in range(n):
        at = k
        while at > 0 and values[out[at - 1]] > values[k]:
            out[at] = out[at - 1]
            at -= 1
        out[at] = k


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
    away, axis, new, along = np.empty((n, dims)), np.empty(dims), np.empty(dims), np.zeros(n)
    for d in range(dims):
        mean = 0.0
        for k in range(n):
            mean += points[k, d] / n
        for k in range(n):
            away[k, d] = points[k, d] - mean
        axis[d] = away[0, d] + 1e-9
    for _ in range(30):
        length = 0.0
        for d in range(dims):
            new[d] = 0.0
        for k in range(n):
            share = 0.0
            for d in range(dims):
                share += away[k, d] * axis[d]
            for d in range(dims):
                new[d] += away[k, d] * share
        for d in range(dims):
            length += new[d] ** 2
        for d in range(dims):
            axis[d] = new[d] / max(math.sqrt(length), 1e-12)
    for k in range(n):
        for d in range(dims):
            along[k] += away[k, d] * axis[d]
    ranked = np.empty(n, np.int64)
    rank(along, n, ranked)
    for cut in range(1, n):
        for k in range(cut):
            sides[n + cut - 1, ranked[k]] = 1
    return sides


@njit(cache=True)
def place_newcomer(points: Array, label: Ints, person: int, uniforms: Array, sharpness: float, scales: Array) -> None:
    """Draw whether a person joins the nearest cluster, in all partitions in which the person is alone (ours).

    points (N_x, K, D): as validity_of; label (N_x, N_z, K): changed in place; uniforms (N_x, N_z). The probabilities of
    apart and together are proportional to exp(-sharpness d_cl) of the two clusters apart and as one.
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
    members = members_of(cluster, other)
    n, dims = len(members) + 1, points.shape[1]
    own, sides = np.empty((n, dims)), np.zeros((2, n), np.int64)
    own[0] = points[person]
    for k in range(1, n):
        own[k], sides[0, k] = points[members[k - 1]], 1
    centre, scatter = np.empty((n, dims)), np.empty(n)
    apart = validity_of(own, sides[0], TWO, scales, centre, scatter)
    together = validity_of(own, sides[1], ONE, scales, centre, scatter)
    return 1 / (1 + math.exp(min(sharpness * (together - apart), 700.0)))
