"""The group timeline of the replay page: the life of each group id as a bar in a lane, and links between bars."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from sim.types import Array, GroupEvent, Ints


@dataclass(frozen=True)
class Bar:
    """One unbroken life of a group id, a bar of the timeline."""

    id: int
    start: int  # frame, from 1
    end: int  # frame, inclusive
    lane: int  # line of the timeline, from 0
    size: int  # most people in one of its frames, rounded


@dataclass(frozen=True)
class Link:
    """Group `a` becomes or joins group `b`, a link between their bars; both are ids."""

    frame: int  # when a tracker reported it; of truth the event's first frame
    a: int
    b: int


def bars(frame: Ints, group: Ints, least: int = 2, gap: int = 1, people: Array | None = None) -> list[Bar]:
    """Returns the bars, unbroken lives, of the groups in rows of (frame, group), (R,) each, sorted by first frame."""
    rows = group >= 0
    pairs, place = np.unique(np.stack([group[rows], frame[rows]], axis=1), axis=0, return_inverse=True)
    count = np.bincount(place.ravel(), None if people is None else people[rows], len(pairs))
    pairs, count = pairs[count >= least], count[count >= least]
    if not len(pairs):
        return []
    new = np.flatnonzero((np.diff(pairs[:, 0]) != 0) | (np.diff(pairs[:, 1]) > gap)) + 1
    lives = zip(np.split(pairs, new), np.split(count, new), strict=True)
    found = [(int(p[0, 1]), int(p[-1, 1]), int(p[0, 0]), round(float(n.max()))) for p, n in lives]
    return _in_lanes(sorted(found))


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


def links(events: Iterable[GroupEvent]) -> list[Link]:
    """Returns a link for each pair of different groups before and after a merge or split."""
    return [
        Link(event.start if event.emitted is None else event.emitted, a, b)
        for event in events
        if event.kind in ("merge", "split")
        for a in sorted(set(event.before) - {-1})
        for b in sorted(set(event.after) - {-1})
        if a != b
    ]
