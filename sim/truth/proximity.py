"""Searches for people near each other in a motion (positions and velocities of people in frames).

Finds pairs of people closer than a distance, stretches of frames in which a condition holds for a pair, and strangers:
pairs who satisfy the merge rule (less than 1.5 m apart, velocities differing by less than 0.5 m/s, for 2 s) but do not
belong to one group (hard negatives).
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from sim.elementary import dot, length
from sim.truth.merge_split_rules import HOLD_TIME, MERGE_DISTANCE, MERGE_VELOCITY, frames_of
from sim.types import Array, Bools, Ints, Near

CHUNK = 200_000  # rows handled together: bounds memory


def close_pairs(frame: Ints, pos: Array, reach: float) -> tuple[Ints, Ints]:
    """Returns all pairs of rows i < j of the same frame that are less than `reach` apart, sorted, (K,) each.

    frame (R,): ascending. pos (R, 2): finite.
    """
    found = [_pairs_of(frame, pos, low, high, reach) for low, high in _portions(frame)]
    i, j = (np.concatenate([np.zeros(0, np.int64), *(f[k] for f in found)]) for k in (0, 1))
    order = np.lexsort((j, i))
    return i[order], j[order]


def _portions(frame: Ints) -> Iterator[tuple[int, int]]:
    """Yields half-open ranges of rows that hold whole frames, of about CHUNK rows."""
    low = 0
    while low < len(frame):
        high = int(np.searchsorted(frame, frame[min(low + CHUNK, len(frame)) - 1], side="right"))
        yield low, high
        low = high


def _pairs_of(frame: Ints, pos: Array, low: int, high: int, reach: float) -> tuple[Ints, Ints]:
    # Sorted by frame and by the cells of a grid as wide as `reach`, all neighbours of a row lie in two runs of rows
    # behind it.
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
    apart = p[i] - p[j]
    close = dot(apart, apart) < reach * reach
    i, j = i[close] + low, j[close] + low
    return np.minimum(i, j), np.maximum(i, j)


def runs(first: Ints, end: Ints) -> tuple[Ints, Ints]:
    """Returns all pairs (k, first[k]), (k, first[k] + 1) … (k, end[k] - 1) for k = 0, 1, …, as two arrays."""
    n = np.maximum(end - first, 0)
    i = np.repeat(np.arange(len(n)), n)
    return i, np.arange(len(i)) - np.repeat(np.cumsum(n) - n, n) + first[i]


def stretches(pair: Ints, frame: Ints, least: int, bridge: int = 1) -> tuple[Ints, Ints, Ints]:
    """Returns (pair, first frame, last frame) of each stretch of at least `least` frames, (S,) each, sorted.

    pair, frame (K,): rows sorted by (pair, frame). Frames of a stretch are at most `bridge` apart.
    """
    if not len(pair):
        return pair, frame, frame
    new = np.concatenate([[True], (np.diff(pair) != 0) | (np.diff(frame) > bridge)])
    start = np.flatnonzero(new)
    end = np.append(start[1:], len(pair)) - 1
    long = frame[end] - frame[start] + 1 >= least
    return pair[start[long]], frame[start[long]], frame[end[long]]


def strangers(pos: Array, vel: Array, present: Bools, intent: Ints, group: Ints, fps: float) -> Near:
    """Returns the stretches in which two people satisfy the merge rule but do not belong together.

    pos, vel (T, P, 2): m, m/s. present (T, P). intent (T, P): must differ. group (T, P): measured, -1 = alone.
    """
    t, p = np.nonzero(present)
    i, j = close_pairs(t, pos[t, p], MERGE_DISTANCE)
    t, a, b = t[i], p[i], p[j]
    differ = length(vel[t, a] - vel[t, b])
    # Two people of one group that has not split yet are no strangers.
    same_group = (group[t, a] >= 0) & (group[t, a] == group[t, b])
    kept = (differ < MERGE_VELOCITY) & (intent[t, a] != intent[t, b]) & ~same_group
    t, a, b = t[kept], a[kept], b[kept]
    pair = a * present.shape[1] + b
    order = np.lexsort((t, pair))
    pair, first, last = stretches(pair[order], t[order], frames_of(HOLD_TIME, fps))
    order = np.lexsort((pair, first))
    pair, first, last = pair[order], first[order], last[order]
    return Near(first + 1, last + 1, pair // present.shape[1] + 1, pair % present.shape[1] + 1)
