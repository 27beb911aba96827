"""Who could be whom: the possible pairs of true and estimated things of each frame, with their similarity.

Everything that scoring matches (boxes, places, groups) goes through `Pairs`: two lists of rows sorted by frame and the
pairs of rows of one frame whose similarity is above 0. Whole sequences are worked on at once; a pair that cannot match
is never stored.
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

EPS = float(np.finfo(float).eps)
CHUNK = 200_000  # pairs compared at once: bounds memory, stays in the cache
SLACK = 1e-6  # of the extent of a frame: more than rounding can move a place on the line of all frames


@dataclass(frozen=True, slots=True)
class Rows:
    """Things in frames, R rows sorted by frame: frame (R,) >= 0, id (R,) any numbers, none twice in one frame."""

    frame: Ints
    id: Ints

    def __len__(self) -> int:
        return len(self.frame)

    def keep(self, mask: Bools | slice) -> Rows:
        """The rows where mask (R,) is true."""
        return Rows(self.frame[mask], self.id[mask])

    def unique(self, side: str) -> None:
        """ValueError where an id is twice in one frame."""
        frame, number = self.frame, numbered(self.id)[1]
        key = np.sort(frame * (int(number.max()) + 1 if len(number) else 1) + number)
        if (key[1:] == key[:-1]).any():
            order = np.lexsort((self.id, frame))
            k = order[1:][(np.diff(frame[order]) == 0) & (np.diff(self.id[order]) == 0)][0]
            raise ValueError(f"{side}: id {self.id[k]} is twice in frame {frame[k]}")


@dataclass(frozen=True)
class Pairs:
    """Possible pairs, K of them sorted by true row (and so by frame).

    true, est: all rows of both sides; i, j (K,): row of each side; s (K,): similarity, 0 < s <= 1.
    """

    true: Rows
    est: Rows
    i: Ints
    j: Ints
    s: Array

    @property
    def frame(self) -> Ints:
        """Frame of each pair (K,)."""
        return self.true.frame[self.i]

    def keep(self, mask: Bools) -> Pairs:
        """The same rows with the pairs where mask (K,) is true."""
        return Pairs(self.true, self.est, self.i[mask], self.j[mask], self.s[mask])

    @cached_property
    def true_ids(self) -> tuple[Ints, Ints]:
        """Distinct true ids, and the place of each row's id among them (R,)."""
        return numbered(self.true.id)

    @cached_property
    def est_ids(self) -> tuple[Ints, Ints]:
        """Distinct estimated ids, and the place of each row's id among them (R,)."""
        return numbered(self.est.id)

    @cached_property
    def links(self) -> tuple[Ints, Ints, Ints]:
        """Distinct (true id, estimated id) of the pairs, as places: (U,), (U,), and which of them each pair is (K,)."""
        width = max(len(self.est_ids[0]), 1)
        key = self.true_ids[1][self.i] * width + self.est_ids[1][self.j]
        distinct, which = numbered(key)
        return distinct // width, distinct % width, which

    def until(self, frame: int) -> Pairs:
        """Only what lies in the frames up to `frame`: views, no copies."""
        n, m = (int(np.searchsorted(rows.frame, frame, side="right")) for rows in (self.true, self.est))
        k = int(np.searchsorted(self.i, n))
        return Pairs(self.true.keep(slice(n)), self.est.keep(slice(m)), self.i[:k], self.j[:k], self.s[:k])

    def in_frames(self, mask: Bools) -> Pairs:
        """Only what lies in the frames f with mask[f] (indexed by frame number)."""
        true, est = mask[self.true.frame], mask[self.est.frame]
        kept = true[self.i]
        place_i, place_j = np.cumsum(true) - 1, np.cumsum(est) - 1
        return Pairs(
            self.true.keep(true), self.est.keep(est), place_i[self.i[kept]], place_j[self.j[kept]], self.s[kept]
        )

    def take(self, frames: Ints) -> Pairs:
        """The frames (F,) one after the other as frames 0 … F - 1, some perhaps more than once."""
        at_true, i, shift_i = _taken(self.true.frame, frames)
        at_est, j, shift_j = _taken(self.est.frame, frames)
        at, k, _ = _taken(self.frame, frames)
        return Pairs(
            Rows(at_true, self.true.id[i]), Rows(at_est, self.est.id[j]),
            self.i[k] + shift_i[at], self.j[k] + shift_j[at], self.s[k],
        )  # fmt: skip


def _taken(frame: Ints, frames: Ints) -> tuple[Ints, Ints, Ints]:
    """Of rows sorted by `frame` those of each of `frames`: place in `frames`, old row, and new row minus old (F,)."""
    first = np.searchsorted(frame, frames, side="left")
    count = np.searchsorted(frame, frames, side="right") - first
    shift = np.cumsum(count) - count - first
    return np.repeat(np.arange(len(frames)), count), np.arange(count.sum()) - np.repeat(shift, count), shift


