"""Lines of waiting people: found moment by moment as queue_shapes, followed through time by who is in them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from itertools import groupby

import numpy as np

from sim.truth.merge_split_rules import frames_of
from sim.truth.proximity import close_pairs, stretches
from sim.truth.queue_shapes import MAX_SPACING, QueueShapes, queue_shapes
from sim.types import Array, Bools, GroupEvent, Ints

WAITING_SPEED = 0.4  # m/s
ADVANCE_TIME = 3.0  # s: one who waited and will wait again within so long is advancing (a pair served moves all by two)
QUEUE_TIME = 3.0  # s with three people or more
QUEUE_PEOPLE = 3  # people, for a queue to be one
BRIDGE_TIME = 1.5  # s: a line may be lost for so long
MEMBER_TIME = 1.0  # s in line, to count as one of it
SIDEWAYS_SPEED = 0.1  # m/s: a line that as a whole moves sideways, and less along, is a row of people abreast
MAX_RATE = 10.0  # Hz: looked at no more often

Vector = tuple[float, float]


@dataclass(frozen=True, slots=True)
class DetectedQueue:
    """A queue: first and last frame (from 0), columns of its people in the order in which they came to stand (whichever
    end was the head), `left`: those who left it before the end, in the order of leaving; middle: where.

    fifo: whether all who left stood, when last in line, at one and the same end of it (next to none but such as left
    within a second, too)."""

    first: int
    last: int
    order: tuple[int, ...]
    left: tuple[int, ...]
    middle: Vector
    fifo: bool


@dataclass(frozen=True, slots=True)
class _Moment:
    """A chain at time t (frame from 0): columns in order, direction, middle, mean velocity along it and aside."""

    t: int
    order: tuple[int, ...]
    u: Vector
    middle: Vector
    drift: Vector

    def turned(self) -> _Moment:
        """The same, looked at from its other end."""
        return replace(self, order=self.order[::-1], u=(-self.u[0], -self.u[1]), drift=(-self.drift[0], -self.drift[1]))


@dataclass
class _Followed:
    """A line being followed. State: when last seen, and as what; since when and until when it had three people;
    moments in it, last moment and rank of each person; sums of the velocity along and aside over moments."""

    now: _Moment
    since: int
    three: int
    middle: Vector
    seen: dict[int, int] = field(default_factory=dict)
    gone: dict[int, _Moment] = field(default_factory=dict)
    ranks: list[int] = field(default_factory=list)
    drift: Vector = (0.0, 0.0)
    moments: int = 0


def queues(pos: Array, vel: Array, present: Bools, group: Ints, fps: float) -> list[GroupEvent]:
    """Three or more people waiting in line for 3 s or longer; the event lasts until less than two do.

    Spacing along the line 0.4-1.5 m, nobody more than 0.5 m off it, slower than 0.4 m/s except when advancing.
    start is the onset, members all who stood in the line for a second or more, pos its
    middle then; before and after are the members' groups (T, P) in the first and in the last frame.
    """
    found = []
    for q in detect_queues(pos, vel, present, fps):
        if not q.order:  # nobody stayed for a second
            continue
        columns = np.array(sorted(q.order))
        before, after = (_groups_of(group[t, columns[present[t, columns]]]) for t in (q.first, q.last))
        people = tuple((columns + 1).tolist())
        found.append(GroupEvent("queue", q.first + 1, q.last + 1, None, before, after, people, q.middle))
    return found


def _groups_of(label: Ints) -> tuple[int, ...]:
    """Ascending ids of the groups among people's labels; -1 once for each person alone."""
    return (-1,) * int((label < 0).sum()) + tuple(np.unique(label[label >= 0]).tolist())


def detect_queues(pos: Array, vel: Array, present: Bools, fps: float) -> list[DetectedQueue]:
    """All queues; pos, vel (T, P, 2), present (T, P)."""
    there = present & np.isfinite(pos).all(axis=2)
    stride = max(1, round(fps / MAX_RATE))
    hold, bridge = frames_of(QUEUE_TIME, fps), max(frames_of(BRIDGE_TIME, fps), stride)
    following: list[_Followed] = []
    found: list[DetectedQueue] = []
    for t, moments in groupby(_moments(pos, vel, waiting(vel, there, fps), stride), key=lambda m: m.t):
        ended = [f for f in following if t - f.now.t > bridge]
        following = [f for f in following if t - f.now.t <= bridge]
        found += [line for f in ended for line in _finished(f, hold, stride, fps)]
        for moment in moments:
            _follow(following, moment, hold, bridge)
    found += [line for f in following for line in _finished(f, hold, stride, fps)]
    return sorted(found, key=lambda q: (q.first, q.last, q.order))


def waiting(vel: Array, there: Bools, fps: float) -> Bools:
    """Who (T, P) waits: slower than 0.4 m/s, or between two moments of that no more than 3 s apart."""
    with np.errstate(invalid="ignore"):
        slow = there & (np.hypot(vel[..., 0], vel[..., 1]) < WAITING_SPEED)
    p, t = np.nonzero(slow.T)
    out = np.zeros((len(slow) + 1, slow.shape[1]), np.int64)
    who, first, last = stretches(p, t, 1, frames_of(ADVANCE_TIME, fps))
    np.add.at(out, (first, who), 1)
    np.add.at(out, (last + 1, who), -1)
    return np.asarray((np.cumsum(out, axis=0)[:-1] > 0) & there)


