"""Faults of groups: late merges and splits; groups that are missed, divided, engulfed, false, or with strangers.

Each is made by other labels of true people, for trackers of people as members, for those of whole groups as hulls. The
cause follows from the places of the people concerned: members apart, others beside them, or neither (the tracker).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np

from benchmarks.faults.people import GAP, NEW, PEOPLE, SECOND, Fault, Span
from benchmarks.faults.scene import FaultScene, changed
from sim.types import GroupEvent, Ints

AROUND = 1.3  # s around an event in which no other fault begins


def _cause(of: FaultScene, row: int, mine: Ints, others: Ints, false: bool = False) -> str | None:
    """Returns what was hard about keeping people (columns) together in a row, and apart from others."""
    if false:
        d = _least(of, row, mine, mine)
        return "beside" if d < 1.4 else "tracker" if d > 1.6 else None
    apart = max(min(_distance(of, row, a, b) for b in mine if b != a) for a in mine) if len(mine) > 1 else 0.0
    beside = _least(of, row, mine, others)
    if apart > 2.1:
        return "apart"
    if apart > 1.9 or 1.4 <= beside <= 1.6:
        return None
    return "beside" if beside < 1.4 else "tracker"


def _distance(of: FaultScene, row: int, a: int, b: int) -> float:
    return float(np.hypot(*(of.pos[row, a] - of.pos[row, b])))


def _least(of: FaultScene, row: int, mine: Ints, others: Ints) -> float:
    return min((_distance(of, row, a, b) for a in mine for b in others if a != b), default=np.inf)


def _ids(of: FaultScene, columns: Ints) -> frozenset[int]:
    return frozenset(of.people[columns].tolist())


def _members(of: FaultScene, g: int, rows: slice) -> Ints | None:
    """Returns the columns of a group's members if they are there, and the same, in all rows; else None."""
    inside = of.group[rows] == g
    same = inside.all(axis=0) == inside.any(axis=0)
    return np.flatnonzero(inside[0]) if same.all() and inside[0].sum() > 1 else None


def _quiet(of: FaultScene, columns: Ints, k: int) -> bool:
    """Returns True if no event of these people starts within some time before row k, nor right after it."""
    reach = AROUND * of.fps
    return not any(
        -2 <= k + 1 - event.start <= reach and set(event.members) & _ids(of, columns)
        for event in of.sequence.truth.events or ()
    )


def _windows(of: FaultScene) -> Iterator[tuple[int, slice, int, Ints]]:
    """Yields first row, rows, id and members of each group that does not change before, in and after these rows."""
    n = of.frames(GAP)
    for k in range(2, len(of.there) - n - 2):
        for g in np.unique(of.group[k][of.group[k] >= 0]).tolist():
            members = _members(of, g, slice(k - 1, k + n + 1))
            began = np.flatnonzero((of.group == g).any(axis=1))[0]
            if members is not None and k > began + AROUND * of.fps and _quiet(of, members, k):
                yield k, slice(k, k + n), g, members


def _span(of: FaultScene, kind: str, rows: slice, columns: Ints) -> Span:
    return kind, rows.start + 1, rows.stop, _ids(of, columns)


def _middle(rows: slice) -> int:
    return (rows.start + 1 + rows.stop) // 2 - 1


def missed(of: FaultScene) -> Iterator[Callable[[], Fault]]:
    """Yields groups whose members stand alone for a while."""
    for _, rows, _, members in _windows(of):
        yield lambda rows=rows, members=members: Fault(
            changed(of.told, rows, members, label=-1), (_span(of, "missed group", rows, members),),
            _cause(of, _middle(rows), members, members[:0]),
        )  # fmt: skip


def missed_in_clutter(of: FaultScene) -> Iterator[Callable[[], Fault]]:
    """Yields groups whose members stand alone for a while, one of them 1 m from a false alarm of the detector."""
    for make in missed(of):
        yield lambda make=make: _in_clutter(of, make())


def _in_clutter(of: FaultScene, made: Fault) -> Fault:
    ((_, first, last, people),) = made.expected
    p = int(np.searchsorted(of.people, min(people)))
    alarms = tuple((k + 1, NEW, *(of.pos[k, p] + np.array([1.0, 0.0])).tolist()) for k in range(first - 1, last))
    return replace(made, cause="clutter" if made.cause == "tracker" else made.cause, alarms=alarms)


