"""Kernels of tracking.papers.relational.sensor: densities of detections, and the sums of each particle."""

from __future__ import annotations

import math

import numpy as np

from sim.compiler import njit
from sim.types import Array, Bools, Ints
from tracking.papers.relational.association_sums_kernels import cheapest, linked, sparse_sum

# Pairs of complete mappings that are less probable than those of the best mapping by this factor are left out.
NOTHING = 1e-20


@njit(cache=True)
def densities(
    pos: Array, points: Array, pairs: Ints, sd: float, wide: float, share: Array, eye: Array, reach: float
) -> Array:
    """Returns the density of each pair's point in each particle, (P, N), 1/m^2: g = (1 - share) N(z; x, sd^2) + share
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
        k, j = pairs[n, 0], pairs[n, 1]
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
def person_sums(
    density: Array, pairs: Ints, exist: Array, detect: Array, clutter: float, free: Array, logs: Array,
    marginals: Array, measured: Array,
) -> None:  # fmt: skip
    """Writes the log-likelihoods (P, K) of each person in each particle, all others averaged, the marginals (P, N): the
    probability of each pair, and the probability that each person is measured, (P, K): the sum of the person's pairs.

    density (P, N): of the N pairs (N, 2) of a person and a point, all others are impossible, as `densities` gives it;
    exist (P, K): probability that each person exists; detect (K,): probability that each is measured if existing;
    clutter: false alarms per m^2, above 0; free (K, M): probability that nobody else has a detection.

    The sum over all mappings is linear in a person's weights: with W = exist detect g free / clutter it is 1 - exist
    detect + sum of W.
    """
    particles, n = exist.shape
    total = np.empty(n)
    for p in range(particles):
        for k in range(n):
            total[k] = 1.0 - exist[p, k] * detect[k]
            measured[p, k] = 0.0
        for c in range(len(pairs)):
            k, j = pairs[c, 0], pairs[c, 1]
            marginals[p, c] = exist[p, k] * detect[k] * density[p, c] * free[k, j] / clutter
            total[k] += marginals[p, c]
        for c in range(len(pairs)):
            k = pairs[c, 0]
            if total[k] > 0.0:
                marginals[p, c] /= total[k]
            measured[p, k] += marginals[p, c]
        for k in range(n):
            logs[p, k] = math.log(total[k]) if total[k] > 0.0 else -math.inf


@njit(cache=True)
def components(near: Bools) -> tuple[Ints, Ints]:
    """Returns the numbers (K,) and (M,) of the connected components of people and detections; near (K, M): which are
    linked. A detection that is linked to nobody has -1."""
    n, m = near.shape
    person, point = np.empty(n, np.int64), np.full(m, -1)
    row_done, column_done = np.zeros(n, np.bool_), np.zeros(m, np.bool_)
    rows, columns = np.empty(n, np.int64), np.empty(m, np.int64)
    for k in range(n):
        if not row_done[k]:
            count, width = linked(near, k, row_done, column_done, rows, columns)
            person[rows[:count]], point[columns[:width]] = k, k
    return person, point


@njit(cache=True)
def complete_sums(
    pos: Array, points: Array, sd: float, person: Ints, point: Ints, logs: Array, marginals: Array
) -> None:
    """Adds to the log-likelihoods (P, 1) of each particle the sum over all complete mappings, but for constants, and
    writes the marginals (P, N).

    pos (P, K, 2), m; points (M, 2), m; sd: standard deviation of a point per axis, m. person (K,), point (M,): of
    `components`; the N pairs are those in one component, in order of people, then points. A complete mapping maps the
    smaller side of each component wholly: nobody is missed, and no detection a false alarm, as far as numbers allow.
    """
    first, start = np.empty(len(person), np.int64), 0
    for k in range(len(person)):
        first[k] = start
        start += np.sum(point == person[k])
    for k in range(len(person)):
        columns = np.flatnonzero(point == k)
        if person[k] == k and len(columns):
            _complete_component(pos, points, sd, np.flatnonzero(person == k), columns, first, logs, marginals)


@njit(cache=True)
def _complete_component(pos, points, sd, rows, columns, first, logs, marginals):  # type: ignore[no-untyped-def]
    turned = len(rows) > len(columns)
    n, m = min(len(rows), len(columns)), max(len(rows), len(columns))
    W, found, u, v, spare = np.empty((n, m)), np.empty((n, m)), np.empty(n), np.empty(m), np.empty(m)
    for p in range(len(pos)):
        for a in range(n):
            for b in range(m):
                row, column = (b, a) if turned else (a, b)
                k, j = rows[row], columns[column]
                dx, dy = points[j, 0] - pos[p, k, 0], points[j, 1] - pos[p, k, 1]
                W[a, b] = 0.5 * (dx * dx + dy * dy) / sd**2
        # With these factors of rows and columns the most probable mapping has the weight 1, so that no sum underflows.
        cheapest(W, u, v)
        for b in range(m):
            spare[b] = math.exp(v[b])
            for a in range(n):
                weight = math.exp(u[a] + v[b] - W[a, b])
                W[a, b] = weight if weight > NOTHING else 0.0  # so that people are not linked, and the sum is cheap
        logs[p, 0] += sparse_sum(W, np.zeros(n), spare, found) - u.sum() - v.sum()
        for a in range(n):
            for b in range(m):
                row, column = (b, a) if turned else (a, b)
                marginals[p, first[rows[row]] + column] = found[a, b]
