"""Faults of people: a switch (also beside a false alarm), a fragment (also of a tracker from pixels when the light
changes), a lost person, a late confirmation, a ghost, each with its true cause.

The cause is that of the injection: the person was dropped while hidden, while cut by the edge, when the detector lost
them, beside somebody, in a turn, or with nothing of this around (the tracker's own fault). Cases between two causes are
not used.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np

from benchmarks.faults.scene import NOBODY, FaultScene, Ghost, Told, changed
from sim.types import Bools, Ints

Span = tuple[str, int, int, frozenset[int]]  # kind, first and last frame, ids of the people
NEW = 10_000  # id of tracks that stand for nobody's own
SECOND, GAP = 1.0, 0.75  # s


@dataclass(frozen=True, eq=False)
class Fault:
    """One injected fault."""

    told: Told
    expected: tuple[Span, ...]
    cause: str | None  # None: not unambiguous
    seen: Bools | None = None  # (T, P): who was detected; None: everybody
    pixels: bool = False  # the tracker worked on pictures
    alarms: tuple[Ghost, ...] = ()  # false alarms of the detector


def _cause(of: FaultScene, p: int, gap: Ints, first: int, last: int) -> str | None:
    """Returns what was hard for person p in the gap, or in the second before and in rows first to last."""
    if len(gap):
        cut, hidden = of.truncation[gap, p], of.visibility[gap, p] < 0.35
        if cut.min() > 0.25:
            return "edge"
        if hidden.all() and cut.max() < 0.15:
            return "hidden"
        if np.median(cut) > 0.15 or hidden.mean() > 0.4:
            return None
    rows = np.arange(max(first - round(SECOND * of.fps), 0), last + 1)
    rows = rows[of.there[rows, p]]
    near = of.nearest[rows, p].min()
    if near < 0.75:
        return "near"
    v = of.vel[rows, p]
    v = v[np.hypot(*v.T) > 0.3]
    turn = np.rad2deg(np.ptp(np.unwrap(np.arctan2(v[:, 1], v[:, 0])))) if len(v) > 1 else 0.0
    if near < 0.85 or 50 < turn < 70:
        return None
    return "turned" if turn >= 70 else "tracker"


def _presences(of: FaultScene) -> Iterator[tuple[int, Ints]]:
    """Yields each person's column with the rows in which they are there, without gap."""
    for p in range(len(of.people)):
        rows = np.flatnonzero(of.there[:, p])
        if len(rows) > 2 * of.frames(SECOND) and len(rows) == np.ptp(rows) + 1:
            yield p, rows


def _who(of: FaultScene, *columns: int) -> frozenset[int]:
    return frozenset(int(of.people[p]) for p in columns)


def _dropped(of: FaultScene, kind: str, p: int, gap: Ints, detected: bool = True) -> Fault:
    told = changed(of.told, slice(gap[0], gap[-1] + 1), p, id=NOBODY)
    cause = _cause(of, p, gap, int(gap[0]), int(gap[-1]))
    if kind == "late" and len(gap) < 0.5 * of.fps and cause in ("near", "turned"):
        cause = "tracker"  # every tracker waits so long
    seen = None
    if not detected:
        cause = "undetected" if cause not in ("hidden", "edge") else None
        seen = told.id >= 0
    return Fault(told, ((kind, int(gap[0]) + 1, int(gap[-1]) + 1, _who(of, p)),), cause, seen)


def switches(of: FaultScene) -> Iterator[Callable[[], Fault]]:
    """Yields switches without a gap."""
    for p, rows in _presences(of):
        for k in rows[of.frames(SECOND) :].tolist():
            yield lambda p=p, k=k, none=rows[:0]: Fault(
                changed(of.told, slice(k, None), p, id=NEW), (("switch", k + 1, k + 1, _who(of, p)),),
                _cause(of, p, none, k, k),
            )  # fmt: skip


def switches_in_clutter(of: FaultScene) -> Iterator[Callable[[], Fault]]:
    """Yields switches without a gap beside a false alarm of the detector: in the frame 0.5 m away, or 1.2 m."""
    for p, rows in _presences(of):
        for k in rows[of.frames(SECOND) :].tolist():
            for far in (0.5, 1.2):
                yield lambda p=p, k=k, far=far, none=rows[:0]: Fault(
                    changed(of.told, slice(k, None), p, id=NEW), (("switch", k + 1, k + 1, _who(of, p)),),
                    "clutter" if far < 0.8 else _cause(of, p, none, k, k),
                    alarms=((k + 1, NEW, *(of.pos[k, p] + np.array([far, 0.0])).tolist()),),
                )  # fmt: skip


