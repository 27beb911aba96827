"""Who could be whom: the possible pairs of true and estimated things of each frame, with their similarity.

Everything that scoring matches (boxes, places, groups) goes through `Pairs`: two lists of rows sorted by frame and the
pairs of rows of one frame whose similarity is above 0. Whole sequences are worked on at once; a pair that cannot match
is never stored.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sim.types import Array, Bools, Ints

EPS = float(np.finfo(float).eps)
CHUNK = 400_000  # pairs compared at once: bounds memory, stays in the cache


@dataclass(frozen=True, slots=True)
class Rows:
    """Things in frames, R rows sorted by frame: frame (R,), id (R,) any non-negative or negative numbers."""

    frame: Ints
    id: Ints

    def __len__(self) -> int:
        return len(self.frame)

    def keep(self, mask: Bools) -> Rows:
        """The rows where mask (R,) is true."""
        return Rows(self.frame[mask], self.id[mask])


@dataclass(frozen=True)
class Pairs:
    """Possible pairs, K of them sorted by (frame, true row, estimated row).

    true, est: all rows of both sides; i, j (K,): row of each side; s (K,): similarity, 0 < s <= 1.
    """

    true: Rows
    est: Rows
    i: Ints
    j: Ints
    s: Array

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

    def in_frames(self, mask: Bools) -> Pairs:
        """Only what lies in the frames f with mask[f] (indexed by frame number)."""
        true, est = mask[self.true.frame], mask[self.est.frame]
        kept = true[self.i]
        place_i, place_j = np.cumsum(true) - 1, np.cumsum(est) - 1
        return Pairs(
            self.true.keep(true), self.est.keep(est), place_i[self.i[kept]], place_j[self.j[kept]], self.s[kept]
        )


def numbered(values: Ints) -> tuple[Ints, Ints]:
    """Distinct values in order, and the place of each among them; counting instead of sorting where numbers are small."""
    if len(values) == 0:
        return np.zeros(0, np.int64), np.zeros(0, np.int64)
    low, high = int(values.min()), int(values.max())
    if high - low > 4 * len(values) + 1000:
        distinct, place = np.unique(values, return_inverse=True)
        return distinct, place.astype(np.int64)
    seen = np.bincount(values - low) > 0
    place = np.cumsum(seen) - 1
    return np.flatnonzero(seen) + low, place[values - low]


def same_frame(a: Ints, b: Ints) -> Iterator[tuple[Ints, Ints]]:
    """All (row of a, row of b) of equal frame, a and b sorted, in portions of about CHUNK pairs."""
    low = np.searchsorted(b, a, side="left")
    count = np.searchsorted(b, a, side="right") - low
    total = np.concatenate(([0], np.cumsum(count)))
    cuts = [0]
    while cuts[-1] < len(a):
        cuts.append(max(int(np.searchsorted(total, total[cuts[-1]] + CHUNK, side="right")) - 1, cuts[-1] + 1))
    for first, last in zip(cuts[:-1], cuts[1:], strict=True):
        n = count[first:last]
        i = np.repeat(np.arange(first, last), n)
        start = low[first:last] - (total[first:last] - total[first])
        yield i, np.arange(len(i)) + np.repeat(start, n)


def compare(true: Rows, est: Rows, similarity: Callable[[Ints, Ints], tuple[Ints, Array]]) -> Pairs:
    """Pairs by a function that takes rows (i, j) and returns which of them are possible and how similar those are."""
    found: list[tuple[Ints, Ints, Array]] = []
    for i, j in same_frame(true.frame, est.frame):
        kept, s = similarity(i, j)
        found.append((i[kept], j[kept], s))
    if not found:
        none = np.zeros(0, np.int64)
        return Pairs(true, est, none, none, np.zeros(0))
    return Pairs(true, est, *(np.concatenate(part) for part in zip(*found, strict=True)))


def box_pairs(true: Rows, est: Rows, true_box: Array, est_box: Array) -> Pairs:
    """Pairs by intersection over union of boxes (R, 4) left, top, width, height; boxes without area match nothing."""
    a, b = _edges(true_box), _edges(est_box)
    area_a, area_b = (np.maximum(box[:, 2], 0) * np.maximum(box[:, 3], 0) for box in (true_box, est_box))

    def similarity(i: Ints, j: Ints) -> tuple[Ints, Array]:
        near = np.flatnonzero((a[0][i] < b[2][j]) & (b[0][j] < a[2][i]))
        i, j = i[near], j[near]
        width = np.minimum(a[2][i], b[2][j]) - np.maximum(a[0][i], b[0][j])
        height = np.minimum(a[3][i], b[3][j]) - np.maximum(a[1][i], b[1][j])
        common = width * np.maximum(height, 0)
        union = area_a[i] + area_b[j] - common
        some = common > EPS * np.maximum(union, EPS)
        return near[some], common[some] / union[some]

    return compare(true, est, similarity)


def _edges(box: Array) -> tuple[Array, Array, Array, Array]:
    return box[:, 0].copy(), box[:, 1].copy(), box[:, 0] + box[:, 2], box[:, 1] + box[:, 3]


def point_pairs(true: Rows, est: Rows, true_pos: Array, est_pos: Array, reach: float) -> Pairs:
    """Pairs by max(0, 1 - distance / reach) of places (R, 2)."""
    ax, ay, bx, by = (np.ascontiguousarray(pos[:, k]) for pos in (true_pos, est_pos) for k in (0, 1))

    def similarity(i: Ints, j: Ints) -> tuple[Ints, Array]:
        dx = ax[i] - bx[j]
        near = np.flatnonzero(np.abs(dx) < reach)
        s = 1 - np.hypot(dx[near], ay[i[near]] - by[j[near]]) / reach
        some = s > EPS
        return near[some], s[some]

    return compare(true, est, similarity)


def matrix_pairs(
    true_ids: Sequence[NDArray[Any]], est_ids: Sequence[NDArray[Any]], similarity: Sequence[NDArray[Any]]
) -> Pairs:
    """Pairs from one id list per side and one (N, M) similarity matrix per frame (frames count from 0)."""
    true, est = _stack_ids(true_ids), _stack_ids(est_ids)
    if not similarity:
        none = np.zeros(0, np.int64)
        return Pairs(true, est, none, none, np.zeros(0))
    flat = np.concatenate([np.asarray(m, float).ravel() for m in similarity])
    found = np.flatnonzero(flat > EPS)
    shapes = np.array([(len(a), len(b)) for a, b in zip(true_ids, est_ids, strict=True)], np.int64)
    ends = np.cumsum(shapes.prod(axis=1))
    frame = np.searchsorted(ends, found, side="right")
    first = np.cumsum(shapes, axis=0) - shapes
    local = found - (ends - shapes.prod(axis=1))[frame]
    i, j = np.divmod(local, shapes[frame, 1])
    return Pairs(true, est, i + first[frame, 0], j + first[frame, 1], flat[found])


def _stack_ids(ids: Sequence[NDArray[Any]]) -> Rows:
    count = np.array([len(a) for a in ids], np.int64)
    stacked = np.concatenate([np.asarray(a, np.int64) for a in ids]) if len(ids) else np.zeros(0, np.int64)
    return Rows(np.repeat(np.arange(len(ids)), count), stacked)
