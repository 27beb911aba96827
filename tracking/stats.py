"""How sure a mean over sequences is: the bootstrap."""

from __future__ import annotations

import numpy as np

from sim.types import Array

DRAWS = 2000
LEVEL = 0.95


def bootstrap(values: Array, draws: int = DRAWS) -> tuple[Array, Array, Array]:
    """Mean, low and high (K,) of 95 % percentile intervals over S sequences, values (S, K); nan rows of a column are
    left out. The same values give the same interval; one sequence gives nan for its ends."""
    count, columns = values.shape
    if count < 2:
        return values.mean(axis=0), np.full(columns, np.nan), np.full(columns, np.nan)
    known = np.isfinite(values)
    rows = np.random.default_rng(0).integers(count, size=(draws, count))
    weight = known[rows].sum(axis=1)
    total = np.where(known, values, 0.0)[rows].sum(axis=1)
    means = np.where(weight > 0, total / np.maximum(weight, 1), np.nan)
    out = np.full((3, columns), np.nan)
    for k in np.flatnonzero(known.any(axis=0)):
        drawn = means[np.isfinite(means[:, k]), k]
        tail = (1 - LEVEL) / 2
        out[:, k] = values[known[:, k], k].mean(), *np.quantile(drawn, (tail, 1 - tail))
    return out[0], out[1], out[2]
