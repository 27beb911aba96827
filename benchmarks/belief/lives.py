"""How long groups last as they are: a stretch is a time in which exactly the same people are one group.

Gaps of up to 1 s between two frames in which a person is in the same group do not count: somebody is missed.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from sim.types import Array, Ints, Tracks, Truth

MISSED = 1.0  # s: longest gap


def lives_of_truth(truth: Truth) -> Array:
    """Returns the lives of the true groups, s."""
    return lives(truth.frame, truth.id, truth.group, truth.length, truth.fps)


def lives_of_tracks(tracks: Sequence[Tracks], fps: float) -> Array:
    """Returns the lives of the groups of tracked people, s."""
    frame = np.repeat([t.index for t in tracks], [len(t.id) for t in tracks])
    id, group = (np.concatenate([getattr(t, name) for t in tracks]) for name in ("id", "group"))
    return lives(frame, id, group, len(tracks), fps)


def lives(frame: Ints, id: Ints, group: Ints, length: int, fps: float) -> Array:
    """Returns the length of each stretch in which exactly the same two or more people are one group, s.

    frame (from 1), id, group (R,): one row per person and frame, group -1 for people alone. length: frames. A stretch
    that the recording cuts off counts as it is.
    """
    people, column = np.unique(id, return_inverse=True)
    label = np.full((length + 1, len(people)), -1)
    label[frame, column] = group
    index = np.arange(length + 1)[:, None]
    before = np.maximum.accumulate(np.where(label >= 0, index, 0), axis=0)
    after = np.minimum.accumulate(np.where(label >= 0, index, length + 1)[::-1], axis=0)[::-1]
    end = np.minimum(after, length)
    same = np.take_along_axis(label, before, 0) == np.take_along_axis(label, end, 0)
    gap = (after - before - 1 <= MISSED * fps) & (after <= length) & same
    label = np.where(gap, np.take_along_axis(label, before, 0), label)
    begun, found = dict[tuple[int, ...], int](), list[float]()
    for index in range(1, length + 1):
        sets = _sets(label[index])
        found += [(index - begun.pop(members)) / fps for members in [*begun] if members not in sets]
        for members in sets:
            begun.setdefault(members, index)
    return np.array([*found, *((length + 1 - start) / fps for start in begun.values())])


def _sets(label: Ints) -> set[tuple[int, ...]]:
    """Returns the people of each group of two or more; label (P,): group of each person, -1 for none."""
    grouped = np.flatnonzero(label >= 0)
    order = grouped[np.argsort(label[grouped], kind="stable")]
    cuts = np.flatnonzero(np.diff(label[order])) + 1
    return {tuple(part.tolist()) for part in np.split(order, cuts) if len(part) > 1}