def divided(of: FaultScene) -> Iterator[Callable[[], Fault]]:
    """Yields groups of four and more in two parts of two and more."""
    for _, rows, _, members in _windows(of):
        if len(members) < 4:
            continue
        part = members[: len(members) // 2]
        yield lambda rows=rows, members=members, part=part: Fault(
            changed(of.told, rows, part, label=NEW), (_span(of, "divided group", rows, members),),
            _cause(of, _middle(rows), members, members[:0]),
        )  # fmt: skip


def engulfed(of: FaultScene) -> Iterator[Callable[[], Fault]]:
    """Yields pairs of groups in one; the larger is found if it is more than half of both."""
    windows = list(_windows(of))
    for k, rows, g, members in windows:
        for k2, _, h, others in windows:
            if k2 == k and h > g:
                yield lambda rows=rows, a=members, b=others: _one_group(of, rows, (a, b))


def _one_group(of: FaultScene, rows: slice, parts: tuple[Ints, ...]) -> Fault:
    """Returns the fault of one tracked group in place of several; it is one error, which names all their people."""
    every = np.concatenate(parts)
    lost = [part for part in parts if 2 * len(part) <= len(every)]
    causes = {_cause(of, _middle(rows), part, np.setdiff1d(every, part)) for part in lost}
    told = changed(of.told, rows, every, label=NEW)
    expected = (_span(of, "engulfed group", rows, every),) if lost else ()
    return Fault(told, expected, causes.pop() if len(causes) == 1 else None)


def strangers(of: FaultScene) -> Iterator[Callable[[], Fault]]:
    """Yields groups with as many people who belong to no group."""
    for k, rows, _, members in _windows(of):
        inside = slice(rows.start - 1, rows.stop + 1)
        lone = np.flatnonzero((of.there[inside] & (of.group[inside] < 0)).all(axis=0))
        if len(lone) >= len(members) and _quiet(of, lone, k):
            near = lone[np.argsort(np.hypot(*(of.pos[k, lone] - of.pos[k, members].mean(axis=0)).T))][: len(members)]
            yield lambda rows=rows, members=members, near=near: Fault(
                changed(of.told, rows, np.concatenate([members, near]), label=NEW),
                (_span(of, "strangers joined", rows, members),), _cause(of, _middle(rows), members, near),
            )  # fmt: skip


def false(of: FaultScene) -> Iterator[Callable[[], Fault]]:
    """Yields pairs of people who belong to no group."""
    n = of.frames(GAP)
    for k in range(1, len(of.there) - n - 1):
        lone = np.flatnonzero((of.there[k : k + n] & (of.group[k : k + n] < 0)).all(axis=0))
        pairs = [(a, b) for a in lone.tolist() for b in lone.tolist() if a < b]
        for a, b in pairs:
            two = np.array([a, b])
            if _quiet(of, two, k):
                yield lambda rows=slice(k, k + n), two=two: Fault(
                    changed(of.told, rows, two, label=NEW), (_span(of, "false group", rows, two),),
                    _cause(of, _middle(rows), two, two[:0], false=True),
                )  # fmt: skip


def late_splits(of: FaultScene) -> Iterator[Callable[[], Fault]]:
    """Yields splits that are reported late: the group is held together for some time."""
    for event, k, n, members in _events(of, ("split", "dissolve")):
        if len(np.unique(of.group[k - 1, members])) == 1 and of.group[k - 1, members[0]] >= 0:
            yield lambda event=event, k=k, n=n, members=members: _late_split(of, k, slice(k, k + n), members)


def _late_split(of: FaultScene, k: int, rows: slice, members: Ints) -> Fault:
    labels = of.group[k, members]
    parts = [members[labels == g] for g in np.unique(labels[labels >= 0])]
    told = changed(of.told, rows, members, label=NEW)
    if not parts:
        cause = _cause(of, _middle(rows), members, members[:0], false=True)
        return Fault(told, (_span(of, "late split", rows, members),), cause)
    lost = [part for part in parts if 2 * len(part) <= len(members)]
    causes = {_cause(of, _middle(rows), part, np.setdiff1d(members, part)) for part in lost}
    spans = tuple(_span(of, "late split", rows, part) for part in lost)
    return Fault(told, spans, causes.pop() if len(causes) == 1 else None)


def late_merges(of: FaultScene) -> Iterator[Callable[[], Fault]]:
    """Yields merges that are reported late: the groups before it are held for some time."""
    for _, k, n, members in _events(of, ("merge", "form")):
        if len(np.unique(of.group[k, members])) == 1:
            yield lambda k=k, n=n, members=members: _late_merge(of, k, slice(k, k + n), members)


def _late_merge(of: FaultScene, k: int, rows: slice, members: Ints) -> Fault:
    told, before = of.told, of.group[k - 1, members]
    for p, g in zip(members.tolist(), before.tolist(), strict=True):
        told = changed(told, rows, p, label=int(g))
    sizes = sorted(np.unique(before[before >= 0], return_counts=True)[1].tolist())
    # a group that is found, and whose members outside stand alone, is no error
    kept = bool(sizes) and 2 * sizes[-1] > len(members) and (len(sizes) == 1)
    spans = () if kept else (_span(of, "late merge", rows, members),)
    return Fault(told, spans, _cause(of, _middle(rows), members, members[:0]))


def _events(of: FaultScene, kinds: tuple[str, ...]) -> Iterator[tuple[GroupEvent, int, int, Ints]]:
    """Yields events, their first row, durations in which no label changes, and the members' columns."""
    for event in of.sequence.truth.events or ():
        k, members = event.start - 1, np.searchsorted(of.people, event.members)
        if event.kind not in kinds or k < 1 or not of.there[k - 1, members].all():
            continue
        around = of.group[k - 1 : k + 1]
        whole = np.flatnonzero(np.isin(around, around[:, members][around[:, members] >= 0]).any(axis=0))
        if not np.array_equal(whole, members):
            continue
        for n in range(2, of.frames(4 * SECOND)):
            steady, there = of.group[k : k + n + 1, members], of.there[k : k + n + 1, members]
            if len(steady) == n + 1 and (steady == steady[0]).all() and there.all():
                yield event, k, n, members


GROUPS = {
    "late split": late_splits, "late merge": late_merges, "missed group": missed, "divided group": divided,
    "engulfed group": engulfed, "strangers joined": strangers, "false group": false,
}  # fmt: skip
FAULTS = {
    **PEOPLE,
    **GROUPS,
    "missed group in clutter": missed_in_clutter,
}  # trackers of whole groups get no detections
