"""Kernel of tracking.detect.person_size: values of a table (C, V, U) between its nodes, by bilinear interpolation."""

from __future__ import annotations

import numpy as np

from sim.compiler import njit
from sim.types import Array


@njit(cache=True)
def look_up(table: Array, at: Array) -> Array:
    """Returns bilinearly interpolated values (N, C) of a table (C, V, U) at N points; V and U must be at least 2.

    at (N, 2): u, v in grid steps from the table's first node. A coordinate outside the table is moved to its edge; a
    nan coordinate counts as 0. A nan among the four nodes round a point gives nan.
    """
    last_u, last_v = table.shape[2] - 1.001, table.shape[1] - 1.001
    found = np.empty((len(at), table.shape[0]))
    for n in range(len(at)):
        x, y = clamped(at[n, 0], last_u), clamped(at[n, 1], last_v)
        u, v = int(x), int(y)
        a, b = x - u, y - v
        for c in range(table.shape[0]):
            low = table[c, v, u] * (1 - a) + table[c, v, u + 1] * a
            high = table[c, v + 1, u] * (1 - a) + table[c, v + 1, u + 1] * a
            found[n, c] = low * (1 - b) + high * b
    return found


@njit(cache=True)
def clamped(x: float, last: float) -> float:
    """Returns x limited to the range from 0 to `last`; 0 if x is nan."""
    return min(max(x, 0.0), last) if x == x else 0.0