def _moments(pos: Array, vel: Array, waits: Bools, stride: int) -> list[_Moment]:
    """The shapes of all moments looked at, ordered by time; of two people only where both are elsewhen in a longer
    one."""
    t, p = np.nonzero(waits[::stride])
    i, j = close_pairs(t, pos[t * stride, p], MAX_SPACING)
    tables = list(queue_shapes(pos[t * stride, p], i, j))
    queuing = np.zeros(waits.shape[1], bool)
    for c in tables:
        long = np.arange(c.rows.shape[1]) < np.where(c.count >= QUEUE_PEOPLE, c.count, 0)[:, None]
        queuing[p[c.rows[long]]] = True
    made: list[_Moment] = []
    for c in tables:
        made += _of_table(c, t * stride, p, vel, (c.count >= QUEUE_PEOPLE) | queuing[p[c.rows[:, :2]]].all(axis=1))
    return sorted(made, key=lambda m: (m.t, min(m.order)))


def _of_table(c: QueueShapes, t: Ints, p: Ints, vel: Array, kept: Bools) -> Iterator[_Moment]:
    within = np.arange(c.rows.shape[1]) < c.count[:, None]
    mean = np.where(within[..., None], np.nan_to_num(vel[t[c.rows], p[c.rows]]), 0.0).sum(axis=1) / c.count[:, None]
    along, aside = (mean * c.u).sum(axis=1), mean[:, 1] * c.u[:, 0] - mean[:, 0] * c.u[:, 1]
    columns = [t[c.rows[:, 0]], c.count, *c.u.T, *c.middle.T, along, aside]
    table = zip(p[c.rows][kept].tolist(), *(x[kept].tolist() for x in columns), strict=True)
    for people, when, n, ux, uy, x, y, forward, sideways in table:
        yield _Moment(when, tuple(people[:n]), (ux, uy), (x, y), (forward, sideways))


def _follow(following: list[_Followed], now: _Moment, hold: int, bridge: int) -> None:
    """Take a chain as the next moment of the line with most of its people, or as a new line."""
    people, long = set(now.order), len(now.order) >= QUEUE_PEOPLE
    fits = [f for f in following if f.now.t < now.t and len(people.intersection(f.now.order)) > 1]
    fits = [f for f in fits if _continues(f.now, now)]
    if fits:
        f = max(fits, key=lambda f: (len(people.intersection(f.now.order)), -f.since))
        now = now if _dot(f.now.u, now.u) >= 0 else now.turned()
    elif long:
        f = _Followed(now, now.t, now.t, now.middle)
        following.append(f)
    else:
        return
    if long:
        if now.t - f.three > bridge and f.three - f.since < hold:
            f.since, f.seen, f.gone, f.ranks, f.drift, f.moments = now.t, {}, {}, [], (0.0, 0.0), 0
        f.three = now.t
    f.now = now
    f.drift = (f.drift[0] + now.drift[0], f.drift[1] + now.drift[1])
    f.moments += 1
    _note(f)


def _dot(a: Vector, b: Vector) -> float:
    return a[0] * b[0] + a[1] * b[1]


def _continues(before: _Moment, now: _Moment) -> bool:
    """Whether those of the line who stand in the chain do so in the same order."""
    order = now.order if _dot(before.u, now.u) >= 0 else now.order[::-1]
    return [p for p in order if p in before.order] == [p for p in before.order if p in order]


def _note(f: _Followed) -> None:
    """Who is in line, and where those who are new stand among the others."""
    for k, p in enumerate(f.now.order):
        f.seen[p] = f.seen.get(p, 0) + 1
        f.gone[p] = f.now
        if p not in f.ranks:
            ahead = [f.ranks.index(q) for q in f.now.order[:k]]
            f.ranks.insert(max(ahead) + 1 if ahead else 0, p)


def _finished(f: _Followed, hold: int, stride: int, fps: float) -> list[DetectedQueue]:
    """The queue that a followed line was, if it was one."""
    along, aside = (abs(v) / f.moments for v in f.drift)
    if f.three - f.since + stride < hold or (aside > SIDEWAYS_SPEED and aside > along):
        return []
    order = tuple(p for p in f.ranks if f.seen[p] * stride >= MEMBER_TIME * fps)
    left = sorted((p for p in order if f.gone[p].t < f.now.t), key=lambda p: f.gone[p].t)
    return [DetectedQueue(f.since, f.now.t, order, tuple(left), f.middle, _from_one_end(f, left, MEMBER_TIME * fps))]


def _from_one_end(f: _Followed, left: list[int], late: float) -> bool:
    """Whether all who left did so from one end: those beyond them left no more than `late` frames later."""

    def stay(p: int, beyond: tuple[int, ...]) -> bool:
        return any(f.gone[q].t > f.gone[p].t + late for q in beyond)

    before = {p: f.gone[p].order.index(p) for p in left}
    first = not any(stay(p, f.gone[p].order[: before[p]]) for p in left)
    return first or not any(stay(p, f.gone[p].order[before[p] + 1 :]) for p in left)
