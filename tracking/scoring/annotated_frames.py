"""Which frames of a truth are annotated: all of them, unless its labels are clearly sparse.

Recordings are often labelled in some frames only, as in every 25th frame of a video or in keyframes. The other frames
then say nothing of a tracker. Labels are sparse if nearly all labelled frames stand alone, without a label in the frame
before or after, and

- people are labelled in successive labelled frames, so that they were there in between, too, or
- the labelled frames are evenly spaced, and many.

In frames without people nobody is labelled either. That is told apart: people stay for several frames, so that their
labelled frames do not stand alone.
"""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from sim.types import Bools, GroupEvent, Ints, Tracks, Truth

FEWEST = 5  # Labelled frames below which nothing is clear.
MANY = 8  # Labelled frames that are evenly spaced by chance next to never.
APART = 0.75  # Least share of labelled frames after which a frame without labels follows.
MOST = 0.5  # Least share of the steps between labelled frames that people outlast, or that are the usual one.


@dataclass(frozen=True, eq=False)
class AnnotatedFrames:
    """Which frames of a truth are annotated."""

    frames: Bools  # (length + 1,): bool by frame number, which are annotated; frame 0 never is
    step: int | None = 1  # from one annotated frame to the next, 1 if all are, None if they are not evenly spaced


def annotated_frames(truth: Truth) -> AnnotatedFrames:
    """Returns the annotated frames of a truth: all frames, unless the labels are clearly sparse.

    Sparse labels that are evenly spaced make every step-th frame annotated, with or without labels; other sparse labels
    only the frames that have labels.
    """
    every = np.ones(truth.length + 1, bool)
    every[0] = False
    labelled = _labelled_frames(truth)
    steps = np.diff(labelled)
    if len(labelled) < FEWEST or (steps > 1).mean() < APART:
        return AnnotatedFrames(every)
    step = int(np.gcd.reduce(steps))
    even = step > 1 and (steps == step).mean() >= MOST
    if not (even and len(labelled) >= MANY) and _outlasted(truth, labelled).mean() < MOST:
        return AnnotatedFrames(every)
    if even:
        return AnnotatedFrames(every & (np.arange(truth.length + 1) % step == labelled[0] % step), step)
    return AnnotatedFrames(every & np.isin(np.arange(truth.length + 1), labelled), None)


def _labelled_frames(truth: Truth) -> Ints:
    # Without distractors or regions, such rows may stand between keyframes.
    rest = truth.unscored
    beside = [rest.frame] if rest is not None and (rest.distractor.any() or rest.region is not None) else []
    grouped = [] if truth.labelled is None else [np.flatnonzero(truth.labelled) + 1]
    return np.unique(np.concatenate([truth.frame, *beside, *grouped]))


def _outlasted(truth: Truth, labelled: Ints) -> Bools:
    """Returns for each step between two labelled frames whether a person is labelled in both."""
    order = np.lexsort((truth.frame, truth.id))
    id, turn = truth.id[order], np.searchsorted(labelled, truth.frame[order])
    stays = (id[1:] == id[:-1]) & (turn[1:] == turn[:-1] + 1)
    out = np.zeros(len(labelled) - 1, bool)
    out[turn[:-1][stays]] = True
    return out


def widest_step(inside: Bools) -> int:
    """Returns the greatest number of frames from one scored frame to the next, 1 if there are not two."""
    return int(np.diff(np.flatnonzero(inside)).max(initial=1))


def first_seen(events: Iterable[GroupEvent], inside: Bools) -> list[GroupEvent]:
    """Returns the events with each start moved to the first scored frame at or after it. An event that starts before
    the first scored frame or after the last one is not changed."""
    frames = np.flatnonzero(inside).tolist()

    def moved(event: GroupEvent) -> GroupEvent:
        at = bisect_left(frames, event.start)
        return event if at in (0, len(frames)) else replace(event, start=frames[at])

    return [moved(event) for event in events]


def seen_in(tracks: Sequence[Tracks], inside: Bools) -> list[Tracks]:
    """Returns the `Tracks` of the scored frames, each with all events reported since the previous scored frame. Events
    reported before the first scored frame are dropped."""
    first = int(np.argmax(inside))
    if inside[first:].all():
        return [t for t in tracks if inside[t.index]]
    kept, events = [], list[GroupEvent]()
    for t in tracks:
        events += t.events if t.index >= first else ()
        if inside[t.index]:
            kept.append(t.replace(events=tuple(first_seen(events, inside))))
            events = []
    return kept
