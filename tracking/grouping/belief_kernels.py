"""Numba kernel of the belief: sums of tables."""

from __future__ import annotations

import numpy as np

from sim.compiler import njit
from sim.types import Array, Ints


@njit(cache=True)
def table_sums(values: Array, mix: Array, bias: float, column: Ints, cut: Ints, at: Array, heights: Array) -> Array:
    """Returns the beliefs (R,) of quantities (R, Q): bias plus what each table says, 0 where a quantity is unknown.

    mix (R, M): weights of the M columns of the tables. cut (T + 1,): where the knots of each table begin in at (N,) and
    heights (M, N).
    """
    out = np.empty(len(values))
    for r in range(len(values)):
        out[r] = bias
        for t in range(len(column)):
            x = values[r, column[t]]
            if not np.isnan(x):
                k, last = cut[t], cut[t + 1] - 1
                while k < last and at[k + 1] <= x:
                    k += 1
                part = (x - at[k]) / (at[k + 1] - at[k]) if x > at[k] and k < last else 0.0
                for m in range(len(heights)):
                    # most rows have a weight in one or two columns only
                    if mix[r, m] > 0:
                        out[r] += mix[r, m] * heights[m, k]
                        if part > 0:
                            out[r] += mix[r, m] * part * (heights[m, k + 1] - heights[m, k])
    return out
