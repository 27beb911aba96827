"""Numba kernels of the evidence of pairs: exponential means over a pair's rows, and counts of common neighbours."""

from __future__ import annotations

import numpy as np

from sim.compiler import njit
from sim.types import Array, Bools, Ints


@njit(cache=True)
def add_to_means(
    step: Ints, pair: Ints, values: Array, times: Array, total: Array, weight: Array, last: Ints, out: Array
) -> None:
    """Adds rows (R,) of values (R, V) to the means of their pairs, in order, and writes the means after each to out.

    times (T,): in steps. total, weight (K, V, T), last (K,): state by pair. out (R, V, T): nan before the first number.
    """
    fade = np.empty(len(times))
    for r in range(len(step)):
        k = pair[r]
        for n in range(len(times)):
            # the age of all former rows, applied once for each time
            fade[n] = np.exp(-(step[r] - last[k]) / times[n])
        last[k] = step[r]
        for v in range(values.shape[1]):
            x = values[r, v]
            known = not np.isnan(x)
            for n in range(len(times)):
                weight[k, v, n] = weight[k, v, n] * fade[n] + (1.0 if known else 0.0)
                total[k, v, n] = total[k, v, n] * fade[n] + (x if known else 0.0)
                out[r, v, n] = total[k, v, n] / weight[k, v, n] if weight[k, v, n] > 0 else np.nan


@njit(cache=True)
def common_neighbours(i: Ints, j: Ints, linked: Bools, rows: int) -> Array:
    """Returns for each pair (i, j) (R,) of `rows` rows how many third rows are linked with both, (R,)."""
    # neighbours of each row, one list after the other
    start = np.zeros(rows + 1, np.int64)
    for r in range(len(i)):
        if linked[r]:
            start[i[r] + 1] += 1
            start[j[r] + 1] += 1
    for r in range(rows):
        start[r + 1] += start[r]
    neighbour, end = np.empty(start[rows], np.int64), np.empty(rows, np.int64)
    for r in range(rows):
        end[r] = start[r]
    for r in range(len(i)):
        if linked[r]:
            neighbour[end[i[r]]], neighbour[end[j[r]]] = j[r], i[r]
            end[i[r]] += 1
            end[j[r]] += 1
    out, marked = np.zeros(len(i)), np.empty(rows, np.int64)
    for r in range(rows):
        marked[r] = -1
    for r in range(len(i)):
        if start[i[r]] < end[i[r]] and start[j[r]] < end[j[r]]:
            for n in range(start[i[r]], end[i[r]]):
                marked[neighbour[n]] = r
            for n in range(start[j[r]], end[j[r]]):
                if marked[neighbour[n]] == r:
                    out[r] += 1
    return out
