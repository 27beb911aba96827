"""Recognises queues in measured motion: people who wait in line behind one another. For truth and trackers alike.

*Shapes, each in one moment.* People of one moment who stand close to each other form a crowd. A line is an ordered set
of people of a crowd for which three tests hold along the straight line that fits them best: neighbours are 0.4 to 1.5 m
apart (MIN_SPACING, MAX_SPACING), nobody is more than 0.5 m (MAX_OFFSET) off the straight line, and the direction from
one person to the next turns by at most 60°. A circle of people in conversation can pass the first two tests, but not
the third. All moments are handled at once. Tables of positions (M, n, 2) hold M ordered sets; only the first `count`
(M,) positions of each set count.

*Through time.* Lines are followed by the people in them, and those that last long enough become queues.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import groupby
from typing import Any

import numpy as np

from sim.elementary import atan2, length, unit
from sim.geometry.polygons import cross
from sim.truth.merge_split_rules import close_pairs, frames_of, longest_time, stretches
from sim.truth.motion_rows import MotionRows
from sim.types import Array, Bools, GroupEvent, Ints

MIN_SPACING, MAX_SPACING = 0.4, 1.5  # m along the line
MAX_OFFSET = 0.5  # m
MIN_TURN_COSINE = 0.5  # cosine of the greatest turn from one person to the next
OFF_LINE = 1e9  # m: stands for the position along the line of people who are off it
MIN_CROWD_SHARE = 2 / 3  # of a crowd that must be in the line: else it is no queue
MAX_CELLS = 2_000_000  # numbers handled together: bounds memory


def queue_shapes(pos: Array, i: Ints, j: Ints) -> Iterator[tuple[Ints, Ints, Array, Array]]:
    """Yields tables of lines of people, at most one line for each crowd; the crowds of a table have the same size n.

    pos (N, 2): m. i, j (K,): pairs of people (rows of pos) who stand close to each other; such pairs connect a crowd.
    The line is the whole crowd if it passes the tests. Else it is the longest line of at least three people and two
    thirds of the crowd; of equally long lines the straightest. A table of M lines is a tuple of four arrays: the
    people in order along the line (M, n), as rows of pos; how many people are in the line (M,), further columns mean
    nothing; unit vectors (M, 2) from the first person towards the last; mean positions (M, 2), m.
    """
    for crowd in _crowds(len(pos), i, j):
        portion = max(1, MAX_CELLS // (crowd.shape[1] * crowd.shape[1] * crowd.shape[1]))
        for low in range(0, len(crowd), portion):
            some = crowd[low : low + portion]
            order, count = _best(pos[some])
            found = count > 0
            rows, count = np.take_along_axis(some[found], order[found], axis=1), count[found]
            yield rows, count, *_axes(pos[rows], count)[:2]


def _crowds(people: int, i: Ints, j: Ints) -> Iterator[Ints]:
    """Yields the rows (C, n) of the C crowds of each size n > 1."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    graph = coo_array((np.ones(len(i), np.int8), (i, j)), shape=(people, people))
    _, crowd = connected_components(graph, directed=False)
    order = np.argsort(crowd, kind="stable")
    size = np.bincount(crowd, minlength=1)
    first = np.cumsum(size) - size
    for n in np.unique(size[size > 1]):
        yield order[first[size == n, None] + np.arange(n)]


def _best(p: Array) -> tuple[Ints, Ints]:
    """Returns the order (C, n) of the people along the line in each crowd, and how many are in it (C,), or 0."""
    n = p.shape[1]
    whole_crowd = np.full(len(p), n)
    u = _axes(p, whole_crowd)[0]
    order = np.argsort((p * u[:, None]).sum(axis=2), axis=1, kind="stable")
    count = np.where(_fits(np.take_along_axis(p, order[..., None], axis=1), whole_crowd), n, 0)
    least = max(3, int(np.ceil(MIN_CROWD_SHARE * n - 1e-9)))
    rest = np.flatnonzero(count == 0) if n >= least else np.zeros(0, np.int64)
    if len(rest):
        crowd, some, long, residual = _lines_through_pairs(p[rest], least)
        ranked = np.lexsort((residual, -long, crowd))
        ranked = ranked[np.flatnonzero(np.diff(crowd[ranked], prepend=-1))]
        order[rest[crowd[ranked]]], count[rest[crowd[ranked]]] = some[ranked], long[ranked]
    return order, count


