"""Kernels of choices by the cluster validity: parts of a group that splits, the group of a new person (ours)."""

from __future__ import annotations

import math

import numpy as np

from sim.compiler import njit
from sim.elementary_kernels import sort_by
from sim.types import Array, Ints
from tracking.filters.nearest_kernels import empty_cells, nearest, put, take
from tracking.papers.joint.partition_labels_kernels import validity_of

# Largest group of which all divisions into two parts are tried.
MOST_LISTED = 6


@njit(cache=True)
def divide(points: Array, cluster: Ints, g: int, uniform: float, sharpness: float, scales: Array, label: Ints) -> None:
    """Divide cluster g into two parts, drawn with probabilities exp(-sharpness d_cl) of the two parts (ours).

    points (K, D): as validity_of; cluster (K,); uniform in [0, 1); label (K,): changed in place. Up to MOST_LISTED
    people all divisions are candidates; of larger groups those that leave one person out, and cuts across the first
    principal axis of the points.
    """
    members = np.flatnonzero(cluster == g)
    own = points[members]
    sides = candidates(own)
    centre, scatter = np.empty_like(own), np.empty(len(own))
    energy, least = np.empty(len(sides)), np.inf
    for c in range(len(sides)):
        energy[c] = sharpness * validity_of(own, sides[c], 2, scales, centre, scatter)
        least = min(least, energy[c])
    total = 0.0
    for c in range(len(sides)):
        energy[c] = math.exp(least - energy[c])
        total += energy[c]
    row, reached = 0, energy[0]
    while row < len(sides) - 1 and uniform * total >= reached:
        row += 1
        reached += energy[row]
    for side in range(2):
        part = members[sides[row] == side]
        label[part] = 1 + part[0] if len(part) > 1 else 0


@njit(cache=True)
def candidates(points: Array) -> Ints:
    """Returns the candidate divisions of n points (n, D), (C, n): the side of each point, 0 or 1; both sides occur."""
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
    ranked = np.empty(n, np.int64)
    for k in range(n):
        ranked[k] = k
        for d in range(dims):
            along[k] += away[k, d] * axis[d]
    sort_by(along, ranked)
    for cut in range(1, n):
        for k in range(cut):
            sides[n + cut - 1, ranked[k]] = 1
    return sides


@njit(cache=True)
def place_newcomers(points: Array, label: Ints, uniforms: Array, sharpness: float, scales: Array) -> None:
    """Draw whether each of M new people, the last ones, joins the nearest cluster, one after the other, in all
    partitions in which the person is alone (ours).

    points (N_x, K, D): as validity_of; label (N_x, N_z, K): changed in place; uniforms (N_x, N_z, M). The probabilities
    of apart and together are proportional to exp(-sharpness d_cl) of the two clusters apart and as one.
    """
    particles, partitions, n = label.shape
    dims = points.shape[2]
    # by the head of a cluster: sum of the places, mean place, number of members
    total, middle, size = np.empty((n, 2)), np.empty((n, 2)), np.empty(n)
    following, after = np.empty(n, np.int64), np.empty(n, np.int64)  # next member of a cluster; next head in a cell
    own, side = np.empty((n, dims)), np.empty(n, np.int64)  # the person and the nearest cluster; 0 and 1
    centre, scatter, corner = np.empty((n, dims)), np.empty(n), np.empty(3)
    # the last other person alone that was nearest under this particle, and the probability to join that one
    partner, chance = np.empty(n, np.int64), np.empty(n)
    for i in range(particles):
        cells = empty_cells(points[i], n, corner)
        partner[:] = -1
        for j in range(partitions):
            groups = label[i, j]
            _clusters(points[i], groups, total, size, following)
            cells[:] = -1
            for k in range(n):
                if size[k] > 0:
                    middle[k, 0], middle[k, 1] = total[k, 0] / size[k], total[k, 1] / size[k]
                    put(middle, k, corner, cells, after)
            for person in range(n - uniforms.shape[2], n):
                if groups[person] > 0:
                    continue
                g = nearest(middle, person, corner, cells, after)
                if g < 0:
                    break
                if size[g] > 1 or partner[person] != g:
                    partner[person] = g if size[g] == 1 else -1
                    count, k = 0, person
                    while k >= 0:
                        side[count] = min(count, 1)
                        for d in range(dims):
                            own[count, d] = points[i, k, d]
                        k = g if k == person else following[k]
                        count += 1
                    apart = validity_of(own[:count], side, 2, scales, centre, scatter)
                    side[:count] = 0
                    together = validity_of(own[:count], side, 1, scales, centre, scatter)
                    chance[person] = 1 / (1 + math.exp(min(sharpness * (together - apart), 700.0)))
                if uniforms[i, j, person - n] >= chance[person]:
                    continue
                take(middle, person, corner, cells, after)
                take(middle, g, corner, cells, after)
                head = _joined(points[i], person, g, groups, total, size, following)
                middle[head, 0], middle[head, 1] = total[head, 0] / size[head], total[head, 1] / size[head]
                put(middle, head, corner, cells, after)


@njit(cache=True)
def _clusters(points, groups, total, size, following):  # type: ignore[no-untyped-def]
    for k in range(len(groups)):
        following[k], head = -1, k if groups[k] == 0 else groups[k] - 1
        if head == k:
            total[k, 0], total[k, 1], size[k] = 0.0, 0.0, 0.0
        else:
            size[k] = 0.0
            last = head
            while following[last] >= 0:
                last = following[last]
            following[last] = k
        _add(points, k, head, total, size)


@njit(cache=True)
def _joined(points, person, g, groups, total, size, following):  # type: ignore[no-untyped-def]
    head, other = min(person, g), max(person, g)
    _add(points, person, g, total, size)
    total[head, 0], total[head, 1], size[head] = total[g, 0], total[g, 1], size[g]
    size[other] = 0.0
    if head == g:  # members are in ascending order
        before = g
        while 0 <= following[before] < person:
            before = following[before]
        following[before], following[person] = person, following[before]
    else:
        following[person] = g
    k = head
    while k >= 0:
        groups[k], k = 1 + head, following[k]
    return head


@njit(cache=True)
def _add(points, k, head, total, size):  # type: ignore[no-untyped-def]
    total[head, 0] += points[k, 0]
    total[head, 1] += points[k, 1]
    size[head] += 1
