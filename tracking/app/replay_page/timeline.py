"""The group timeline of the replay page: the life of each group id as a bar in a lane, and links between bars."""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from sim.types import Array, GroupEvent, Ints


class Bar(NamedTuple):
    """One unbroken life of a group id, a bar of the timeline."""

    id: int
    start: int  # frame, from 1
    end: int  # frame, inclusive
    lane: int  # line of the timeline, from 0
    size: int  # most people in one of its frames, rounded


def bars(frame: Ints, group: Ints, people: Array | None = None) -> list[Bar]:
    """Returns the bars of the timeline, one per unbroken life of a group, sorted by first frame.

    frame, group (R,): of each row. people None: each row is a person, and two or more in a frame are a group. Else each
    row is a whole group, and people (R,) is the estimated number of people in it.
    """
    rows = group >= 0
    pairs, place = np.unique(np.stack([group[rows], frame[rows]], axis=1), axis=0, return_inverse=True)
    count = np.bincount(place.ravel(), None if people is None else people[rows], len(pairs))
    kept = count >= (2 if people is None else 0)
    pairs, count = pairs[kept], count[kept]
    if not len(pairs):
        return []
    new = np.flatnonzero((np.diff(pairs[:, 0]) != 0) | (np.diff(pairs[:, 1]) > 1)) + 1
    lives = zip(np.split(pairs, new), np.split(count, new), strict=True)
    return _in_lanes(sorted((int(p[0, 1]), int(p[-1, 1]), int(p[0, 0]), round(float(n.max()))) for p, n in lives))


def _in_lanes(lives: list[tuple[int, int, int, int]]) -> list[Bar]:
    free_from: list[int] = []
    last: dict[int, int] = {}
    made = []
    for start, end, name, size in lives:
        free = [lane for lane, frame in enumerate(free_from) if frame < start]
        lane = last[name] if last.get(name, -1) in free else (free[0] if free else len(free_from))
        if lane == len(free_from):
            free_from.append(0)
        free_from[lane] = end + 1  # one frame stays empty between two bars of a lane
        last[name] = lane
        made.append(Bar(name, start, end, lane, size))
    return made


def links(events: Iterable[GroupEvent]) -> list[tuple[int, int, int]]:
    """Returns a link for each merge or split and each pair of a group before and another group after it."""
    return [
        (event.start if event.emitted is None else event.emitted, a, b)
        for event in events
        if event.kind in ("merge", "split")
        for a in sorted(set(event.before) - {-1})
        for b in sorted(set(event.after) - {-1})
        if a != b
    ]
