"""Encodes columns of the replay page as short lists of whole numbers, so that long recordings stay small."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from sim.types import Ints

NIL = -99_999
"""Stands for an unknown number (nan) in a column."""

Json = dict[str, Any]
"""An object that `json` can write."""


def deltas(column: NDArray[np.float64]) -> list[int]:
    """Returns the rounded column (N,) as its first value and the steps; nan and infinity are -99999."""
    whole = np.where(np.isfinite(column), np.rint(column), NIL).astype(np.int64)
    listed: list[int] = np.diff(whole, prepend=0).tolist()
    return listed


def run_lengths(column: Ints) -> list[int]:
    """Returns the column (N,) as value, count, value, count, … of its runs of equal values; [] for an empty column."""
    if not len(column):
        return []
    first = np.flatnonzero(np.r_[True, np.diff(column) != 0])
    listed: list[int] = np.stack([column[first], np.diff(np.r_[first, len(column)])], axis=1).ravel().tolist()
    return listed


def stints(ids: Ints, frame: Ints) -> list[list[int]]:
    """Returns [id, first frame, number of frames] of each stint: one id in consecutive frames. [] without rows."""
    if not len(ids):
        return []
    first = np.flatnonzero(np.r_[True, (np.diff(ids) != 0) | (np.diff(frame) != 1)])
    length = np.diff(np.r_[first, len(ids)])
    table: list[list[int]] = np.stack([ids[first], frame[first], length], axis=1).tolist()
    return table