def numbered(values: Ints) -> tuple[Ints, Ints]:
    """Distinct values in order, and the place of each among them; counted instead of sorted where numbers are small."""
    if len(values) == 0:
        return np.zeros(0, np.int64), np.zeros(0, np.int64)
    low, high = int(values.min()), int(values.max())
    if high - low > 4 * len(values) + 1000:
        distinct, place = np.unique(values, return_inverse=True)
        return distinct, place.astype(np.int64)
    seen = np.zeros(high - low + 1, bool)
    seen[values - low] = True
    place = np.cumsum(seen) - 1
    return np.flatnonzero(seen) + low, place[values - low]


Similarity = Callable[[Ints, Ints], tuple[Ints, Array]]
"""Takes rows (i, j) of both sides; returns which of these pairs are possible, and how similar those are."""


def compare(true: Rows, est: Rows, similarity: Similarity, within: tuple[Array, Array, Array] | None = None) -> Pairs:
    """Pairs by a similarity, asked for all rows of one frame, or for those with low[i] <= at[j] <= high[i] and a few
    more where `within` = (low, high (R,) of the true rows, at (R,) of the estimated ones) is given."""
    found = [(np.zeros(0, np.int64), np.zeros(0, np.int64), np.zeros(0))]
    for i, j in same_frame(true.frame, est.frame) if within is None else _near(true, est, *within):
        kept, s = similarity(i, j)
        found.append((i[kept], j[kept], s))
    return Pairs(true, est, *(np.concatenate(part) for part in zip(*found, strict=True)))


def same_frame(a: Ints, b: Ints) -> Iterator[tuple[Ints, Ints]]:
    """All (row of a, row of b) of equal frame, a and b sorted, in portions of about CHUNK pairs."""
    first = np.searchsorted(b, a, side="left")
    return _portions(first, np.searchsorted(b, a, side="right") - first)


def _portions(first: Ints, count: Ints) -> Iterator[tuple[Ints, Ints]]:
    """(k, first[k] + 0 … count[k] - 1) for all k, in portions of about CHUNK."""
    total = np.concatenate(([0], np.cumsum(count)))
    cuts = [0]
    while cuts[-1] < len(count):
        cuts.append(max(int(np.searchsorted(total, total[cuts[-1]] + CHUNK, side="right")) - 1, cuts[-1] + 1))
    for begin, end in pairwise(cuts):
        n = count[begin:end]
        k = np.repeat(np.arange(begin, end), n)
        yield k, np.arange(len(k)) + np.repeat(first[begin:end] - (total[begin:end] - total[begin]), n)


def _near(a: Rows, b: Rows, low: Array, high: Array, at: Array) -> Iterator[tuple[Ints, Ints]]:
    """Those of same_frame with low[row of a] <= at[row of b] <= high[row of a], and a few more.

    A row with a number that is not finite is near nothing. All frames stand on one line, one after the other, and one
    search finds the rest.
    """
    finite = at[np.isfinite(at)]
    least, most = (float(finite.min()), float(finite.max())) if len(finite) else (0.0, 0.0)
    slack = SLACK * (most - least + 1)
    span = most - least + 3 * slack
    place = b.frame * span + (at - least)
    order = np.argsort(place, kind="stable")
    line = place[order]
    first = np.searchsorted(line, a.frame * span + np.maximum(low - least, 0.0) - slack, side="left")
    last = np.searchsorted(line, a.frame * span + np.minimum(high - least, most - least) + slack, side="right")
    count = np.where(np.isfinite(low + high), np.maximum(last - first, 0), 0)
    return ((i, order[j]) for i, j in _portions(first, count))


def box_pairs(true: Rows, est: Rows, true_box: Array, est_box: Array) -> Pairs:
    """Pairs by intersection over union of boxes (R, 4) left, top, width, height; boxes without area match nothing."""
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


def point_pairs(true: Rows, est: Rows, true_pos: Array, est_pos: Array, reach: float) -> Pairs:
    """Pairs by max(0, 1 - distance / reach) of places (R, 2)."""
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
    """Pairs from one id list per side and one (N, M) similarity matrix per frame (frames count from 0)."""
    true, est = _stack_ids(true_ids), _stack_ids(est_ids)
    flat = np.concatenate([np.zeros(0), *(np.asarray(m, float).ravel() for m in similarity)])
    n, m = (np.array([len(a) for a in ids], np.int64) for ids in (true_ids, est_ids))
    width = np.repeat(m, n)  # pairs that each true row could have
    start = np.cumsum(width) - width
    possible = flat > EPS
    count = np.zeros(len(width), np.int64)
    some = width > 0
    if some.any():
        count[some] = np.add.reduceat(possible, start[some], dtype=np.int64)
    i = np.repeat(np.arange(len(width)), count)
    j = np.flatnonzero(possible) + np.repeat(np.repeat(np.cumsum(m) - m, n) - start, count)
    return Pairs(true, est, i, j, flat[possible])


def _stack_ids(ids: Sequence[NDArray[Any]]) -> Rows:
    count = np.array([len(a) for a in ids], np.int64)
    stacked = np.concatenate([np.zeros(0, np.int64), *(np.asarray(a, np.int64) for a in ids)])
    return Rows(np.repeat(np.arange(len(ids)), count), stacked)
