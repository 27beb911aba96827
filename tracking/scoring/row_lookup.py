"""Where somebody, or some group, was last and will be next: rows looked up by id and time."""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from itertools import pairwise

import numpy as np

from sim.types import Bools
from tracking.scoring.similarity import Rows, numbered

NEVER = (0, 0)


class Lives:
    """Rows by (id, frame). State: the rows in that order, their frames, and where those of each id begin and end, as
    lists, since they are looked up one at a time."""

    def __init__(self, rows: Rows, only: Bools | None = None) -> None:
        chosen = np.arange(len(rows)) if only is None else np.flatnonzero(only)
        ids, place = numbered(rows.id[chosen])
        order = np.lexsort((rows.frame[chosen], place))
        chosen = chosen[order]
        self.row: list[int] = chosen.tolist()
        self.frame: list[int] = rows.frame[chosen].tolist()
        cuts = np.searchsorted(place[order], np.arange(len(ids) + 1)).tolist()
        self.life = dict(zip(ids.tolist(), pairwise(cuts), strict=True))

    def last(self, id: int, frame: int, reach: int) -> int:
        """The row of the latest frame up to `frame`, at most `reach` before it; -1 if there is none."""
        low, high = self.life.get(id, NEVER)
        at = bisect_right(self.frame, frame, low, high) - 1
        return self.row[at] if at >= low and frame - self.frame[at] <= reach else -1

    def next(self, id: int, frame: int, reach: int) -> int:
        """The row of the earliest frame from `frame` on, at most `reach` after it; -1 if there is none."""
        low, high = self.life.get(id, NEVER)
        at = bisect_left(self.frame, frame, low, high)
        return self.row[at] if at < high and self.frame[at] - frame <= reach else -1

    def nearest(self, id: int, frame: int, reach: int) -> int:
        """The row nearest in time, at most `reach` away, the earlier of two; -1 if there is none."""
        low, high = self.life.get(id, NEVER)
        at = bisect_left(self.frame, frame, low, high)
        if at > low and (at == high or frame - self.frame[at - 1] <= self.frame[at] - frame):
            at -= 1
        return self.row[at] if at < high and abs(self.frame[at] - frame) <= reach else -1
