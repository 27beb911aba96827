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
    """Returns the numbers, from 1, of `count` frames in ascending order; at least one if there is one, every frame if
    there are no more.

    First frames of events are taken in order of rank: merge and split, cross and queue, form and dissolve. Those at
    most a second from a frame taken before are left out. If there are more of one rank than there is room for, they are
    thinned evenly. The widest gaps are then divided until `count` is reached, with preference for frames with many
    people. A truth of length 0 has no frames.
    """
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
    """Returns, ascending, the starts (frame numbers) that are more than a second from each chosen frame and each
    earlier start that was kept.

    fps: frames per second. The arguments are not changed.
    """
    kept: list[int] = []
    for start in sorted(starts):
        if not any(is_close(start, other, fps) for other in (*chosen, *kept)):
            kept.append(start)
    return kept


def _evenly(n: int, k: int) -> list[int]:
    """Returns k of the indices 0 to n - 1, evenly spaced, ends included; [0] for k = 1, [] for k = 0. k must not exceed
    n."""
    return [round(place) for place in np.linspace(0, n - 1, k)] if k > 1 else [0][:k]


def _in_widest_gap(chosen: list[int], people: Ints) -> int:
    """Returns the frame, from 1, with most people in the middle half of the widest gap between chosen frames.

    Of several, the nearest to the gap's middle, then the earliest. people: (T,) counts by frame. Both ends of the
    sequence count as an eighth of its length further out, so that frames near the ends are chosen, too. A gap without
    room is passed over for the next widest; if none has room, the first frame that is not chosen. StopIteration if all
    are.
    """
    length = len(people)
    marks = np.array([1 - length // 8, *sorted(chosen), length + length // 8])
    for k in np.argsort(-np.diff(marks), kind="stable"):
        low, high = marks[k], marks[k + 1]
        quarter = (high - low) // 4
        inner = np.arange(max(low + quarter, low + 1, 1), min(high - quarter, high - 1, length) + 1)
        if len(inner):
            order = np.lexsort((np.abs(inner - (low + high) / 2), -people[inner - 1]))
            return int(inner[order[0]])
    return next(index for index in range(1, length + 1) if index not in chosen)
