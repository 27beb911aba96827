"""Where somebody, or some group, was last and will be next: rows looked up by id and time."""

from __future__ import annotations

import numpy as np

from sim.types import Bools
from tracking.scoring.pairs import Rows, numbered


class Lives:
    """Rows by (id, frame). State: the rows in that order, their frames, the ids, and where each of them begins."""

    def __init__(self, rows: Rows, only: Bools | None = None) -> None:
        chosen = np.arange(len(rows)) if only is None else np.flatnonzero(only)
        self.ids, place = numbered(rows.id[chosen])
        order = np.lexsort((rows.frame[chosen], place))
        self.row = chosen[order]
        self.frame = rows.frame[self.row]
        self.cuts = np.searchsorted(place[order], np.arange(len(self.ids) + 1))

    def last(self, id: int, frame: int, reach: int) -> int:
        """The row of the latest frame up to `frame`, at most `reach` before it; -1 if there is none."""
        low, high = self._of(id)
        at = low + int(np.searchsorted(self.frame[low:high], frame, side="right")) - 1
        return int(self.row[at]) if at >= low and frame - self.frame[at] <= reach else -1

    def next(self, id: int, frame: int, reach: int) -> int:
        """The row of the earliest frame from `frame` on, at most `reach` after it; -1 if there is none."""
        low, high = self._of(id)
        at = low + int(np.searchsorted(self.frame[low:high], frame, side="left"))
        return int(self.row[at]) if at < high and self.frame[at] - frame <= reach else -1

    def nearest(self, id: int, frame: int, reach: int) -> int:
        """The row nearest in time, at most `reach` away, the earlier of two; -1 if there is none."""
        low, high = self._of(id)
        if low == high:
            return -1
        away = np.abs(self.frame[low:high] - frame)
        at = int(away.argmin())
        return int(self.row[low + at]) if away[at] <= reach else -1

    def _of(self, id: int) -> tuple[int, int]:
        k = int(np.searchsorted(self.ids, id))
        if k == len(self.ids) or self.ids[k] != id:
            return 0, 0
        return int(self.cuts[k]), int(self.cuts[k + 1])
