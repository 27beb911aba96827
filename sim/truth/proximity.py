"""Who is near whom, over a whole sequence at once, and stretches of time that pairs have in common."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from sim.truth.merge_split_rules import HOLD_TIME, MERGE_DISTANCE, MERGE_VELOCITY, frames_of
from sim.types import Array, Bools, Ints, Near

CHUNK = 200_000  # people times frames looked at together: bounds memory


def close_pairs(frame: Ints, pos: Array, reach: float) -> tuple[Ints, Ints]:
    """All pairs of rows i < j of one frame that are nearer than `reach`; frame (R,) sorted, pos (R, 2)."""
    found = [_pairs_of(frame, pos, low, high, reach) for low, high in _portions(frame)]
    i, j = (np.concatenate([np.zeros(0, np.int64), *(f[k] for f in found)]) for k in (0, 1))
    order = np.lexsort((j, i))
    return i[order], j[order]


def _portions(frame: Ints) -> Iterator[tuple[int, int]]:
    """Slices of whole frames with about CHUNK rows each."""
    low = 0
    while low < len(frame):
        high = int(np.searchsorted(frame, frame[min(low + CHUNK, len(frame)) - 1], side="right"))
        yield low, high
        low = high


def _pairs_of(frame: Ints, pos: Array, low: int, high: int, reach: float) -> tuple[Ints, Ints]:
    """Rows are sorted by (frame, column, row) of a grid of `reach`; a neighbour is in one of two runs behind a row."""
    f, p = frame[low:high] - frame[low], pos[low:high]
    cell = np.floor((p - p.min(axis=0)) / reach).astype(np.int64) + 1
    rows, columns = int(cell[:, 1].max()) + 2, int(cell[:, 0].max()) + 2
    key = (f * columns + cell[:, 0]) * rows + cell[:, 1]
    order = np.argsort(key, kind="stable")
    key = key[order]
    here = np.arange(len(key))
    i1, j1 = runs(here + 1, np.searchsorted(key, key + 1, side="right"))
    i2, j2 = runs(np.searchsorted(key, key + rows - 1), np.searchsorted(key, key + rows + 1, side="right"))
    i, j = order[np.concatenate([i1, i2])], order[np.concatenate([j1, j2])]
    near = ((p[i] - p[j]) ** 2).sum(axis=1) < reach**2
    i, j = i[near] + low, j[near] + low
    return np.minimum(i, j), np.maximum(i, j)


def runs(first: Ints, end: Ints) -> tuple[Ints, Ints]:
    """For each row k the pairs (k, first[k]) … (k, end[k] - 1)."""
    n = np.maximum(end - first, 0)
    i = np.repeat(np.arange(len(n)), n)
    return i, np.arange(len(i)) - np.repeat(np.cumsum(n) - n, n) + first[i]


def stretches(pair: Ints, frame: Ints, least: int, bridge: int = 1) -> tuple[Ints, Ints, Ints]:
    """(pair, first, last) of each run of `least` or more frames, no more than `bridge` from one to the next.

    Rows (K,) sorted by (pair, frame).
    """
    if not len(pair):
        return pair, frame, frame
    new = np.concatenate([[True], (np.diff(pair) != 0) | (np.diff(frame) > bridge)])
    start = np.flatnonzero(new)
    end = np.append(start[1:], len(pair)) - 1
    long = frame[end] - frame[start] + 1 >= least
    return pair[start[long]], frame[start[long]], frame[end[long]]


def strangers(pos: Array, vel: Array, present: Bools, intent: Ints, group: Ints, fps: float) -> Near:
    """Hard negatives: stretches in which two people satisfy the merge rule though they do not belong together.

    Arrays (T, P, …); who are still in one group (it has not yet split) are no strangers. Person ids are column + 1.
    """
    t, p = np.nonzero(present)
    i, j = close_pairs(t, pos[t, p], MERGE_DISTANCE)
    t, a, b = t[i], p[i], p[j]
    differ = np.hypot(*(vel[t, a] - vel[t, b]).T)
    same_group = (group[t, a] >= 0) & (group[t, a] == group[t, b])
    kept = (differ < MERGE_VELOCITY) & (intent[t, a] != intent[t, b]) & ~same_group
    t, a, b = t[kept], a[kept], b[kept]
    pair = a * present.shape[1] + b
    order = np.lexsort((t, pair))
    pair, first, last = stretches(pair[order], t[order], frames_of(HOLD_TIME, fps))
    order = np.lexsort((pair, first))
    pair, first, last = pair[order], first[order], last[order]
    return Near(first + 1, last + 1, pair // present.shape[1] + 1, pair % present.shape[1] + 1)
