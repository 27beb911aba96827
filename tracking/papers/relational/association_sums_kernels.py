"""Kernels of tracking.papers.relational.sensor: sums over all mappings of people to detections.

A mapping gives each of n rows (people) at most one of m columns (detections), and each column to at most one row. Its
weight is the product of W[i, j] over the pairs, miss[i] over the rows without a column, and spare[j] over the columns
without a row. `exact_sum` adds the weights of all mappings by dynamic programming over subsets of columns, O(n m 2^m);
`propagated_sum` approximates it by belief propagation, O(n m) a sweep. Both also return the marginals: the share of the
sum in mappings that contain each pair. Slow twin for tests: tests/reference_relational.py.
"""

from __future__ import annotations

import math

import numpy as np

from sim.compiler import njit
from sim.types import Array

# Largest number of rows or columns, whichever is less, of an exact sum; above it sums are propagated.
EXACT_BITS = 12
# Most sweeps of belief propagation.
SWEEPS = 200
# Belief propagation ends when no message changes by more than this share.
CONVERGED = 1e-10
# Least weight of a row without column, and of a column without row, in belief propagation.
TINY = 1e-150


@njit(cache=True)
def exact_sum(W: Array, miss: Array, spare: Array, marginals: Array) -> float:
    """Returns the log of the sum over all mappings, -inf if it is 0, and write the marginals (n, m) of the pairs.

    W (n, m), miss (n,), spare (m,): not negative. forward[i, S] is the sum over mappings of rows before i to exactly
    the columns S; backward[i, S] that of the rows from i on, S being taken. Rows are divided by their maxima, whose
    logs are added up.
    """
    n, m = W.shape
    full = 1 << m
    forward, backward = np.zeros((n + 1, full)), np.zeros((n + 1, full))
    forward[0, 0] = 1.0
    log_scale = 0.0
    for i in range(n):
        top = 0.0
        for s in range(full):
            total = forward[i, s] * miss[i]
            for j in range(m):
                if s >> j & 1:
                    total += forward[i, s ^ (1 << j)] * W[i, j]
            forward[i + 1, s] = total
            top = max(top, total)
        if top == 0.0:
            marginals[:] = 0.0
            return -math.inf
        log_scale += math.log(top)
        for s in range(full):
            forward[i + 1, s] /= top
    for s in range(full):
        free = 1.0
        for j in range(m):
            if not s >> j & 1:
                free *= spare[j]
        backward[n, s] = free
    total = 0.0
    for s in range(full):
        total += forward[n, s] * backward[n, s]
    if total == 0.0:
        marginals[:] = 0.0
        return -math.inf
    for i in range(n - 1, -1, -1):
        top = 0.0
        for s in range(full):
            value = backward[i + 1, s] * miss[i]
            for j in range(m):
                if not s >> j & 1:
                    value += backward[i + 1, s | (1 << j)] * W[i, j]
            backward[i, s] = value
            top = max(top, value)
        without = 0.0
        for s in range(full):
            without += forward[i, s] * backward[i + 1, s]
        whole = without * miss[i]
        for j in range(m):
            pair = 0.0
            if W[i, j] > 0:
                for s in range(full):
                    if not s >> j & 1:
                        pair += forward[i, s] * backward[i + 1, s | (1 << j)]
            marginals[i, j] = pair * W[i, j]
            whole += marginals[i, j]
        # Underflow: the row has a part in no mapping that a float can tell from 0.
        for j in range(m):
            marginals[i, j] /= whole if whole > 0 else 1.0
        for s in range(full):
            backward[i, s] /= top if top > 0 else 1.0
    return log_scale + math.log(total)


@njit(cache=True)
def propagated_sum(W: Array, miss: Array, spare: Array, marginals: Array) -> float:
    """Returns the Bethe approximation of the log of the sum over all mappings, and write its marginals (n, m).

    W (n, m), miss (n,), spare (m,): not negative. Messages of Williams & Lau 2014: with psi = W / (miss spare),
    mu[i, j] = psi[i, j] / (1 + sum of psi nu over the other columns) and nu[i, j] = 1 / (1 + sum of mu over the other
    rows). The value is exact for one row or one column, and a lower bound in all cases that were tried.
    """
    n, m = W.shape
    psi, mu, nu = np.empty((n, m)), np.empty((n, m)), np.empty((n, m))
    log_sum = 0.0
    for i in range(n):
        log_sum += math.log(max(miss[i], TINY))
    for j in range(m):
        log_sum += math.log(max(spare[j], TINY))
        for i in range(n):
            psi[i, j], nu[i, j] = W[i, j] / (max(miss[i], TINY) * max(spare[j], TINY)), 1.0
    for _ in range(SWEEPS):
        change = 0.0
        for i in range(n):
            whole = 1.0
            for j in range(m):
                whole += psi[i, j] * nu[i, j]
            for j in range(m):
                mu[i, j] = psi[i, j] / max(whole - psi[i, j] * nu[i, j], 1.0)
        for j in range(m):
            whole = 1.0
            for i in range(n):
                whole += mu[i, j]
            for i in range(n):
                new = 1.0 / max(whole - mu[i, j], 1.0)
                change = max(change, abs(new - nu[i, j]) / new)
                nu[i, j] = new
        if change < CONVERGED:
            break
    for i in range(n):
        whole = 1.0
        for j in range(m):
            whole += psi[i, j] * nu[i, j]
        log_sum += math.log(whole)
        for j in range(m):
            marginals[i, j] = psi[i, j] * nu[i, j] / whole
    for j in range(m):
        whole = 1.0
        for i in range(n):
            whole += mu[i, j]
            log_sum -= math.log(1.0 + mu[i, j] * nu[i, j])
        log_sum += math.log(whole)
    return log_sum


