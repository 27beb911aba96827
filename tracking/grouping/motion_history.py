"""The motion of tracked people up to now: rows that are added frame by frame, for as far back as they are needed."""

from __future__ import annotations

from collections.abc import Sequence, Set
from dataclasses import dataclass, field, replace

import numpy as np

from sim.truth.motion_rows import MotionRows
from sim.types import Array, Bools, Ints


@dataclass(frozen=True, slots=True, eq=False)
class PeopleRows:
    """R rows of tracked people in some frames, one per person and frame, sorted by frame, then id; lengths in m."""

    frame: Ints  # (R,): from 0
    id: Ints  # (R,): of the track
    pos: Array
    vel: Array  # (R, 2): m/s, nan if unknown
    group: Ints  # (R,): group id, -1 for a person alone
    seen: Bools  # (R,): False where a person is reported by prediction only

    @classmethod
    def none(cls) -> PeopleRows:
        """Returns no rows."""
        whole, place = np.zeros(0, np.int64), np.zeros((0, 2))
        return cls(whole, whole, place, place, whole, np.zeros(0, bool))

    def take(self, rows: Ints | Bools) -> PeopleRows:
        """Returns some of the rows."""
        some = self.frame[rows], self.id[rows], self.pos[rows], self.vel[rows], self.group[rows]
        return PeopleRows(*some, self.seen[rows])

    def joined(self, more: PeopleRows) -> PeopleRows:
        """Returns these rows followed by rows of later frames."""
        frame, id, group = (np.append(getattr(self, k), getattr(more, k)) for k in ("frame", "id", "group"))
        pos, vel = (np.concatenate([getattr(self, k), getattr(more, k)]) for k in ("pos", "vel"))
        return PeopleRows(frame, id, pos, vel, group, np.append(self.seen, more.seen))


@dataclass(frozen=True, slots=True, eq=False)
class _Part:
    rows: PeopleRows
    ids: Ints  # (K,): sorted, of all people of the part
    first: int  # its frames: from `first` to before `end`
    end: int
    motion: MotionRows  # columns: rows of `ids`; frames as in `rows`
    order: Ints  # (R,): the row of `rows` of each row of `motion`

    @property
    def seen(self) -> Bools:
        """Flags (R,) of the rows of `motion`."""
        return self.rows.seen[self.order]

    @classmethod
    def of(cls, rows: PeopleRows, first: int, end: int) -> _Part:
        ids, column = np.unique(rows.id, return_inverse=True)
        order = np.lexsort((rows.frame, column))
        order = order[np.isfinite(rows.pos[order]).all(axis=1)]
        some = rows.take(order)
        motion = MotionRows(some.frame, column[order], some.pos, some.vel, some.group, end)
        return cls(rows, ids, first, end, motion, order)

    def labelled(self, group: Ints) -> _Part:
        """Returns the part with other group ids (R,) of its last rows."""
        group = np.append(self.rows.group[: len(self.rows.group) - len(group)], group)
        motion = replace(self.motion, group=group[self.order])
        return replace(self, rows=replace(self.rows, group=group), motion=motion)

    def columns(self, people: Sequence[int]) -> list[int]:
        """Returns the columns of people by id, -1 for whoever is not there."""
        place = np.searchsorted(self.ids, people)
        return [int(k) if k < len(self.ids) and self.ids[k] == p else -1 for k, p in zip(place, people, strict=True)]


@dataclass(eq=False)
class MotionHistory:
    """The rows of people up to now, by frame. State: parts, one after another, each longer than the next; measured, ids
    of people who have been measured; first, the first frame that is remembered; end, number of frames."""

    parts: list[_Part] = field(default_factory=list)
    measured: set[int] = field(default_factory=set)
    first: int = 0
    end: int = 0

    def add(self, rows: PeopleRows, end: int) -> None:
        """Adds the rows of the frames up to `end`, and marks in them who has not been measured yet as measured: their
        motion is all that is known of them."""
        # people who are measured from some frame on, or never, count as measured before
        ids, first = np.unique(rows.id[rows.seen], return_index=True)
        begins = dict(zip(ids.tolist(), rows.frame[rows.seen][first].tolist(), strict=True))
        unknown = ~rows.seen
        if unknown.any():
            early = [
                p not in self.measured and f < begins.get(p, end)
                for p, f in zip(rows.id[unknown].tolist(), rows.frame[unknown].tolist(), strict=True)
            ]
            seen = rows.seen.copy()
            seen[unknown] = early
            rows = replace(rows, seen=seen)
        self.measured |= begins.keys()
        part = _Part.of(rows, self.end, end)
        # parts are joined so that there are few of them, and each row is copied a few times only
        while self.parts and part.end - part.first >= self.parts[-1].end - self.parts[-1].first:
            before = self.parts.pop()
            part = _Part.of(before.rows.joined(part.rows), before.first, end)
        self.parts.append(part)
        self.end = end

    def label(self, group: Ints) -> None:
        """Sets the group ids (R,) of the rows that were added last."""
        self.parts[-1] = self.parts[-1].labelled(group)

    def forget(self, before: int, people: Set[int]) -> None:
        """Forgets the frames before `before`, and that anybody but `people`, ids, has been measured."""
        self.first, self.parts = before, [part for part in self.parts if part.end > before]
        self.measured &= people

    def window(self, people: Sequence[int], first: int, end: int) -> tuple[Array, Array, Ints]:
        """Returns positions, velocities (N, K, 2) and groups (N, K) of K people, by id, in the frames first … end - 1;
        nan and -1 where a person is absent."""
        shape = (end - first, len(people))
        pos, vel, group = np.full((*shape, 2), np.nan), np.full((*shape, 2), np.nan), np.full(shape, -1, np.int64)
        for part in self.parts:
            low, high = max(first, part.first, self.first), min(end, part.end)
            if low >= high:
                continue
            for k, column in enumerate(part.columns(people)):
                if column >= 0:
                    rows = slice(*(int(x) for x in part.motion.find(column, np.array([low, high]))))
                    t = part.motion.frame[rows] - first
                    pos[t, k], vel[t, k] = part.motion.pos[rows], part.motion.vel[rows]
                    group[t, k] = part.motion.group[rows]
        return pos, vel, group

    def measured_count(self, people: Sequence[int], first: int, end: int) -> Ints:
        """Returns how many of some people, ids, are measured in each of the frames first … end - 1."""
        out = np.zeros(end - first, np.int64)
        for part in self.parts:
            low, high = max(first, part.first, self.first), min(end, part.end)
            for column in part.columns(people) if low < high else ():
                if column >= 0:
                    rows = slice(*(int(x) for x in part.motion.find(column, np.array([low, high]))))
                    out[part.motion.frame[rows][part.seen[rows]] - first] += 1
        return out
