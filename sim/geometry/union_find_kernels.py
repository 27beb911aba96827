"""Compiled: trees of parents that join numbers into sets, for whoever labels connected things."""

from __future__ import annotations

from numba import njit

from sim.arrays import Ints


@njit(cache=True, error_model="numpy")
def root(parent: Ints, k: int) -> int:
    """The root of k's tree, parent (M,) being each one's next on the way there; halves the way."""
    while parent[k] != k:
        parent[k] = parent[parent[k]]
        k = parent[k]
    return k