def fragments(of: FaultScene) -> Iterator[Callable[[], Fault]]:
    """Yields gaps of a person, of whom the detector has a detection or not."""
    n = of.frames(GAP)
    for p, rows in _presences(of):
        for k in range(of.frames(SECOND), len(rows) - n - 1):
            yield lambda p=p, gap=rows[k : k + n]: _dropped(of, "fragment", p, gap)
            yield lambda p=p, gap=rows[k : k + n]: _dropped(of, "fragment", p, gap, detected=False)


def in_changing_light(of: FaultScene) -> Iterator[Callable[[], Fault]]:
    """Yields gaps of a person whom a tracker from pixels loses when the light changes suddenly."""
    n = of.frames(GAP)
    for p, rows in _presences(of):
        for switch in of.switches:
            k = int(np.searchsorted(rows, switch))
            if 1 < k < len(rows) - n - 1:
                yield lambda p=p, gap=rows[k : k + n]: _lost_in_light(of, p, gap)


def _lost_in_light(of: FaultScene, p: int, gap: Ints) -> Fault:
    made = _dropped(of, "fragment", p, gap)
    cause = "light" if made.cause in ("near", "turned", "tracker") else made.cause
    return replace(made, cause=cause, pixels=True)


def losses(of: FaultScene) -> Iterator[Callable[[], Fault]]:
    """Yields people who are lost for good."""
    for p, rows in _presences(of):
        for k in range(of.frames(SECOND), len(rows) - 1):
            yield lambda p=p, gap=rows[k:]: _dropped(of, "miss", p, gap)


def late(of: FaultScene) -> Iterator[Callable[[], Fault]]:
    """Yields people who are confirmed late."""
    for p, rows in _presences(of):
        for n in range(1, of.frames(2 * SECOND)):
            yield lambda p=p, gap=rows[:n]: _dropped(of, "late", p, gap)


def ghosts(of: FaultScene) -> Iterator[Callable[[], Fault]]:
    """Yields ghosts far from anybody, beside a tracked person, beside a lost one, and tracks of people who are gone."""
    n = of.frames(GAP)
    for p, rows in _presences(of):
        for k in range(of.frames(SECOND), len(rows) - n - 1):
            yield lambda gap=rows[k : k + n]: _clutter(of, gap)
            yield lambda p=p, gap=rows[k : k + n]: _beside(of, p, gap, lost=False)
            yield lambda p=p, gap=rows[k : k + n]: _beside(of, p, gap, lost=True)
        if rows[-1] + n < len(of.there):
            yield lambda p=p, last=int(rows[-1]): _left(of, p, last, n)


def _ghost(
    of: FaultScene, id: int, gap: Ints, places: np.ndarray, cause: str | None, told: Told | None = None
) -> Fault:
    told = of.told if told is None else told
    rows = tuple((k + 1, id, float(x), float(y)) for k, (x, y) in zip(gap.tolist(), places, strict=True))
    return Fault(replace(told, ghosts=rows), (("ghost", int(gap[0]) + 1, int(gap[-1]) + 1, frozenset()),), cause)


def _clutter(of: FaultScene, gap: Ints) -> Fault:
    place = np.nanmax(of.pos[gap], axis=(0, 1)) + 4.0
    return _ghost(of, NEW, gap, np.tile(place, (len(gap), 1)), "clutter")


def _beside(of: FaultScene, p: int, gap: Ints, lost: bool) -> Fault:
    places = of.pos[gap, p] + (np.array([0.0, 1.3]) if lost else np.array([0.3, 0.3]))
    d = np.hypot(*np.moveaxis(of.pos[gap] - places[:, None], -1, 0))
    d[:, p] = np.inf
    alone = np.nanmin(np.nan_to_num(d, nan=np.inf)) > (1.6 if lost else 0.8)
    if not lost:
        return _ghost(of, NEW, gap, places, "double" if alone else None)
    drop = _dropped(of, "fragment", p, gap)
    ghost = _ghost(of, NEW, gap, places, "displaced" if alone else None, drop.told)
    # where somebody else is within reach of the ghost, it is not one
    return replace(ghost, expected=ghost.expected + drop.expected) if alone else replace(ghost, expected=())


def _left(of: FaultScene, p: int, last: int, n: int) -> Fault:
    gap = np.arange(last + 1, last + 1 + n)
    d = np.hypot(*np.moveaxis(of.pos[gap] - of.pos[last, p], -1, 0))
    if np.nanmin(np.nan_to_num(d, nan=np.inf)) < 2.1:
        return Fault(of.told, (), None)  # it could be matched with somebody else
    return _ghost(of, int(of.people[p]), gap, np.tile(of.pos[last, p], (n, 1)), "left")


PEOPLE = {
    "switch": switches, "switch in clutter": switches_in_clutter, "fragment": fragments,
    "fragment in changing light": in_changing_light, "lost person": losses, "late confirmation": late, "ghost": ghosts,
}  # fmt: skip
