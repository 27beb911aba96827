"""Lines of waiting people: found moment by moment as chains, followed through time by who is in them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np

from sim.chains import FURTHEST, axis, chain
from sim.near import close_pairs, stretches
from sim.rules import frames_of
from sim.types import Array, Bools, Ints

WAITING = 0.4  # m/s
ADVANCE = 2.0  # s: one who waited and will wait again within so long is advancing
HOLD = 3.0  # s with three people or more
LEAST = 3  # people, for a queue to be one
BRIDGE = 1.5  # s: a line may be lost for so long
MEMBER = 1.0  # s in line, to count as one of it
ASIDE = 0.1  # m/s: a line that as a whole moves sideways, and less along, is a row of people abreast
RATE = 10.0  # Hz: looked at no more often


@dataclass(frozen=True, slots=True)
class Line:
    """A queue: first and last frame (from 0), columns of its people in the order in which they stood (whichever end
    was the head), `left`: those who left it before the end, in the order of leaving; middle: where."""

    first: int
    last: int
    order: tuple[int, ...]
    left: tuple[int, ...]
    middle: tuple[float, float]

    @property
    def fifo(self) -> bool:
        """Whether all who left did so in the order in which they stood, from one end."""
        n = len(self.left)
        return self.left in (self.order[:n], self.order[::-1][:n])


@dataclass
class _Followed:
    """A line being followed. State: order and direction when last seen; since when and until when it had three people;
    until when two; moments in it and last frame of each person; sums of the velocity along and aside over moments."""

    order: tuple[int, ...]
    u: Array
    since: int
    three: int
    last: int
    middle: Array
    seen: dict[int, int] = field(default_factory=dict)
    gone: dict[int, int] = field(default_factory=dict)
    ranks: list[int] = field(default_factory=list)
    drift: Array = field(default_factory=lambda: np.zeros(2))
    moments: int = 0


def lines(pos: Array, vel: Array, there: Bools, fps: float) -> list[Line]:
    """All queues; pos, vel (T, P, 2), there (T, P)."""
    stride = max(1, round(fps / RATE))
    hold, bridge = frames_of(HOLD, fps), max(frames_of(BRIDGE, fps), stride)
    following: list[_Followed] = []
    found: list[Line] = []
    for t, chains in _moments(pos, waiting(vel, there, fps), stride):
        ended = [f for f in following if t - f.last > bridge]
        following = [f for f in following if t - f.last <= bridge]
        found += [line for f in ended for line in _finished(f, hold, stride, fps)]
        for rows in chains:
            _follow(following, rows, t, pos, vel, hold, bridge)
    found += [line for f in following for line in _finished(f, hold, stride, fps)]
    return sorted(found, key=lambda q: (q.first, q.last, q.order))


def waiting(vel: Array, there: Bools, fps: float) -> Bools:
    """Who (T, P) waits: slower than 0.4 m/s, or between two moments of that no more than 2 s apart."""
    with np.errstate(invalid="ignore"):
        slow = there & (np.hypot(vel[..., 0], vel[..., 1]) < WAITING)
    p, t = np.nonzero(slow.T)
    out = np.zeros((len(slow) + 1, slow.shape[1]), np.int64)
    who, first, last = stretches(p, t, 1, frames_of(ADVANCE, fps))
    np.add.at(out, (first, who), 1)
    np.add.at(out, (last + 1, who), -1)
    return np.asarray((np.cumsum(out, axis=0)[:-1] > 0) & there)


def _moments(pos: Array, waits: Bools, stride: int) -> Iterator[tuple[int, list[Ints]]]:
    """(t, chains of columns) of each moment looked at in which any two wait near each other."""
    t, p = np.nonzero(waits[::stride])
    i, j = close_pairs(t, pos[t * stride, p], FURTHEST)
    cuts = np.flatnonzero(np.diff(t[i], prepend=-1))
    for a, b in pairwise([*cuts.tolist(), len(i)]):
        moment = int(t[i[a]]) * stride
        crowds = _crowds(p[i[a:b]].tolist(), p[j[a:b]].tolist())
        chains = [np.array(c)[chain(pos[moment, c])] for c in crowds]
        yield moment, [c for c in chains if len(c)]


def _crowds(a: list[int], b: list[int]) -> list[list[int]]:
    """Connected people, each crowd sorted."""
    crowd: dict[int, set[int]] = {}
    for p, q in zip(a, b, strict=True):
        one = crowd.get(p, {p}) | crowd.get(q, {q})
        for member in one:
            crowd[member] = one
    return [sorted(c) for c in {id(c): c for c in crowd.values()}.values()]


def _follow(following: list[_Followed], rows: Ints, t: int, pos: Array, vel: Array, hold: int, bridge: int) -> None:
    """Take a chain as the next moment of the line with most of its people, or as a new line."""
    u = axis(pos[t, rows])
    fits = [f for f in following if f.last < t and _continues(f, rows, u)]
    if fits:
        f = max(fits, key=lambda f: (len(set(f.order) & set(rows.tolist())), -f.since))
        if f.u @ u < 0:
            rows, u = rows[::-1], -u
    elif len(rows) >= LEAST:
        f = _Followed((), u, t, t, t, pos[t, rows].mean(axis=0))
        following.append(f)
    else:
        return
    if len(rows) >= LEAST:
        if t - f.three > bridge and f.three - f.since < hold:
            f.since, f.seen, f.gone, f.ranks, f.drift, f.moments = t, {}, {}, [], np.zeros(2), 0
        f.three = t
    f.order, f.u, f.last = tuple(rows.tolist()), u, t
    f.drift += _drift(vel[t, rows], u)
    f.moments += 1
    _note(f, t)


def _drift(vel: Array, u: Array) -> Array:
    mean = np.nan_to_num(vel).mean(axis=0)
    return np.array([mean @ u, mean @ np.array([-u[1], u[0]])])


def _continues(f: _Followed, rows: Ints, u: Array) -> bool:
    """Whether two or more stand in the chain as they did in the line, in the same order."""
    now = rows.tolist() if f.u @ u >= 0 else rows[::-1].tolist()
    shared = [p for p in now if p in f.order]
    return len(shared) > 1 and shared == [p for p in f.order if p in now]


def _note(f: _Followed, t: int) -> None:
    """Who is in line, and where those who are new stand among the others."""
    for k, p in enumerate(f.order):
        f.seen[p] = f.seen.get(p, 0) + 1
        f.gone[p] = t
        if p not in f.ranks:
            ahead = [f.ranks.index(q) for q in f.order[:k]]
            f.ranks.insert(max(ahead) + 1 if ahead else 0, p)


def _finished(f: _Followed, hold: int, stride: int, fps: float) -> list[Line]:
    """The queue that a followed line was, if it was one."""
    along, aside = np.abs(f.drift) / f.moments
    if f.three - f.since + stride < hold or (aside > ASIDE and aside > along):
        return []
    order = tuple(p for p in f.ranks if f.seen[p] * stride >= MEMBER * fps)
    left = sorted((p for p in order if f.gone[p] < f.last), key=lambda p: f.gone[p])
    return [Line(f.since, f.last, order, tuple(left), (float(f.middle[0]), float(f.middle[1])))]
