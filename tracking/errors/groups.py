"""Errors of groups: which true groups are not found, from when to when and how; and groups of strangers.

A true group is found in a frame if an estimated group has more than half of the people of both (group_F1). A group
that is not found is in one of these states; a stretch of frames in one state is an error:

    unseen            too few members are tracked: errors of people, not of the group
    missed group      its tracked members are in no group
    divided group     its tracked members are in several groups, or some of them in none
    engulfed group    most of it is in one group with most of another true group
    strangers joined  most of it is in one group with too many others

A stretch that begins with a true merge is a *late merge*, or a *missed merge* if the group is not found before it ends;
one that begins with a true split likewise. A missed group that begins with the group itself and is found later is a
*late group*. A *false group* has no true group in part or whole.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from sim.types import Bools, GroupEvent, Ints

AT_THE_EVENT = 1.0  # s: a stretch that begins so soon after an event belongs to it
JOINS, PARTS = ("merge", "form"), ("split", "dissolve")
ALONE = -1
MISSED, DIVIDED, ENGULFED, STRANGERS = "missed group", "divided group", "engulfed group", "strangers joined"


@dataclass(frozen=True)
class GroupError:
    """One error of a true group, or a false group."""

    kind: str
    start: int  # first frame
    end: int  # last frame
    group: int | None  # id of the true group, None for a false one
    people: tuple[int, ...]  # ids of its people; of a false group, of the true people in it
    others: tuple[int, ...]  # ids of further true people in the estimated groups
    rows: tuple[int, ...]  # tracked rows that belong together; () for a false group
    alone: tuple[int, ...]  # tracked rows in the estimated groups that belong to no group


@dataclass(frozen=True, eq=False)
class Memberships:
    """Who is in which group in the labelled frames, on both sides; groups of one person count as none."""

    true: dict[int, dict[int, list[int]]]  # by frame, the true rows of each true group
    est: dict[int, dict[int, list[int]]]  # by frame, the tracked rows of each estimated group
    track: Ints  # (R,) tracked row of each true row, -1 none
    person: Ints  # (S,) true row of each tracked row, -1 none

    @property
    def frames(self) -> list[int]:
        """Labelled frames with a group on either side."""
        return sorted({*self.true, *self.est})


def memberships(
    true: tuple[Ints, Ints], est: tuple[Ints, Ints], track: Ints, person: Ints, labelled: Bools
) -> Memberships:
    """Returns the memberships; true, est: frame and group of each row, group -1 alone; labelled by frame number."""
    return Memberships(_by_frame(*true, labelled), _by_frame(*est, labelled), track, person)


def _by_frame(frame: Ints, group: Ints, labelled: Bools) -> dict[int, dict[int, list[int]]]:
    found: dict[int, dict[int, list[int]]] = {}
    rows = np.flatnonzero((group != ALONE) & labelled[frame])
    for row, f, g in zip(rows.tolist(), frame[rows].tolist(), group[rows].tolist(), strict=True):
        found.setdefault(f, {}).setdefault(g, []).append(row)
    several = {f: {g: rows for g, rows in groups.items() if len(rows) > 1} for f, groups in found.items()}
    return {f: groups for f, groups in several.items() if groups}


def group_f1(of: Memberships) -> float:
    """Returns 2 found / (true + estimated groups), nan without groups."""
    count = sum(len(groups) for side in (of.true, of.est) for groups in side.values())
    found = sum(state == "found" for frame in of.frames for _, state in states(of, frame))
    return 2 * found / count if count else float("nan")


def states(of: Memberships, frame: int) -> Iterator[tuple[int, str]]:
    """Yields each true group of a frame with its state."""
    true, est = of.true.get(frame, {}), of.est.get(frame, {})
    home = {row: e for e, rows in est.items() for row in rows}
    inside = {g: Counter(home[j] for j in of.track[rows].tolist() if j in home) for g, rows in true.items()}
    for g, rows in true.items():
        seen = int((of.track[rows] >= 0).sum())
        e, common = max(inside[g].items(), key=lambda item: item[1], default=(ALONE, 0))
        if 3 * common > len(rows) + len(est.get(e, ())):
            yield g, "found"
        elif 2 * seen <= len(rows):
            yield g, "unseen"
        elif not common:
            yield g, MISSED
        elif 2 * common <= len(rows):
            yield g, DIVIDED
        else:
            most = (h for h, counts in inside.items() if h != g and 2 * counts[e] > len(true[h]))
            yield g, STRANGERS if next(most, None) is None else ENGULFED


def group_errors(of: Memberships, ids: Ints, events: Sequence[GroupEvent], fps: float) -> list[GroupError]:
    """Returns all errors of groups, by start; ids (R,): id of each true row; events: of the truth."""
    found = [*_errors_of_groups(of, ids), *_false_groups(of, ids)]
    named = [_named(error, of, events, AT_THE_EVENT * fps) for error in found]
    return sorted(named, key=lambda error: (error.start, error.end, error.kind))


def _errors_of_groups(of: Memberships, ids: Ints) -> Iterator[GroupError]:
    by_group: dict[int, list[tuple[int, str]]] = {}
    for frame in of.frames:
        for g, state in states(of, frame):
            by_group.setdefault(g, []).append((frame, state))
    for g, over_time in by_group.items():
        for kind, frames in _stretches(over_time):
            if kind in ("found", "unseen"):
                continue
            members = [row for frame in frames for row in of.true[frame][g]]
            rows = [j for j in of.track[members].tolist() if j >= 0]
            others, alone = _others(of, frames, set(rows))
            people = _ids(of, rows, ids)
            beside = tuple(id for id in _ids(of, others, ids) if id not in people)
            yield GroupError(kind, frames[0], frames[-1], g, people, beside, tuple(rows), tuple(alone))


def _ids(of: Memberships, rows: Iterable[int], ids: Ints) -> tuple[int, ...]:
    """Returns the ids of the true people of some tracked rows."""
    return tuple(sorted({int(ids[of.person[j]]) for j in rows if of.person[j] >= 0}))


def _stretches(over_time: list[tuple[int, str]]) -> Iterator[tuple[str, list[int]]]:
    frames: list[int] = []
    for k, (frame, state) in enumerate(over_time):
        frames.append(frame)
        if k + 1 == len(over_time) or over_time[k + 1] != (frame + 1, state):
            yield state, frames
            frames = []


def _others(of: Memberships, frames: list[int], mine: set[int]) -> tuple[list[int], list[int]]:
    """Returns the tracked rows of others in estimated groups with some of `mine`; and those that belong to no group."""
    others, alone = [], []
    for frame in frames:
        grouped = _grouped(of, frame)
        for rows in of.est.get(frame, {}).values():
            if mine.intersection(rows):
                others += [j for j in rows if j not in mine]
                alone += [j for j in rows if j not in grouped]
    return others, alone


def _grouped(of: Memberships, frame: int) -> set[int]:
    """Returns the tracked rows of a frame whose people are in a true group."""
    return {j for rows in of.true.get(frame, {}).values() for j in of.track[rows].tolist()}


def _false_groups(of: Memberships, ids: Ints) -> Iterator[GroupError]:
    over_time: dict[int, list[tuple[int, str]]] = {}
    for frame, groups in of.est.items():
        grouped = _grouped(of, frame)
        for e, rows in groups.items():
            if not grouped.intersection(rows):
                over_time.setdefault(e, []).append((frame, "false group"))
    for e, frames_of in over_time.items():
        for kind, frames in _stretches(frames_of):
            rows = [j for frame in frames for j in of.est[frame][e]]
            yield GroupError(kind, frames[0], frames[-1], None, _ids(of, rows, ids), (), (), tuple(rows))


def _named(error: GroupError, of: Memberships, events: Sequence[GroupEvent], reach: float) -> GroupError:
    """Returns the error with the name of the true event that it begins with, if there is one."""
    if error.group is None:
        return error
    for event in events:
        ours = error.group in (*event.before, *event.after) or set(error.people) & set(event.members)
        if not ours or not event.start - 1 <= error.start <= event.start + reach:
            continue
        if event.kind in JOINS and error.kind in (MISSED, DIVIDED):
            return replace(error, kind=f"{_when(error, of)} merge")
        if event.kind in PARTS and error.kind in (ENGULFED, STRANGERS):
            return replace(error, kind=f"{_when(error, of)} split")
    first = min(frame for frame in of.true if error.group in of.true[frame])
    late = error.kind == MISSED and error.start <= first + reach and _when(error, of) == "late"
    return replace(error, kind="late group") if late else error


def _when(error: GroupError, of: Memberships) -> str:
    """Returns "late" if the group is found after the error, else "missed"."""
    later = (frame for frame in of.frames if frame > error.end and error.group in of.true.get(frame, {}))
    found = any(state == "found" for frame in later for g, state in states(of, frame) if g == error.group)
    return "late" if found else "missed"
