"""Kernels of choices by the cluster validity: parts of a group that splits, the group of a new person (ours)."""

from __future__ import annotations

import math

import numpy as np

from sim.compiler import njit
from sim.elementary_kernels import sort_by
from sim.types import Array, Ints
from tracking.papers.joint.partition_kernels import APART, SCATTER, nearest_place, validity_of

MOST_LISTED = 6
"""Largest group of which all divisions into two parts are tried."""


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
        for d in range(dims):
            own[k, d] = points[members[k], d]
    sides = candidates(own)
    centre, scatter = np.empty((n, dims)), np.empty(n)
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
    """Returns the people (n,) of cluster g, ascending; cluster (K,)."""
    n = 0
    out = np.empty(len(cluster), np.int64)
    for k in range(len(cluster)):
        if cluster[k] == g:
            out[n] = k
            n += 1
    return out[:n]


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
    # by the head of a cluster: sum and mean of the places, number of members, 0 if it is none, the last of them
    total, centre, alive = np.empty((n, 2)), np.empty((n, 2)), np.empty(n, np.bool_)
    size, last = np.empty(n), np.empty(n, np.int64)
    # next member of a person's cluster, -1 at its end; heads by x of the mean place, and where each is in them
    following, order, position = np.empty(n, np.int64), np.empty(n, np.int64), np.empty(n, np.int64)
    x, own, other = np.empty(n), np.empty(points.shape[2]), np.empty(points.shape[2])
    for i in range(particles):
        for j in range(partitions):
            groups, count = label[i, j], 0
            for k in range(n):
                head = k if groups[k] == 0 else groups[k] - 1
                if head == k:
                    total[k, 0], total[k, 1], size[k] = 0.0, 0.0, 0.0
                    order[count] = k
                    count += 1
                else:
                    following[last[head]] = k
                last[head], following[k], alive[k] = k, -1, head == k
                _add(points[i], k, head, total, size)
            for at in range(count):
                g = order[at]
                centre[g, 0], centre[g, 1] = total[g, 0] / size[g], total[g, 1] / size[g]
                x[g] = centre[g, 0]
            sort_by(x, order[:count])
            for at in range(count):
                position[order[at]] = at
            for person in range(n - uniforms.shape[2], n):
                if groups[person] > 0:
                    continue
                g = nearest_place(centre, alive, order[:count], position[person])
                if g < 0:
                    continue
                join = _join_probability(points[i], person, g, following, size[g], sharpness, scales, own, other)
                if uniforms[i, j, person - n] >= join:
                    continue
                _add(points[i], person, g, total, size)
                head = min(person, g)
                total[head, 0], total[head, 1], size[head] = total[g, 0], total[g, 1], size[g]
                alive[max(person, g)] = False
                centre[head, 0], centre[head, 1] = total[head, 0] / size[head], total[head, 1] / size[head]
                _put(head, centre, order[:count], position)
                _link(person, g, following)
                k = head
                while k >= 0:
                    groups[k] = 1 + head
                    k = following[k]


@njit(cache=True)
def _put(head, centre, order, position):  # type: ignore[no-untyped-def]
    """Moves a head, whose centre has changed, to its place in the order."""
    at = position[head]
    for step in (-1, 1):
        while 0 <= at + step < len(order) and step * (centre[order[at + step], 0] - centre[head, 0]) < 0:
            order[at] = order[at + step]
            position[order[at]] = at
            at += step
    order[at], position[head] = head, at


@njit(cache=True)
def _link(person, head, following):  # type: ignore[no-untyped-def]
    """Adds a person to the members of a cluster, which are linked in ascending order."""
    if person < head:
        following[person] = head
        return
    before = head
    while 0 <= following[before] < person:
        before = following[before]
    following[person], following[before] = following[before], person


@njit(cache=True)
def _add(points, k, head, total, size):  # type: ignore[no-untyped-def]
    total[head, 0] += points[k, 0]
    total[head, 1] += points[k, 1]
    size[head] += 1


@njit(cache=True)
def _join_probability(points, person, g, following, count, sharpness, scales, own, other):  # type: ignore[no-untyped-def]
    s0, apart = scales[SCATTER], scales[APART]
    single, all_of_them = _scatter(points, person, g, following, count, s0, own, other)
    away = 0.0
    for d in range(len(own)):
        away += (points[person, d] - other[d]) ** 2
    ratio = (s0 / 2 + single) / max(math.sqrt(away), s0)
    separate = (max(s0 / 2 / apart, ratio) + max(single / apart, ratio)) / 2
    return 1 / (1 + math.exp(min(sharpness * (all_of_them / apart - separate), 700.0)))


@njit(cache=True)
def _scatter(points, person, g, following, count, s0, both, other):  # type: ignore[no-untyped-def]
    dims = len(both)
    for d in range(dims):
        both[d], other[d] = points[person, d], 0.0
    k = g
    while k >= 0:
        for d in range(dims):
            both[d] += points[k, d]
            other[d] += points[k, d]
        k = following[k]
    for d in range(dims):
        both[d] /= count + 1
        other[d] /= count
    without, with_person = s0, s0 + _distance(points, person, both)
    k = g
    while k >= 0:
        without += _distance(points, k, other) if count > 1 else 0.0
        with_person += _distance(points, k, both)
        k = following[k]
    return without / (count + 1), with_person / (count + 2)


@njit(cache=True)
def _distance(points, k, mean):  # type: ignore[no-untyped-def]
    total = 0.0
    for d in range(len(mean)):
        total += (points[k, d] - mean[d]) ** 2
    return math.sqrt(total)
