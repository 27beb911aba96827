"""Weighted sums over the frames of one recording, and ratios of them, for D draws of weights at once.

Weights are arrays (D, size) by frame number from 0, size being the length of the recording + 1.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from sim.types import Array, Ints

# Takes weights (D, size) by frame number; returns scores (D,) by key.
WeightedScores = Callable[[Array], dict[str, Array]]


def unweighted(scores: WeightedScores, size: int) -> dict[str, float]:
    """Returns the scores by key if every frame has the weight 1; size: number of frame numbers, from 0."""
    return {key: float(value[0]) for key, value in scores(np.ones((1, size))).items()}


class FrameSums:
    """Named sums that are linear in the weights of the frames; State: by name, the part of each frame (size,)."""

    def __init__(self, size: int) -> None:
        self._size = size
        self._columns: dict[str, Array] = {}
        self._totals: dict[str, float] = {}

    def add(self, name: str, frame: Ints, values: Array | Ints | None = None, total: float | None = None) -> None:
        """Adds the sum `name` of K items: frame (K,), their frame numbers; values (K,), 1 each by default.

        total: at weights of 1, where it is added up in another order; the last bit of a score depends on it.
        """
        self._columns[name] = np.bincount(frame, weights=values, minlength=self._size).astype(float)
        if total is not None:
            self._totals[name] = total

    def add_mean(self, name: str, frame: Ints, values: Array, total: float | None = None) -> None:
        """Adds what `mean` needs: the sum `name` of the finite values (K,), and their number."""
        known = np.isfinite(values)
        self.add(name, frame[known], values[known], total)
        self.add(f"{name} known", frame[known])

    def of(self, weights: Array) -> dict[str, Array]:
        """Returns the weighted sums (D,) by name; weights (D, size)."""
        columns = np.column_stack(list(self._columns.values()))
        found = dict(zip(self._columns, (weights @ columns).T, strict=True))
        exact = [place for place, name in enumerate(self._columns) if name in self._totals]
        changes = ((weights - 1) @ columns[:, exact]).T  # sum w x = total + sum (w - 1) x
        return found | {n: total + d for (n, total), d in zip(self._totals.items(), changes, strict=True)}


def mean(sums: dict[str, Array], name: str) -> Array:
    """Returns the weighted means (D,) of the values given to `FrameSums.add_mean`, nan without a finite one."""
    return ratio(sums[name], sums[f"{name} known"])


def ratio(part: Array, whole: Array, empty: float = float("nan")) -> Array:
    """Returns part / whole, `empty` where whole is 0; both of one shape."""
    return np.asarray(np.divide(part, whole, out=np.full(np.shape(part), empty), where=np.asarray(whole) > 0))


def mean_of_known(values: Array) -> Array:
    """Returns the means (D,) of the columns of values (D, C) that are not nan; nan where all are."""
    known = ~np.isnan(values)
    return ratio(np.where(known, values, 0.0).sum(axis=1), known.sum(axis=1).astype(float))


class BinSums:
    """Numbers of items by bin (for example by id), weighted by their frames: items of each bin and frame, sparse."""

    def __init__(self, frame: Ints, bin: Ints, bins: int, size: int) -> None:
        from scipy.sparse import csr_array

        self._counts = csr_array((np.ones(len(frame)), (bin, frame)), shape=(bins, size))

    def of(self, weights: Array) -> Array:
        """Returns the weighted numbers of items, (D, bins); weights (D, size)."""
        return np.asarray((self._counts @ weights.T).T)