def _axes(p: Array, count: Ints) -> tuple[Array, Array, Array]:
    """Returns the best straight line of each set: unit vector (M, 2), middle (M, 2) m, root of the squared distances
    (M,).
    """
    within = np.arange(p.shape[1]) < count[:, None]
    middle = np.where(within[..., None], p, 0.0).sum(axis=1) / count[:, None]
    arm = np.where(within[..., None], p - middle[:, None], 0.0)
    xx, yy, xy = ((arm[..., a] * arm[..., b]).sum(axis=1) for a, b in ((0, 0), (1, 1), (0, 1)))
    u = unit(0.5 * atan2(2 * xy, xx - yy))
    whole = p[np.arange(len(p)), count - 1] - p[:, 0]
    u = np.where(((u * whole).sum(axis=1) >= 0)[:, None], u, -u)
    least = (xx + yy) / 2 - length(np.stack([(xx - yy) / 2, xy], axis=-1))
    return u, middle, np.sqrt(np.maximum(least, 0.0))


def _fits(p: Array, count: Ints) -> Bools:
    """Returns which of M ordered sets of positions pass the three tests of a line."""
    u, middle, _ = _axes(p, count)
    arm = p - middle[:, None]
    off = np.abs(cross(u[:, None], arm))
    within = np.arange(p.shape[1]) < count[:, None]
    good = (off <= MAX_OFFSET) | ~within
    good[:, 1:] &= _steps_fit((arm * u[:, None]).sum(axis=2)) | ~within[:, 1:]
    good[:, 2:] &= _turns_fit(p) | ~within[:, 2:]
    return np.asarray(good.all(axis=1))


def _steps_fit(along: Array) -> Bools:
    steps = np.diff(along, axis=1)
    return np.asarray((steps >= MIN_SPACING) & (steps <= MAX_SPACING))


def _turns_fit(p: Array) -> Bools:
    step = np.diff(p, axis=1)
    size = length(step)
    return np.asarray((step[:, :-1] * step[:, 1:]).sum(axis=2) >= MIN_TURN_COSINE * size[:, :-1] * size[:, 1:])


def _lines_through_pairs(p: Array, least: int) -> tuple[Ints, Ints, Ints, Array]:
    """Returns crowd, order, length and misfit of lines sought through each two people of crowds (C, n, 2)."""
    i, j = np.triu_indices(p.shape[1], 1)
    apart = length(p[:, j] - p[:, i])
    crowd, seed = np.nonzero((apart >= MIN_SPACING) & (apart <= MAX_SPACING))
    i, j, places = i[seed], j[seed], p[crowd]
    rows = np.arange(len(crowd))
    u = places[rows, j] - places[rows, i]
    u /= length(u)[:, None]
    arm = places - (places[rows, i] + places[rows, j])[:, None] / 2
    off = np.abs(cross(u[:, None], arm))
    along = np.where(off <= MAX_OFFSET, (arm * u[:, None]).sum(axis=2), OFF_LINE)
    order = np.argsort(along, axis=1, kind="stable")
    places = np.take_along_axis(places, order[..., None], axis=1)
    links = _steps_fit(np.take_along_axis(along, order, axis=1))
    links[:, 1:] &= _turns_fit(places) | ~links[:, :-1]
    start, count = _longest(links)
    order = np.take_along_axis(order, np.minimum(start[:, None] + np.arange(p.shape[1]), p.shape[1] - 1), axis=1)
    places = np.take_along_axis(p[crowd], order[..., None], axis=1)
    good = np.flatnonzero((count >= least) & _fits(places, count))
    return crowd[good], order[good], count[good], _axes(places[good], count[good])[2]


