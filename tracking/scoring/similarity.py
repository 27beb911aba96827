"""Candidate pairs: which true and estimated rows of the same frame are similar at all, and how similar.

All matching in scoring starts from `Pairs`. Inputs are two `FrameRows` (frame number and id of each person or group)
and a similarity: IoU, intersection over union, of boxes (`box_pairs`), distance of positions (`point_pairs`), or
any function (`compare`). All frames are processed at once. A pair of similarity 0 is not stored, unless the function
given to `compare` keeps it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np

from sim.types import Array, Bools, Ints
from tracking.scoring.rows import FrameRows, numbered

EPS = float(np.finfo(float).eps)
REACH = 2.0  # m: distance from which the similarity of two positions is 0; also the cut-off of GOSPA
FOUND = 0.5  # Similarity from which a person or group counts as found: 1 m apart on the ground, or an IoU of 0.5.
CHUNK = 200_000  # pairs compared at once: bounds memory and fits the cache
SLACK = 1e-6  # share of the coordinates' range: more than rounding can move a row along the sort axis of `_near`


@dataclass(frozen=True)
class Pairs:
    """K candidate pairs of a true and an estimated row of one frame, sorted by true row and therefore by frame."""

    # true, est: all R true and S estimated rows (people or groups in frames), with or without a pair
    true: FrameRows
    est: FrameRows
    # i (K,), j (K,): int64, index of the pair's row in `true` and in `est`
    i: Ints
    j: Ints
    # (K,): similarity of the two rows, 0 < s <= 1. `compare` stores whatever its function returns, such as distances.
    s: Array

    @property
    def frame(self) -> Ints:
        """Frame number of each of the K pairs, (K,)."""
        return self.true.frame[self.i]

    @property
    def size(self) -> int:
        """Number of frame numbers, 0 … last of both sides."""
        return 1 + max((int(rows.frame[-1]) for rows in (self.true, self.est) if len(rows)), default=0)

    def keep(self, mask: Bools) -> Pairs:
        """Returns the pairs where the bool mask (K,) is true."""
        return Pairs(self.true, self.est, self.i[mask], self.j[mask], self.s[mask])

    def require_unique_ids(self) -> None:
        """Raises ValueError if an id occurs twice in one frame on a side."""
        self.true.require_unique_ids("truth")
        self.est.require_unique_ids("tracks")

    @cached_property
    def true_ids(self) -> tuple[Ints, Ints]:
        """The N distinct true ids, ascending (N,), and the index of each true row's id among them (R,)."""
        return numbered(self.true.id)

    @cached_property
    def est_ids(self) -> tuple[Ints, Ints]:
        """The M distinct estimated ids, ascending (M,), and the index of each estimated row's id among them (S,)."""
        return numbered(self.est.id)

    @cached_property
    def links(self) -> tuple[Ints, Ints, Ints]:
        """The U distinct combinations of a true and an estimated id that occur in pairs, sorted, as three arrays.

        They are the index of the combination's true id in `true_ids[0]` (U,), the index of its estimated id in
        `est_ids[0]` (U,), and the index 0 … U - 1 of the combination of each pair (K,).
        """
        width = max(len(self.est_ids[0]), 1)
        key = self.true_ids[1][self.i] * width + self.est_ids[1][self.j]
        distinct, which = numbered(key)
        return distinct // width, distinct % width, which

    def in_frames(self, mask: Bools) -> Pairs:
        """Returns the rows and pairs of the frames f where mask[f] is true, with i and j renumbered."""
        true, est = mask[self.true.frame], mask[self.est.frame]
        kept = true[self.i]
        place_i, place_j = np.cumsum(true) - 1, np.cumsum(est) - 1
        return Pairs(
            self.true.keep(true), self.est.keep(est), place_i[self.i[kept]], place_j[self.j[kept]], self.s[kept]
        )


# Takes row indices i and j (P,) of both sides. Returns the positions (Q,) of the pairs to keep, and their similarities
# (Q,).
PairSimilarity = Callable[[Ints, Ints], tuple[Ints, Array]]


