"""Compiled union-find lookup: finds the element that stands for all elements joined with a given one.

The elements 0 to M - 1 form trees in an array of parents (M,). Used to label connected pixels and components.
"""

from __future__ import annotations

from sim.arrays import Ints
from sim.compiler import njit


@njit(cache=True, error_model="numpy")
def find_root(parent: Ints, k: int) -> int:
    """Returns the root of element k in a forest of parents (M,), and shortens the path to it (path halving)."""
    while parent[k] != k:
        parent[k] = parent[parent[k]]
        k = parent[k]
    return k
