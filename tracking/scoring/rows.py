"""Rows of people or groups of one side (the truth or a tracker), one row per frame and id; lookups of a row by frame
and id."""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from sim.arrays import repeated_ids
from sim.types import Bools, Ints

NO_ROWS = (0, 0)


@dataclass(frozen=True, slots=True)
class FrameRows:
    """R rows of people or groups, one per frame and id, sorted by frame.

    frame (R,): int64, frame number, 0 or more; id (R,): int64. An id should occur once per frame, and frames should be
    sorted. The constructor checks neither; `require_unique_ids` checks the ids.
    """

    frame: Ints
    id: Ints

    def __len__(self) -> int:
        return len(self.frame)

    def keep(self, mask: Bools | slice) -> FrameRows:
        """Returns the rows that a bool mask (R,) or a slice selects, in the same order."""
        return FrameRows(self.frame[mask], self.id[mask])

    def require_unique_ids(self, side: str) -> None:
        """Raises ValueError if an id occurs twice in one frame, else returns None.

        side: "truth" or "tracks", begins the message. The message names the first such frame, and in it the lowest such
        id.
        """
        again = self.keep(repeated_ids(self.frame, self.id))
        if len(again):
            k = np.lexsort((again.id, again.frame))[0]
            raise ValueError(f"{side}: id {again.id[k]} is twice in frame {again.frame[k]}")


def numbered(values: Ints) -> tuple[Ints, Ints]:
    """Returns the U distinct values in ascending order, (U,), and for each of the N values its index among them, (N,)
    int64.

    Equals `numpy.unique(values, return_inverse=True)`, but counts instead of sorting where the range is small. Both are
    empty for N = 0.
    """
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


def find_rows(rows: FrameRows, wanted: FrameRows) -> Ints:
    """Returns for each row of `wanted` the index of the row of `rows` with equal frame and id, -1 if there is none:
    (W,) int64.

    `wanted` need not be sorted. Of equal rows in `rows` the first is found.
    """
    if not len(rows):
        return np.full(len(wanted), -1, np.int64)
    ids, place = numbered(rows.id)
    key = rows.frame * len(ids) + place
    order = np.argsort(key, kind="stable")
    at = np.minimum(np.searchsorted(ids, wanted.id), len(ids) - 1)
    sought = wanted.frame * len(ids) + at
    found = order[np.minimum(np.searchsorted(key[order], sought), len(order) - 1)]
    same = (rows.frame[found] == wanted.frame) & (rows.id[found] == wanted.id)
    return np.where(same, found, -1)


class RowLookup:
    """Finds the row of one id that is last up to a frame, first from a frame on, or nearest to it, by single lookups.

    rows: people or groups in frames; only: bool mask of the rows to find, None for all. State, as Python lists, because
    single lookups in lists are faster than in arrays: row, the row indices sorted by id and frame; frame, their frame
    numbers; span, a dict from id to the range (low, high), high excluded, that it occupies in both lists.
    """

    def __init__(self, rows: FrameRows, only: Bools | None = None) -> None:
        """Indexes all R rows, or those where the bool mask `only` (R,) is true; other rows are never found."""
        chosen = np.arange(len(rows)) if only is None else np.flatnonzero(only)
        ids, place = numbered(rows.id[chosen])
        order = np.lexsort((rows.frame[chosen], place))
        chosen = chosen[order]
        self.row: list[int] = chosen.tolist()
        self.frame: list[int] = rows.frame[chosen].tolist()
        cuts = np.searchsorted(place[order], np.arange(len(ids) + 1)).tolist()
        self.span = dict(zip(ids.tolist(), pairwise(cuts), strict=True))

    def last(self, id: int, frame: int, reach: int) -> int:
        """Returns the index, in the rows given at creation, of the id's row with the latest frame in [frame - reach,
        frame].

        -1 if there is none or the id is unknown. reach: number of frames.
        """
        low, high = self.span.get(id, NO_ROWS)
        at = bisect_right(self.frame, frame, low, high) - 1
        return self.row[at] if at >= low and frame - self.frame[at] <= reach else -1

    def next(self, id: int, frame: int, reach: int) -> int:
        """Returns the index, in the rows given at creation, of the id's row with the earliest frame in [frame, frame +
        reach].

        -1 if there is none or the id is unknown. reach: number of frames.
        """
        low, high = self.span.get(id, NO_ROWS)
        at = bisect_left(self.frame, frame, low, high)
        return self.row[at] if at < high and self.frame[at] - frame <= reach else -1

    def nearest(self, id: int, frame: int, reach: int) -> int:
        """Returns the index, in the rows given at creation, of the id's row nearest to `frame`, at most `reach` frames
        before or after.

        -1 if there is none or the id is unknown. Of two equally near rows the earlier one is returned.
        """
        low, high = self.span.get(id, NO_ROWS)
        at = bisect_left(self.frame, frame, low, high)
        if at > low and (at == high or frame - self.frame[at - 1] <= self.frame[at] - frame):
            at -= 1
        return self.row[at] if at < high and abs(self.frame[at] - frame) <= reach else -1
