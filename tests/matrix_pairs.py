"""Candidate pairs of matrices of similarities, for tests of scores."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tracking.scoring.rows import FrameRows
from tracking.scoring.similarity import EPS, Pairs


def matrix_pairs(
    true_ids: Sequence[NDArray[Any]], est_ids: Sequence[NDArray[Any]], similarity: Sequence[NDArray[Any]]
) -> Pairs:
    """Returns the pairs of similarity above 0 from ids (N,), (M,) and a matrix (N, M) of each frame, from frame 0."""
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
