"""Candidate pairs: which true and estimated rows of the same frame are similar at all, and how similar.

All matching in scoring starts from `Pairs`. Inputs are two `FrameRows` (frame number and id of each person or group)
and a similarity: IoU, intersection over union, of boxes (`box_pairs`), distance of positions (`point_pairs`), given
matrices (`matrix_pairs`) or any function (`compare`). All frames are processed at once. A pair of similarity 0 is not
stored, unless the function given to `compare` keeps it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sim.types import Array, Bools, Ints
from tracking.scoring.rows import FrameRows, numbered

EPS = float(np.finfo(float).eps)
FOUND = 0.5
"""Similarity from which a person or group counts as found: 1 m apart on the ground, or an IoU of 0.5."""
CHUNK = 200_000  # pairs compared at once: bounds memory and fits the cache
SLACK = 1e-6  # share of the coordinates' range: more than rounding can move a row along the sort axis of `_near`


@dataclass(frozen=True)
class Pairs:
    """K candidate pairs of a true and an estimated row of one frame, sorted by true row and therefore by frame.

    - true, est: all R true and S estimated rows (people or groups in frames), with or without a pair.
    - i (K,), j (K,): int64, index of the pair's row in `true` and in `est`.
    - s (K,): similarity of the two rows, 0 < s <= 1. `compare` stores whatever its function returns, such as distances.
    """

    true: FrameRows
    est: FrameRows
    i: Ints
    j: Ints
    s: Array

    @property
    def frame(self) -> Ints:
        """Frame number of each of the K pairs, (K,)."""
        return self.true.frame[self.i]

    def keep(self, mask: Bools) -> Pairs:
        """Returns the pairs where the bool mask (K,) is true. All true and estimated rows are kept, also those without
        a pair.
        """
        return Pairs(self.true, self.est, self.i[mask], self.j[mask], self.s[mask])

    @cached_property
    def true_ids(self) -> tuple[Ints, Ints]:
        """Returns two arrays: the N distinct true ids in ascending order, (N,), and for each true row the index of its
        id in the first array, (R,). Both are empty without true rows.
        """
        return numbered(self.true.id)

    @cached_property
    def est_ids(self) -> tuple[Ints, Ints]:
        """Returns two arrays: the M distinct estimated ids in ascending order, (M,), and for each estimated row the
        index of its id in the first array, (S,). Both are empty without estimated rows.
        """
        return numbered(self.est.id)

    @cached_property
    def links(self) -> tuple[Ints, Ints, Ints]:
        """The U distinct combinations (true id, estimated id) among the K pairs, as three arrays.

        They are: the index of the true id in `true_ids[0]` (U,), the index of the estimated id in `est_ids[0]` (U,),
        and for each pair the index of its combination (K,). Combinations are sorted by true id, then estimated id.
        """
        width = max(len(self.est_ids[0]), 1)
        key = self.true_ids[1][self.i] * width + self.est_ids[1][self.j]
        distinct, which = numbered(key)
        return distinct // width, distinct % width, which

    def in_frames(self, mask: Bools) -> Pairs:
        """Returns the rows and pairs of the frames f where mask[f] is true, with i and j renumbered to the kept rows.

        mask (F,): bool, indexed by frame number; it must reach to the last frame of both sides, else IndexError is
        raised. Frame numbers themselves do not change.
        """
        true, est = mask[self.true.frame], mask[self.est.frame]
        kept = true[self.i]
        place_i, place_j = np.cumsum(true) - 1, np.cumsum(est) - 1
        return Pairs(
            self.true.keep(true), self.est.keep(est), place_i[self.i[kept]], place_j[self.j[kept]], self.s[kept]
        )


PairSimilarity = Callable[[Ints, Ints], tuple[Ints, Array]]
"""Takes row indices i and j (P,) of both sides. Returns the positions (Q,) of the pairs to keep, and their similarities
(Q,)."""


def compare(
    true: FrameRows, est: FrameRows, similarity: PairSimilarity, within: tuple[Array, Array, Array] | None = None
) -> Pairs:
    """Returns the pairs of rows of one frame that a similarity function keeps.

    true, est: R true and S estimated rows, sorted by frame. similarity(i, j) gets row indices i (P,) of `true` and j
    (P,) of `est` of equal frame. It returns the positions (Q,), ascending, of the pairs to keep among these P, and
    their similarities (Q,), which are stored unchanged. It is called once per portion of about 200 000 pairs.

    within = (low, high, at) limits the pairs that the function is called for: low, high (R,) belong to the true rows,
    at (S,) to the estimated ones. Every pair with low[i] <= at[j] <= high[i] is passed, and a few others close to these
    limits. A true row with a nan or infinite limit, or an estimated row with such an `at`, gets no pairs. None passes
    all pairs of equal frame.
    """
    found = [(np.zeros(0, np.int64), np.zeros(0, np.int64), np.zeros(0))]
    for i, j in same_frame(true.frame, est.frame) if within is None else _near(true, est, *within):
        kept, s = similarity(i, j)
        found.append((i[kept], j[kept], s))
    return Pairs(true, est, *(np.concatenate(part) for part in zip(*found, strict=True)))


def same_frame(a: Ints, b: Ints) -> Iterator[tuple[Ints, Ints]]:
    """Yields all pairs (index in a, index in b) with equal frame, as two int arrays (P,) per portion.

    a (N,), b (M,): frame numbers, b sorted. Pairs are in ascending order of a, then b. A portion has at most about 200
    000 pairs, but always all partners of at least one element of a. Empty input yields no or empty portions.
    """
    first = np.searchsorted(b, a, side="left")
    return _portions(first, np.searchsorted(b, a, side="right") - first)


def _portions(first: Ints, count: Ints) -> Iterator[tuple[Ints, Ints]]:
    """Yields arrays k, first[k] + n for all k and all n in 0 … count[k] - 1, in ascending order.

    first (K,): start of each k's range; count (K,): its length, 0 allowed. A portion has at most 200 000 pairs, or all
    pairs of a single k if that has more.
    """
    total = np.concatenate(([0], np.cumsum(count)))
    cuts = [0]
    while cuts[-1] < len(count):
        cuts.append(max(int(np.searchsorted(total, total[cuts[-1]] + CHUNK, side="right")) - 1, cuts[-1] + 1))
    for begin, end in pairwise(cuts):
        n = count[begin:end]
        k = np.repeat(np.arange(begin, end), n)
        yield k, np.arange(len(k)) + np.repeat(first[begin:end] - (total[begin:end] - total[begin]), n)


def _near(a: FrameRows, b: FrameRows, low: Array, high: Array, at: Array) -> Iterator[tuple[Ints, Ints]]:
    """Yields arrays of row indices i of a and j of b of equal frame with low[i] <= at[j] <= high[i], and a few pairs
    just outside these limits.

    low, high (R,): limits of the R rows of a; at (S,): values of the S rows of b. A row with a nan or infinite limit or
    value gets no pairs. Rows of b are sorted by frame * span + at, where span exceeds the range of `at`. One binary
    search over this axis then finds the partners of every row of a in its own frame. Pairs are in ascending order of i;
    a portion has about 200 000.
    """
    finite = at[np.isfinite(at)]
    least, most = (float(finite.min()), float(finite.max())) if len(finite) else (0.0, 0.0)
    slack = SLACK * (most - least + 1)
    span = most - least + 3 * slack
    place = b.frame * span + (at - least)
    order = np.argsort(place, kind="stable")
    axis = place[order]
    first = np.searchsorted(axis, a.frame * span + np.maximum(low - least, 0.0) - slack, side="left")
    last = np.searchsorted(axis, a.frame * span + np.minimum(high - least, most - least) + slack, side="right")
    count = np.where(np.isfinite(low + high), np.maximum(last - first, 0), 0)
    return ((i, order[j]) for i, j in _portions(first, count))


def box_pairs(true: FrameRows, est: FrameRows, true_box: Array, est_box: Array) -> Pairs:
    """Returns the pairs of overlapping boxes of one frame, with their intersection over union as similarity.

    true_box (R, 4), est_box (S, 4): left, top, width, height of each row of `true` and `est`, in one unit (px). A box
    with a nan, or without positive width and height, has no pairs. Nor has an overlap too small to differ from 0 by
    rounding.
    """
    (la, ta, ra, ba), (lb, tb, rb, bb) = _edges(true_box), _edges(est_box)
    area_a, area_b = (np.maximum(box[:, 2], 0) * np.maximum(box[:, 3], 0) for box in (true_box, est_box))
    widest = float(est_box[np.isfinite(est_box[:, 2]), 2].max(initial=0.0))

    def similarity(i: Ints, j: Ints) -> tuple[Ints, Array]:
        width = np.minimum(ra[i], rb[j]) - np.maximum(la[i], lb[j])
        height = np.minimum(ba[i], bb[j]) - np.maximum(ta[i], tb[j])
        meet = np.flatnonzero((width > 0) & (height > 0))
        common = width[meet] * height[meet]
        union = area_a[i[meet]] + area_b[j[meet]] - common
        some = common > EPS * np.maximum(union, EPS)
        return meet[some], common[some] / union[some]

    return compare(true, est, similarity, (la - widest, ra, lb))


def _edges(box: Array) -> tuple[Array, Array, Array, Array]:
    return box[:, 0].copy(), box[:, 1].copy(), box[:, 0] + box[:, 2], box[:, 1] + box[:, 3]


def point_pairs(true: FrameRows, est: FrameRows, true_pos: Array, est_pos: Array, reach: float) -> Pairs:
    """Returns the pairs of positions of one frame closer than `reach`, with 1 - distance / reach as similarity.

    true_pos (R, 2), est_pos (S, 2): x, y of each row of `true` and `est`, in the unit of `reach` (m or px). A position
    with a nan or infinity has no pairs. reach: finite, above 0.
    """
    ax, ay, bx, by = (np.ascontiguousarray(pos[:, k]) for pos in (true_pos, est_pos) for k in (0, 1))

    def similarity(i: Ints, j: Ints) -> tuple[Ints, Array]:
        dx, dy = ax[i] - bx[j], ay[i] - by[j]
        s = 1 - np.sqrt(dx * dx + dy * dy) / reach
        some = np.flatnonzero(s > EPS)
        return some, s[some]

    return compare(true, est, similarity, (ax - reach, ax + reach, bx))


def matrix_pairs(
    true_ids: Sequence[NDArray[Any]], est_ids: Sequence[NDArray[Any]], similarity: Sequence[NDArray[Any]]
) -> Pairs:
    """Returns the pairs of similarity above 0, from lists with one entry per frame; entry 0 becomes frame 0.

    true_ids: whole-number ids (N,) of each frame; est_ids: ids (M,); similarity: a matrix (N, M) of each frame, rows as
    true_ids, columns as est_ids. N and M may differ between frames and may be 0. A similarity of 2.2e-16 or less, or
    nan, gives no pair. All three lists must have equal length and fitting shapes; this is not checked.
    """
    true, est = _stack_ids(true_ids), _stack_ids(est_ids)
    flat = np.concatenate([np.zeros(0), *(np.asarray(m, float).ravel() for m in similarity)])
    n, m = (np.array([len(a) for a in ids], np.int64) for ids in (true_ids, est_ids))
    width = np.repeat(m, n)  # matrix columns of each true row
    start = np.cumsum(width) - width
    possible = flat > EPS
    count = np.zeros(len(width), np.int64)
    some = width > 0
    if some.any():
        count[some] = np.add.reduceat(possible, start[some], dtype=np.int64)
    i = np.repeat(np.arange(len(width)), count)
    j = np.flatnonzero(possible) + np.repeat(np.repeat(np.cumsum(m) - m, n) - start, count)
    return Pairs(true, est, i, j, flat[possible])


def _stack_ids(ids: Sequence[NDArray[Any]]) -> FrameRows:
    count = np.array([len(a) for a in ids], np.int64)
    stacked = np.concatenate([np.zeros(0, np.int64), *(np.asarray(a, np.int64) for a in ids)])
    return FrameRows(np.repeat(np.arange(len(ids)), count), stacked)
