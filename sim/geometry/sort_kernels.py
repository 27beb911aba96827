"""A sort for kernels. numba's own np.sort and np.argsort take two seconds to compile wherever they are used."""

from __future__ import annotations

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
