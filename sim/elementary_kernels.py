"""Small functions that other kernels call: those of `sim.elementary` for scalars, and the lookup of a union-find.

The union-find's elements 0 to M - 1 form trees in an array of parents (M,); it labels connected pixels and components.
"""

from __future__ import annotations

from sim import elementary
from sim.arrays import Ints
from sim.compiler import njit


@njit(cache=True, error_model="numpy")
def find_root(parent: Ints, k: int) -> int:
    """Returns the root of element k in a forest of parents (M,), and shortens the path to it (path halving)."""
    while parent[k] != k:
        parent[k] = parent[parent[k]]
        k = parent[k]
    return k


exp = njit(cache=True)(elementary.exp)
sin = njit(cache=True)(elementary.sin)
cos = njit(cache=True)(elementary.cos)
atan2 = njit(cache=True)(elementary.atan2)