@njit(cache=True)
def cheapest(cost: Array, u: Array, v: Array) -> None:
    """Writes the dual variables u (n,) and v (m,) of the cheapest mapping of all rows, n <= m, to a column each.

    cost[i, j] - u[i] - v[j] is 0 for the pairs of this mapping and not negative for all others. v is not positive, and
    0 for columns without a row. Shortest augmenting paths (Jonker & Volgenant 1987).
    """
    n, m = cost.shape
    u[:], v[:] = 0.0, 0.0
    owner, before = np.full(m + 1, -1), np.empty(m, np.int64)  # column m is where the path of a new row begins
    for start in range(n):
        away, done = np.full(m, np.inf), np.zeros(m + 1, np.bool_)
        owner[m], j = start, m
        while owner[j] >= 0:
            done[j] = True
            i, nearest, least = owner[j], -1, np.inf
            for k in range(m):
                if not done[k]:
                    reduced = cost[i, k] - u[i] - v[k]
                    if reduced < away[k]:
                        away[k], before[k] = reduced, j
                    if away[k] < least:
                        nearest, least = k, away[k]
            for k in range(m + 1):
                if done[k]:
                    u[owner[k]] += least
                    if k < m:
                        v[k] -= least
                elif k < m:
                    away[k] -= least
            j = nearest
        while j != m:
            owner[j] = owner[before[j]]
            j = before[j]


@njit(cache=True)
def linked(W, start, row_done, column_done, rows, columns):  # type: ignore[no-untyped-def]
    """Writes the connected component of W (n, m) that row `start` is in: its rows and columns, in the order in which
    they are reached. Marks them as done and returns (number of rows, number of columns)."""
    n, m = W.shape
    row_done[start] = True
    rows[0], count, width, head = start, 1, 0, 0
    while head < count:
        i = rows[head]
        head += 1
        for j in range(m):
            if W[i, j] > 0 and not column_done[j]:
                column_done[j] = True
                columns[width] = j
                width += 1
                for k in range(n):
                    if W[k, j] > 0 and not row_done[k]:
                        row_done[k] = True
                        rows[count] = k
                        count += 1
    return count, width


@njit(cache=True)
def sparse_sum(W: Array, miss: Array, spare: Array, marginals: Array) -> float:
    """Returns the log of the sum over all mappings, -inf if it is 0, and write the marginals (n, m).

    Arguments as of `exact_sum`. Rows and columns with a pair of weight above 0 are linked; the sum is the product over
    connected components: exact if a component has at most EXACT_BITS rows or columns, else propagated.
    """
    n, m = W.shape
    marginals[:], log_sum = 0.0, 0.0
    row_done, column_done = np.zeros(n, np.bool_), np.zeros(m, np.bool_)
    rows, columns = np.empty(n, np.int64), np.empty(m, np.int64)
    for start in range(n):
        if row_done[start]:
            continue
        count, width = linked(W, start, row_done, column_done, rows, columns)
        log_sum += _component_sum(W, miss, spare, marginals, rows[:count], columns[:width])
    for j in range(m):
        if not column_done[j]:
            log_sum += math.log(spare[j]) if spare[j] > 0 else -math.inf
    return log_sum


@njit(cache=True)
def _component_sum(W, miss, spare, marginals, rows, columns):  # type: ignore[no-untyped-def]
    if len(columns) == 0:
        return math.log(miss[rows[0]]) if miss[rows[0]] > 0 else -math.inf
    turned = len(columns) > len(rows)  # subsets are those of the smaller side
    long, short = (columns, rows) if turned else (rows, columns)
    alone, other_alone = (spare, miss) if turned else (miss, spare)
    n, m = len(long), len(short)
    block, found, first, second = np.empty((n, m)), np.empty((n, m)), np.empty(n), np.empty(m)
    for b in range(m):
        second[b] = other_alone[short[b]]
    for a in range(n):
        first[a] = alone[long[a]]
        for b in range(m):
            block[a, b] = W[short[b], long[a]] if turned else W[long[a], short[b]]
    log_sum = propagated_sum(block, first, second, found) if m > EXACT_BITS else exact_sum(block, first, second, found)
    for a in range(n):
        for b in range(m):
            i, j = (short[b], long[a]) if turned else (long[a], short[b])
            marginals[i, j] = found[a, b]
    return log_sum
