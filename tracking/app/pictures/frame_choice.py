"""Chooses the frames that a contact sheet shows: the beginnings of events first, then frames that fill the gaps."""

from __future__ import annotations

import numpy as np

from sim.types import Ints, Truth

SHOWN_KINDS = {"merge": 0, "split": 0, "cross": 1, "queue": 1, "form": 2, "dissolve": 2}
"""Kinds of events that are shown, with their rank; events of rank 0 come first. Enter and leave are not shown."""

CLOSE_SECONDS = 1.0
"""s: events that begin within this time share a picture."""


def is_close(frame: int, other: int, fps: float) -> bool:
    """Returns True if two frames, given by number, are at most one second apart. fps: frames per second."""
    return abs(frame - other) <= CLOSE_SECONDS * fps


def choose_frames(truth: Truth, count: int) -> list[int]:
    """Returns the numbers, from 1, of `count` frames in ascending order."""
    count = min(max(1, count), truth.length)
    chosen: list[int] = []
    events = [event for event in truth.events or () if 1 <= event.start <= truth.length and event.kind in SHOWN_KINDS]
    for rank in sorted(set(SHOWN_KINDS.values())):
        starts = _apart({event.start for event in events if SHOWN_KINDS[event.kind] == rank}, chosen, truth.fps)
        room = count - len(chosen)
        chosen += starts if len(starts) <= room else [starts[k] for k in _evenly(len(starts), room)]
    people = np.bincount(truth.frame, minlength=truth.length + 1)[1 : truth.length + 1]
    while len(chosen) < count:
        chosen.append(_in_widest_gap(chosen, people))
    return sorted(chosen)


def _apart(starts: set[int], chosen: list[int], fps: float) -> list[int]:
    kept: list[int] = []
    for start in sorted(starts):
        if not any(is_close(start, other, fps) for other in (*chosen, *kept)):
            kept.append(start)
    return kept


def _evenly(n: int, k: int) -> list[int]:
    return [round(place) for place in np.linspace(0, n - 1, k)] if k > 1 else [0][:k]


def _in_widest_gap(chosen: list[int], people: Ints) -> int:
    length = len(people)
    # The ends count as an eighth of the length further out, so that frames near them are chosen, too.
    marks = np.array([1 - length // 8, *sorted(chosen), length + length // 8])
    for k in np.argsort(-np.diff(marks), kind="stable"):
        low, high = marks[k], marks[k + 1]
        quarter = (high - low) // 4
        inner = np.arange(max(low + quarter, low + 1, 1), min(high - quarter, high - 1, length) + 1)
        if len(inner):
            order = np.lexsort((np.abs(inner - (low + high) / 2), -people[inner - 1]))
            return int(inner[order[0]])
    return next(index for index in range(1, length + 1) if index not in chosen)