def _longest(links: Bools) -> tuple[Ints, Ints]:
    """Returns start and length (M,) of the longest run of linked positions in each row."""
    start, count, run = np.zeros(len(links), np.int64), np.ones(len(links), np.int64), np.ones(len(links), np.int64)
    for k in range(links.shape[1]):
        run = np.where(links[:, k], run + 1, 1)
        start, count = np.where(run > count, k + 2 - run, start), np.maximum(run, count)
    return start, count


WAITING_SPEED = 0.4  # m/s: slower people wait
ADVANCE_TIME = 3.0  # s: people who move for no longer between two waits advance in the queue, and count as waiting
QUEUE_TIME = 3.0  # s for which a queue must have QUEUE_PEOPLE
QUEUE_PEOPLE = 3
BRIDGE_TIME = 1.5  # s for which a line may be lost
MEMBER_TIME = 1.0  # s in line, from which a person counts as a member of the queue
SIDEWAYS_SPEED = 0.1  # m/s: a line that moves sideways faster than this, and less along itself, is no queue
MAX_RATE = 10.0  # Hz, at most, at which moments are examined


@dataclass(frozen=True, slots=True)
class _LineNow:
    """A line of waiting people in one moment; vectors are complex numbers."""

    t: int  # frame, from 0
    order: tuple[int, ...]  # people from one end to the other
    u: complex  # unit vector from the first person towards the last
    middle: complex  # their mean position, m
    drift: complex  # their mean velocity along u, and to the left of u (imaginary part), m/s
    there: tuple[Ints, Ints]  # who is there, ascending, and in which groups

    def turned(self) -> _LineNow:
        """Returns the same line with its ends exchanged."""
        return replace(self, order=self.order[::-1], u=-self.u, drift=-self.drift)


@dataclass
class _FollowedLine:
    """A line of waiting people that is followed through time; frames from 0."""

    now: _LineNow  # the line when last seen
    since: int  # first and last frame with at least 3 people (QUEUE_PEOPLE)
    three: int
    middle: complex  # of the line in the frame in which following began, m
    there: tuple[Ints, Ints]  # as of the line in the frame `since`
    seen: Counter[int]  # by person, number of moments (examined frames) in the line
    drift: complex = 0.0  # sum over `moments` moments of the line's drift
    moments: int = 0


def queues(motion: MotionRows, fps: float) -> list[GroupEvent]:
    """Returns a queue event for each queue, in order of first and last frame; people are columns + 1.

    A queue is a line (see `queue_shapes`) of waiting people that has at least 3 people for 3 s; it may be lost for up
    to 1.5 s. A line that moves sideways is no queue. The event starts in the first frame with 3 people and ends in the
    last frame with 2 in line. Its members are all people who were in the line for at least 1 s. Its position is the
    middle of the line when it was first found. About 10 frames per s are examined.
    """
    finder, rows = QueueFinder(fps), (motion.frame, motion.column, motion.pos, motion.vel, motion.group)
    found = [*finder.add(*rows, motion.length), *finder.rest()]
    found = [replace(e, members=tuple(p + 1 for p in e.members)) for e in found]
    return sorted(found, key=lambda e: (e.start, e.end, e.members))