def compare(
    true: FrameRows, est: FrameRows, similarity: PairSimilarity, within: tuple[Array, Array, Array] | None = None
) -> Pairs:
    """Returns the pairs of a true and an estimated row of one frame that a similarity function keeps.

    Both sides are sorted by frame. within = (low, high, at) saves calls of the function: it is called for the pairs
    with low[i] <= at[j] <= high[i], and for a few others. low, high (R,) belong to the true rows, at (S,) to the
    estimated rows. A row with nan in these arrays has no pair. None calls the function for all pairs of a frame.
    """
    found = [(np.zeros(0, np.int64), np.zeros(0, np.int64), np.zeros(0))]
    for i, j in same_frame(true.frame, est.frame) if within is None else _near(true, est, *within):
        kept, s = similarity(i, j)
        found.append((i[kept], j[kept], s))
    return Pairs(true, est, *(np.concatenate(part) for part in zip(*found, strict=True)))


def same_frame(a: Ints, b: Ints) -> Iterator[tuple[Ints, Ints]]:
    """Yields all pairs of equal frame numbers in a and b, in portions: arrays of indices in a and in b, (P,) each. a,
    b: frame numbers; b is sorted."""
    first = np.searchsorted(b, a, side="left")
    return _portions(first, np.searchsorted(b, a, side="right") - first)


def _portions(first: Ints, count: Ints) -> Iterator[tuple[Ints, Ints]]:
    """Yields arrays k, first[k] + n for all k and n in 0 … count[k] - 1, in order, in portions."""
    total = np.concatenate(([0], np.cumsum(count)))
    cuts = [0]
    while cuts[-1] < len(count):
        cuts.append(max(int(np.searchsorted(total, total[cuts[-1]] + CHUNK, side="right")) - 1, cuts[-1] + 1))
    for begin, end in pairwise(cuts):
        n = count[begin:end]
        k = np.repeat(np.arange(begin, end), n)
        yield k, np.arange(len(k)) + np.repeat(first[begin:end] - (total[begin:end] - total[begin]), n)


def _near(a: FrameRows, b: FrameRows, low: Array, high: Array, at: Array) -> Iterator[tuple[Ints, Ints]]:
    """Yields row indices i of a and j of b of equal frame with low[i] <= at[j] <= high[i], and a few others."""
    finite = at[np.isfinite(at)]
    least, most = (float(finite.min()), float(finite.max())) if len(finite) else (0.0, 0.0)
    slack = SLACK * (most - least + 1)
    span = most - least + 3 * slack
    # One axis for all frames: one binary search finds the partners of every row in its own frame. The span between
    # frames exceeds the range of `at`.
    place = b.frame * span + (at - least)
    order = np.argsort(place, kind="stable")
    axis = place[order]
    first = np.searchsorted(axis, a.frame * span + np.maximum(low - least, 0.0) - slack, side="left")
    last = np.searchsorted(axis, a.frame * span + np.minimum(high - least, most - least) + slack, side="right")
    count = np.where(np.isfinite(low + high), np.maximum(last - first, 0), 0)
    return ((i, order[j]) for i, j in _portions(first, count))


def box_pairs(true: FrameRows, est: FrameRows, true_box: Array, est_box: Array) -> Pairs:
    """Returns the pairs of a true and an estimated box of one frame that overlap, with their IoU. true_box (R, 4),
    est_box (S, 4): left, top, width, height in px. A box with nan has no pairs."""
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
    """Returns the pairs of a true and an estimated position of one frame that are closer than `reach`. Their similarity
    is 1 - distance / reach. true_pos (R, 2), est_pos (S, 2) and reach have one unit."""
    ax, ay, bx, by = (np.ascontiguousarray(pos[:, k]) for pos in (true_pos, est_pos) for k in (0, 1))

    def similarity(i: Ints, j: Ints) -> tuple[Ints, Array]:
        dx, dy = ax[i] - bx[j], ay[i] - by[j]
        s = 1 - np.sqrt(dx * dx + dy * dy) / reach
        some = np.flatnonzero(s > EPS)
        return some, s[some]

    return compare(true, est, similarity, (ax - reach, ax + reach, bx))
