"""People who walk in twos and alone, as tables of tracks, and the evidence about them."""

from __future__ import annotations

import numpy as np

from tracking.grouping.belief import default_belief
from tracking.grouping.explained_pairs import ExplainedPairs, explain
from tracking.grouping.tracks_table import TracksTable


def walking(seed: int, people: int = 12, frames: int = 60, gap: float | tuple[float, ...] = 0.7):
    """Frame (from 0), id and position of people: 10 and 11, 12 and 13, … walk beside each other, `gap` m apart, of
    several the pairs in turn."""
    r = np.random.default_rng(seed)
    start, speed = r.uniform(0, 12, (people // 2 + 1, 2)), r.normal(0, 0.9, (people // 2 + 1, 2))
    pair = np.arange(people) // 2
    wide = np.resize(gap, people // 2 + 1)[pair] * (np.arange(people) % 2)
    place = start[pair] + np.column_stack([wide, np.zeros(people)])
    pos = place + np.arange(frames)[:, None, None] * speed[pair] / 2.5 + r.normal(0, 0.02, (frames, people, 2))
    frame, column = np.divmod(np.arange(frames * people), max(people, 1))
    return frame, column + 10, pos.reshape(-1, 2)


def table_of(walk, seen=None) -> TracksTable:
    frame, id, pos = walk
    ids, column = np.unique(id, return_inverse=True)
    nothing = np.full(len(frame), -1)
    length = int(frame.max(initial=0)) + 1
    return TracksTable(frame, id, column, ids, pos, np.full_like(pos, np.nan), nothing, length, 1.0, seen)


def evidence_of(seed: int, **more) -> ExplainedPairs:
    return explain(table_of(walking(seed, **more)), 2.5, default_belief())