class QueueFinder:
    """Finds queues in frames that are added one after another; it does not matter how many at once.

    State: following, the lines that may go on; rows (frame, id, pos, vel, group) of the frames in which it is not known
    yet who waits; slow, the last frame in which each person was slow; end, number of frames so far; done, of those in
    which it is known who waits.
    """

    def __init__(self, fps: float) -> None:
        self.fps, self.stride = fps, max(1, round(fps / MAX_RATE))
        self.hold, self.bridge = frames_of(QUEUE_TIME, fps), max(frames_of(BRIDGE_TIME, fps), self.stride)
        self.end = self.done = 0
        self.following, self.slow = list[_FollowedLine](), dict[int, int]()
        nobody, nowhere = np.zeros(0, np.int64), np.zeros((0, 2))
        self.rows: tuple[Any, ...] = (nobody, nobody, nowhere, nowhere, nobody)

    def add(self, frame: Ints, id: Ints, pos: Array, vel: Array, group: Ints, end: int) -> list[GroupEvent]:
        """Adds the frames up to `end`, and returns the queues that are known to be over; `emitted` is None.

        frame, from 0, id, group (R,), pos, vel (R, 2), m, m/s: one row per person and frame.
        """
        new, self.end = (frame, id, pos, vel, group), end
        self.rows = tuple(np.concatenate(pair) for pair in zip(self.rows, new, strict=True))
        return self._look(end - frames_of(ADVANCE_TIME, self.fps))

    def rest(self) -> list[GroupEvent]:
        """Returns the queues that are not known to be over when the recording ends."""
        found = self._look(self.end)
        found += self._ended(self.following)
        self.following = []
        return found

    def forget(self, before: int) -> None:
        """Forgets who was slow before a frame."""
        self.slow = {p: t for p, t in self.slow.items() if t >= before}

    def _look(self, until: int) -> list[GroupEvent]:
        """Follows the lines of the frames before `until`, and keeps the other rows. Returns the queues that ended."""
        if until <= self.done:
            return []
        frame, id, pos, vel, group = self.rows
        ids, column = np.unique(id, return_inverse=True)
        rows = MotionRows.of(frame, column, pos, vel, group, self.end)
        known = rows.frame < until
        waits = waiting_people(rows, self.fps, np.array([self.slow.get(p, -1) for p in ids.tolist()], np.int64))
        lines, ended = _lines(rows, waits & known, self.stride, ids), list[_FollowedLine]()
        for t, moments in groupby(lines, key=lambda m: m.t):
            ended += self._over(t - 1)
            for moment in moments:
                _follow(self.following, moment, self.hold, self.bridge)
        ended += self._over(until - 1)
        slow = known & (length(rows.vel) < WAITING_SPEED)
        self.slow |= dict(zip(ids[rows.column[slow]].tolist(), rows.frame[slow].tolist(), strict=True))
        self.rows, self.done = tuple(x[frame >= until] for x in self.rows), until
        return self._ended(ended)

    def _over(self, t: int) -> list[_FollowedLine]:
        """Removes and returns the lines that cannot go on after frame t."""
        over = [f for f in self.following if t >= f.now.t + self.bridge]
        self.following = [f for f in self.following if t < f.now.t + self.bridge]
        return over

    def _ended(self, lines: Sequence[_FollowedLine]) -> list[GroupEvent]:
        found = []
        for f in lines:
            people = sorted(p for p, n in f.seen.items() if n * self.stride >= MEMBER_TIME * self.fps)
            along, aside = abs(f.drift.real) / f.moments, abs(f.drift.imag) / f.moments
            sideways = aside > SIDEWAYS_SPEED and aside > along
            if people and f.three - f.since + self.stride >= self.hold and not sideways:
                before, after = (_groups_of(people, there) for there in (f.there, f.now.there))
                place = f.middle.real, f.middle.imag
                found.append(GroupEvent("queue", f.since + 1, f.now.t + 1, None, before, after, tuple(people), place))
        return found


def longest_line(motion: MotionRows, fps: float) -> tuple[int, float]:
    """Returns the number of people, at most 3, for which there was a line, and the line's longest time in s.

    Without a line of 2 people both are 0. Gaps up to 1.5 s are bridged.
    """
    stride = max(1, round(fps / MAX_RATE))
    lines = _lines(motion, waiting_people(motion, fps), stride)
    for people in range(QUEUE_PEOPLE, 1, -1):
        holds = np.zeros(motion.length, np.bool_)
        holds[[line.t for line in lines if len(line.order) >= people]] = True
        if holds.any():
            return people, longest_time(holds, fps, BRIDGE_TIME)
    return 0, 0.0


def _groups_of(people: Sequence[int], there: tuple[Ints, Ints]) -> tuple[int, ...]:
    """Returns the ids of the groups of those people who are there, after -1 once for each person alone."""
    label = there[1][np.isin(there[0], people)]
    return (-1,) * int((label < 0).sum()) + tuple(np.unique(label[label >= 0]).tolist())


