"""Scores as functions of weights of the frames of one recording, for intervals by resampling.

Weights are arrays (D, size), D draws by frame number from 0, size being the length of the recording + 1. Weights of 1
give the scores of the recording. Sums by frame are made once; each draw of weights is a matrix product.

Identities and matchings are those of the whole recording. The weight w(t) of frame t enters every sum: a match, a miss,
a switch or an event of frame t counts w(t) times. So no frames are joined, and no switch or event is made by a join.
Fixed are also the core frames and who counts for MT, PT and ML. Only IDF1, IDP, IDR and IDTP assign ids anew for each
draw, as their definition is a best assignment.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from sim.types import Array, Bools, Ints

F1_AND_PARTS = ("F1", "precision", "recall")

# Takes weights (D, size) by frame number; returns scores (D,) by key.
WeightedScores = Callable[[Array], dict[str, Array]]
# Takes scores, and the weighted sums of their parts by key and of their denominators by "KEY of"; returns scores; (D,).
MoreScores = Callable[[dict[str, Array], dict[str, Array]], dict[str, Array]]


def unweighted(scores: WeightedScores, size: int) -> dict[str, float]:
    """Returns the scores by key if every frame has the weight 1; size: number of frame numbers, from 0."""
    return {key: float(value[0]) for key, value in scores(np.ones((1, size))).items()}


class FrameScores:
    """Scores that are weighted sums over the frames, or ratios of two such sums; a call with weights returns them.

    State: columns (size,) by key, what each frame adds to a sum; a ratio has its numerator under "KEY" and its
    denominator under "KEY of". Also the totals that were given, the values of ratios whose denominator is 0, and the
    functions that make further scores of these.
    """

    def __init__(self, size: int) -> None:
        self._size = size
        self._columns: dict[str, Array] = {}
        self._totals: dict[str, float] = {}
        self._empty: dict[str, float] = {}
        self._further: list[MoreScores] = []

    def column(self, frame: Ints, values: Array | Ints | None = None, within: Bools | None = None) -> Array:
        """Returns the sum of the values of K items in each frame, (size,).

        frame (K,): frame number of each item. values (K,): None means 1 each, so that items are counted. within
        (size,), bool by frame number: frames where it is False get 0; None keeps all frames.
        """
        found = np.bincount(frame, weights=values, minlength=self._size).astype(float)
        return found if within is None else np.where(within, found, 0.0)

    def add(self, key: str, column: Array, total: float | None = None) -> None:
        """Adds a score, the weighted sum of a column (size,). total: the sum at weights of 1, if it was added up in
        another order, on which its last bit depends."""
        self._columns[key] = column
        if total is not None:
            self._totals[key] = total

    def add_ratio(
        self, key: str, part: Array, whole: Array, empty: float = float("nan"), total: float | None = None
    ) -> None:
        """Adds a score, the weighted sum of `part` divided by that of `whole`; both are columns (size,). empty: the
        score where the sum of `whole` is 0. total: the sum of `part` at weights of 1, as for `add`."""
        self.add(key, part, total)
        self.add(f"{key} of", whole)
        self._empty[key] = empty

    def add_mean(self, key: str, frame: Ints, values: Array, total: float | None = None) -> None:
        """Adds a score, the weighted mean of the finite ones of K values; it is nan if there is none. frame (K,): frame
        number of each value. total: the sum of the finite values at weights of 1, as for `add`."""
        known = np.isfinite(values)
        self.add_ratio(key, self.column(frame[known], values[known]), self.column(frame[known]), total=total)

    def add_f1(self, name: str, true: Array, est: Array, hits: Array, end: str = "") -> None:
        """Adds the scores name_F1, name_precision and name_recall, each with `end` appended to its key. true, est,
        hits: columns (size,), the numbers of true, estimated and matched items in each frame."""
        for key, part, whole in zip(F1_AND_PARTS, (2 * hits, hits, hits), (true + est, est, true), strict=True):
            self.add_ratio(f"{name}_{key}{end}", part, whole)

    def add_further(self, scores: MoreScores) -> None:
        """Adds a function that makes further scores of the scores and sums so far; it may also replace scores."""
        self._further.append(scores)

    def __call__(self, weights: Array) -> dict[str, Array]:
        """Returns the scores (D,) by key; weights (D, size)."""
        if not self._columns:
            return {}
        columns = np.column_stack(list(self._columns.values()))
        sums = dict(zip(self._columns, (weights @ columns).T, strict=True))
        exact = [place for place, key in enumerate(self._columns) if key in self._totals]
        changes = ((weights - 1) @ columns[:, exact]).T  # sum w x = total + sum (w - 1) x
        sums |= {key: total + d for (key, total), d in zip(self._totals.items(), changes, strict=True)}
        found = {key: sums[key] for key in sums if not key.endswith(" of")}
        found |= {key: ratio(sums[key], sums[f"{key} of"], empty) for key, empty in self._empty.items()}
        for scores in self._further:
            found |= scores(found, sums)
        return found


def ratio(part: Array, whole: Array, empty: float = float("nan")) -> Array:
    """Returns part / whole by elements, `empty` where whole is not above 0; both have one shape."""
    return np.asarray(np.divide(part, whole, out=np.full(np.shape(part), empty), where=np.asarray(whole) > 0))


def mean_of_known(values: Array) -> Array:
    """Returns the mean (D,) of each row of values (D, C) over its elements that are not nan; nan if all are nan."""
    known = ~np.isnan(values)
    return ratio(np.where(known, values, 0.0).sum(axis=1), known.sum(axis=1).astype(float))


def bin_sums(frame: Ints, bin: Ints, bins: int, size: int) -> Callable[[Array], Array]:
    """Returns a function from weights (D, size) of frames to the weighted number of items in each bin, (D, bins).
    frame, bin: frame number and bin of each item. Bins stand for ids, for example."""
    from scipy.sparse import csr_array

    counts = csr_array((np.ones(len(frame)), (bin, frame)), shape=(bins, size))
    return lambda weights: np.asarray((counts @ weights.T).T)
