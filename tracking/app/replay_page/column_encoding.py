"""Columns of the replay page: whole numbers as differences from row to row, ids and flags as run lengths."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sim.types import Ints

NIL = -99_999
"""Stands for an unknown number in a column."""


def deltas(column: NDArray[np.float64]) -> list[int]:
    """A column rounded and differenced; nan becomes NIL."""
    whole = np.where(np.isfinite(column), np.rint(column), NIL).astype(np.int64)
    listed: list[int] = np.diff(whole, prepend=0).tolist()
    return listed


def run_lengths(column: Ints) -> list[int]:
    """value, count, value, count, …"""
    if not len(column):
        return []
    first = np.flatnonzero(np.r_[True, np.diff(column) != 0])
    listed: list[int] = np.stack([column[first], np.diff(np.r_[first, len(column)])], axis=1).ravel().tolist()
    return listed


def stints(ids: Ints, frame: Ints) -> list[list[int]]:
    """[id, first frame, frames] of each stint of sorted rows."""
    if not len(ids):
        return []
    first = np.flatnonzero(np.r_[True, (np.diff(ids) != 0) | (np.diff(frame) != 1)])
    length = np.diff(np.r_[first, len(ids)])
    table: list[list[int]] = np.stack([ids[first], frame[first], length], axis=1).tolist()
    return table
