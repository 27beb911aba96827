"""The motion of people as rows, one per person and frame: its size is that of what was seen, however long it takes.

Tables of frames by people, (N, K, ...), are made of a few people and frames only, as they are needed.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from sim.types import Array, Bools, Ints


@dataclass(frozen=True, slots=True, eq=False)
class MotionRows:
    """The motion of people as R rows, one per person and frame, sorted by person (column), then frame."""

    frame: Ints  # (R,): from 0
    column: Ints  # (R,): number of the person, from 0
    pos: Array  # (R, 2): m, finite
    vel: Array  # (R, 2): m/s, nan if unknown
    group: Ints  # (R,): group id, -1 = alone
    length: int  # frames T of the sequence
    # round which people walk: (frame, walls (W, 2, 2) m since this frame), from frame 0 on; () without any
    walls: tuple[tuple[int, Array], ...] = ()
    key: Ints = field(init=False)  # (R,): of person and frame, ascending

    def __post_init__(self) -> None:
        object.__setattr__(self, "key", self.column * (self.length + 1) + self.frame)

    @classmethod
    def of(cls, frame: Ints, column: Ints, pos: Array, vel: Array, group: Ints, length: int) -> MotionRows:
        """Returns the rows sorted, without those of unknown position."""
        order = np.lexsort((frame, column))
        order = order[np.isfinite(pos[order]).all(axis=1)]
        return cls(frame[order], column[order], pos[order], vel[order], group[order], length)

    @classmethod
    def of_table(cls, pos: Array, vel: Array, present: Bools, group: Ints) -> MotionRows:
        """Returns the rows of people who are present. pos, vel (T, P, 2); present, group (T, P)."""
        t, p = np.nonzero(present)
        return cls.of(t, p, pos[t, p], vel[t, p], group[t, p], len(pos))

    def find(self, column: Ints | int, frame: Ints | int) -> Ints:
        """Returns the index of the row of each person and frame; where there is none, that of the next row."""
        return np.searchsorted(self.key, column * (self.length + 1) + frame)

    def rows_at(self, columns: Ints, frame: int) -> Ints:
        """Returns the rows of those of some people who are there in a frame."""
        rows = self.find(columns, frame)
        return rows[rows < self.find(columns, frame + 1)]

    def last(self, column: Ints) -> Ints:
        """Returns the last frame of each person."""
        return np.asarray(self.frame[self.find(column, self.length) - 1])

    def count(self, columns: Sequence[int], end: int) -> Ints:
        """Returns how many of some people are there in each frame up to the last of them before frame `end`."""
        frames = [self.frame[int(self.find(p, 0)) : int(self.find(p, end))] for p in columns]
        return np.bincount(np.concatenate(frames))

    def window(self, columns: Sequence[int], first: int, end: int) -> tuple[Array, Array, Ints]:
        """Returns positions, velocities (N, K, 2) and groups (N, K) of K people in the frames first … end - 1; nan
        and -1 where a person is absent."""
        shape = (end - first, len(columns))
        pos, vel, group = np.full((*shape, 2), np.nan), np.full((*shape, 2), np.nan), np.full(shape, -1, np.int64)
        for k, p in enumerate(columns):
            rows = slice(int(self.find(p, first)), int(self.find(p, end)))
            t = self.frame[rows] - first
            pos[t, k], vel[t, k], group[t, k] = self.pos[rows], self.vel[rows], self.group[rows]
        return pos, vel, group


def frames_of_change(frame: Ints, column: Ints, group: Ints, length: int) -> list[int]:
    """Returns the frames from 1 on, below `length`, in which the people, or the group of one, differ from those of the
    frame before. frame, column, group (R,): one row per person and frame."""
    kinds, kind = np.unique(column * (int(group.max(initial=0)) + 2) + group + 1, return_inverse=True)
    key = frame * len(kinds) + kind
    came, went = ~np.isin(key - len(kinds), key), ~np.isin(key + len(kinds), key)
    changed = np.union1d(frame[came], frame[went] + 1)
    return list(changed[(changed > 0) & (changed < length)].tolist())
