"""Small functions that other kernels call: those of `sim.elementary` for scalars, the lookup of a union-find, a sort.

The union-find's elements 0 to M - 1 form trees in an array of parents (M,); it labels connected pixels and components.
numba's own np.sort and np.argsort take two seconds to compile wherever they are used.
"""

from __future__ import annotations

from sim import elementary
from sim.compiler import njit
from sim.types import Array, Ints


@njit(cache=True)
def sort_by(key: Array, rows: Ints) -> None:
    """Sorts rows (M,), row numbers of key, in place by their key, equal keys by row: Shell's sort."""
    gap = len(rows) // 2
    while gap > 0:
        for i in range(gap, len(rows)):
            row, j = rows[i], i
            while j >= gap and (
                key[rows[j - gap]] > key[row] or (key[rows[j - gap]] == key[row] and rows[j - gap] > row)
            ):
                rows[j] = rows[j - gap]
                j -= gap
            rows[j] = row
        gap //= 2


@njit(cache=True)
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
