"""Rows of people or groups of one side (the truth or a tracker), one per frame and id; look-ups of a row by both."""

from __future__ import annotations

from bisect import bisect_left
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from sim.arrays import repeated_ids
from sim.types import Bools, Ints


@dataclass(frozen=True, slots=True)
class FrameRows:
    """R rows of people or groups, one per frame and id, sorted by frame."""

    frame: Ints  # (R,): int64, frame number, 0 or more
    id: Ints  # (R,): int64, once in a frame; not checked here, but by `require_unique_ids`

    def __len__(self) -> int:
        return len(self.frame)

    def keep(self, mask: Bools | slice) -> FrameRows:
        """Returns the rows that a bool mask (R,) or a slice selects, in the same order."""
        return FrameRows(self.frame[mask], self.id[mask])

    def require_unique_ids(self, side: str) -> None:
        """Raises ValueError if an id occurs twice in one frame; the message begins with `side`."""
        again = self.keep(repeated_ids(self.frame, self.id))
        if len(again):
            k = np.lexsort((again.id, again.frame))[0]
            raise ValueError(f"{side}: id {again.id[k]} is twice in frame {again.frame[k]}")


def span(frame: Ints, frames: Bools) -> slice:
    """Returns which rows, sorted by frame number (R,), lie between the first and the last frame f where frames[f] is
    true; no row if there is none."""
    inside = np.flatnonzero(frames)
    if not len(inside):
        return slice(0, 0)
    return slice(*np.searchsorted(frame, (inside[0], inside[-1] + 1)).tolist())


def numbered(values: Ints) -> tuple[Ints, Ints]:
    """Returns the distinct values, ascending, and the index of each value among them. The result is that of
    `numpy.unique(values, return_inverse=True)`. Where the range of values is small, counting replaces sorting."""
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
    """Returns the index of the first row of `rows` with the frame and id of each row of `wanted`, -1 none, (W,)."""
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
    """Finds the row of one id that is nearest to a frame.

    `only`, a bool mask of the rows, limits the search; None searches all rows. State: row, the row indices sorted by id
    and frame; frame, the frame number of each; span, by id, start and end of its part of both lists.
    """

    def __init__(self, rows: FrameRows, only: Bools | None = None) -> None:
        chosen = np.arange(len(rows)) if only is None else np.flatnonzero(only)
        ids, place = numbered(rows.id[chosen])
        order = np.lexsort((rows.frame[chosen], place))
        chosen = chosen[order]
        self.row: list[int] = chosen.tolist()
        self.frame: list[int] = rows.frame[chosen].tolist()
        cuts = np.searchsorted(place[order], np.arange(len(ids) + 1)).tolist()
        self.span = dict(zip(ids.tolist(), pairwise(cuts), strict=True))

    def nearest(self, id: int, frame: int, back: int, ahead: int) -> int:
        """Returns the index of the id's row nearest to `frame`, if it lies in [frame - back, frame + ahead], else -1.
        Of two rows equally near, the earlier one is returned."""
        low, high = self.span.get(id, (0, 0))
        at = bisect_left(self.frame, frame, low, high)
        near = [k for k in (at - 1, at) if low <= k < high and -back <= self.frame[k] - frame <= ahead]
        return self.row[min(near, key=lambda k: abs(self.frame[k] - frame))] if near else -1