def waiting_people(motion: MotionRows, fps: float, slow_before: Ints | None = None) -> Bools:
    """Returns flags (R,): True where a person waits.

    These are people slower than 0.4 m/s, and people who move for at most 3 s between two such waits. slow_before (K,):
    the last frame before these rows in which each person was that slow, -1 for none; None: nobody was.
    """
    slow = length(motion.vel) < WAITING_SPEED
    column, frame = motion.column[slow], motion.frame[slow]
    if slow_before is not None:
        before = np.flatnonzero(slow_before >= 0)
        column, frame = np.concatenate([before, column]), np.concatenate([slow_before[before], frame])
        order = np.lexsort((frame, column))
        column, frame = column[order], frame[order]
    person, first, last = stretches(column, frame, 1, frames_of(ADVANCE_TIME, fps))
    out = np.zeros(len(slow) + 1, np.int64)
    np.add.at(out, motion.find(person, first), 1)
    np.add.at(out, motion.find(person, last + 1), -1)
    return np.cumsum(out)[:-1] > 0


def _lines(motion: MotionRows, waits: Bools, stride: int, ids: Ints | None = None) -> list[_LineNow]:
    """Returns the lines of waiting people in all moments, in order of time; waits (R,): who waits. ids: of the columns;
    None: the columns themselves."""
    some = np.flatnonzero(waits & (motion.frame % stride == 0))
    if not len(some):
        return []
    some = some[np.argsort(motion.frame[some], kind="stable")]
    t, p, place, speed = motion.frame[some], motion.column[some], motion.pos[some], np.nan_to_num(motion.vel[some])
    every = np.argsort(motion.frame, kind="stable")
    person = motion.column if ids is None else ids[motion.column]
    cuts = np.searchsorted(motion.frame[every], np.arange(motion.length + 1))
    rows_at = {k: every[cuts[k] : cuts[k + 1]] for k in np.unique(t).tolist()}
    there = {k: (person[rows], motion.group[rows]) for k, rows in rows_at.items()}
    p = p if ids is None else ids[p]
    made: list[_LineNow] = []
    for rows, count, u, middle in queue_shapes(place, *close_pairs(t, place, MAX_SPACING)):
        within = np.arange(rows.shape[1]) < count[:, None]
        mean = np.where(within[..., None], speed[rows], 0.0).sum(axis=1) / count[:, None]
        drift = (mean * u).sum(axis=1) + 1j * cross(u, mean)
        vectors = (x[:, 0] + 1j * x[:, 1] for x in (u, middle))
        columns = (x.tolist() for x in (t[rows[:, 0]], count, p[rows], *vectors, drift))
        made += [
            _LineNow(when, tuple(people[:n]), way, place, drifts, there[when])
            for when, n, people, way, place, drifts in zip(*columns, strict=True)
        ]
    return sorted(made, key=lambda m: (m.t, min(m.order)))


def _follow(following: list[_FollowedLine], now: _LineNow, hold: int, bridge: int) -> None:
    """Adds the line `now` to the line in `following` that shares most people with it, or appends it as a new one."""
    people, long = set(now.order), len(now.order) >= QUEUE_PEOPLE
    fits = [f for f in following if f.now.t < now.t and len(people.intersection(f.now.order)) > 1]
    fits = [f for f in fits if _same_order(f.now, now)]
    if fits:
        f = max(fits, key=lambda f: (len(people.intersection(f.now.order)), -f.since))
        now = now if _same_way(f.now, now) else now.turned()
    elif long:
        f = _FollowedLine(now, now.t, now.t, now.middle, now.there, Counter())
        following.append(f)
    else:
        return
    if long:
        # A line that was too short for too long before it became a queue starts anew.
        if now.t - f.three > bridge and f.three - f.since < hold:
            f.since, f.there, f.seen, f.drift, f.moments = now.t, now.there, Counter(), 0.0, 0
        f.three = now.t
    f.now, f.drift, f.moments = now, f.drift + now.drift, f.moments + 1
    f.seen.update(now.order)


def _same_way(before: _LineNow, now: _LineNow) -> bool:
    return (before.u * now.u.conjugate()).real >= 0


def _same_order(before: _LineNow, now: _LineNow) -> bool:
    """Returns True if the people who are in both lines stand in the same order."""
    order = now.order if _same_way(before, now) else now.order[::-1]
    return [p for p in order if p in before.order] == [p for p in before.order if p in order]
