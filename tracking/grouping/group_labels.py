"""Groups of linked people through time: labels, and what merges, splits, comes and goes, as it becomes known."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np

from sim.truth.identity import GroupChange, Identities, PersonSet, lineage
from sim.truth.merge_split_rules import frames_of
from sim.truth.proximity import stretches
from sim.types import Array, GroupEvent, Ints
from tracking.grouping.link_rule import Grouping, Links


@dataclass
class _Crowd:
    """One moment. State: who is here, and since when; who is linked to whom; the groups' identities."""

    here: dict[int, int] = field(default_factory=dict)
    linked: dict[int, set[int]] = field(default_factory=dict)
    identities: Identities = field(default_factory=Identities)

    def parts(self) -> list[PersonSet]:
        """Groups among those who are here: linked, or connected through others."""
        found, seen = [], set[int]()
        for p in sorted(self.here.keys() & self.linked.keys()):
            part, new = {p}, [] if p in seen else [p]
            while new:
                more = (self.linked[new.pop()] & self.here.keys()) - part
                part |= more
                new += more
            seen |= part
            found += [frozenset(part)] if len(part) > 1 else []
        return found

    def switch(self, a: int, b: int, on: bool) -> None:
        """A link comes or goes."""
        for p, q in ((a, b), (b, a)):
            partners = self.linked.setdefault(p, set())
            (partners.add if on else partners.discard)(q)


def label_people(
    frame: Ints, column: Ints, pos: Array, links: Links, fps: float, rule: Grouping
) -> tuple[Ints, list[GroupEvent]]:
    """Group of each row (R,), -1 alone, and the events of membership; rows sorted by frame (from 0), pos (T, P, 2).

    Groups wait `memory` seconds for a member who is not seen; two of them must be seen to be one. Events name people
    by column + 1.
    """
    spell = _spells(frame, column, frames_of(rule.memory, fps), len(pos))
    crowd, events = _Crowd(), []
    group = np.full(pos.shape[:2], -1, np.int64)
    late = frames_of(rule.arrival, fps)
    cuts = np.searchsorted(links.frame, np.arange(len(pos) + 1))
    for t, until in pairwise([*sorted({*spell, *links.frame.tolist()}), len(pos)]):
        for p, since in spell.get(t, ()):
            _come_or_go(crowd, p, since)
        now = slice(int(cuts[t]), int(cuts[t + 1]))
        turned = list(zip(*(getattr(links, k)[now].tolist() for k in ("a", "b", "on", "since")), strict=True))
        for a, b, on, _ in turned:
            crowd.switch(a, b, on)
        changes = crowd.identities.step(t, frozenset(crowd.here), crowd.parts(), _arrivals(crowd, turned, late))
        for g, people in crowd.identities.groups.items():
            group[t:until, sorted(people)] = g
        events += [e for c in changes if (e := _event(c, t, turned, pos, late)) is not None]
    return _seen_only(frame, group[frame, column]), events


def _spells(frame: Ints, column: Ints, memory: int, length: int) -> dict[int, list[tuple[int, int | None]]]:
    """By frame: who comes (column, frame) and whose memory ends (column, None)."""
    order = np.lexsort((frame, column))
    found: dict[int, list[tuple[int, int | None]]] = {}
    for p, first, last in zip(*stretches(column[order], frame[order], 1, memory + 1), strict=True):
        found.setdefault(int(first), []).append((int(p), int(first)))
        if last + memory + 1 < length:
            found.setdefault(int(last) + memory + 1, []).append((int(p), None))
    return found


def _come_or_go(crowd: _Crowd, p: int, since: int | None) -> None:
    if since is None:
        crowd.here.pop(p, None)
    else:
        crowd.here[p] = since


def _arrivals(crowd: _Crowd, turned: Iterable[tuple[int, int, bool, int]], late: int) -> PersonSet:
    """Who has come linked, or nearly: their link began soon after they did, and they were in no group yet."""
    grouped = {p for people in crowd.identities.groups.values() for p in people}
    return frozenset(
        p for a, b, on, since in turned if on for p in (a, b)
        if p not in grouped and p in crowd.here and since <= crowd.here[p] + late
    )  # fmt: skip


def _seen_only(frame: Ints, group: Ints) -> Ints:
    """Labels (R,) without groups of which only one is seen in a frame."""
    key = frame * (int(group.max(initial=0)) + 2) + group + 1
    _, place, count = np.unique(key, return_inverse=True, return_counts=True)
    return np.where(count[place] > 1, group, -1)


def _event(
    change: GroupChange, t: int, turned: Iterable[tuple[int, int, bool, int]], pos: Array, late: int
) -> GroupEvent | None:
    """The event of a change that is known at t; None for groups that were there when the sequence began."""
    people = set(change.members)
    joins = change.kind in ("merge", "form", "enter")
    onsets = [since for a, b, on, since in turned if on == joins and a in people and b in people]
    start = min(onsets, default=t)
    if change.kind == "leave":
        seen = np.isfinite(pos[: t + 1, change.members, 0]).sum(axis=1)
        start = int(np.flatnonzero(seen > 1)[-1])
    if change.kind == "enter" and start <= late:
        return None
    end = start if change.kind in ("enter", "leave") else t
    return _at(change, start, end, t, pos)


def _at(change: GroupChange, start: int, end: int, t: int, pos: Array) -> GroupEvent:
    """The event where its people are when it starts, or were last."""
    places = pos[max(start - 20, 0) : t + 1, change.members]
    known = np.flatnonzero(np.isfinite(places[..., 0]).sum(axis=1))
    nearest = known[np.abs(known - (start - max(start - 20, 0))).argmin()]
    x, y = np.nanmean(places[nearest], axis=0)
    members = tuple(p + 1 for p in change.members)
    return GroupEvent(
        change.kind, start + 1, end + 1, t + 1, change.before, change.after, members, (float(x), float(y))
    )


def label_changes(group: Ints, pos: Array) -> list[GroupEvent]:
    """The events of membership in labels (T, P) that a tracker gave, -1 alone; pos (T, P, 2), nan absent."""
    there = np.isfinite(pos).all(axis=2)
    state = np.where(there, group, -2)
    turns = np.flatnonzero((np.diff(state, axis=0) != 0).any(axis=1)) + 1
    events, old, before = [], _groups_of(state[0]), _people_of(state[0])
    for t in turns.tolist():
        new, now = _groups_of(state[t]), _people_of(state[t])
        changes = lineage(old, new, before, now)
        events += [_at(c, t - (c.kind == "leave"), t - (c.kind == "leave"), t, pos) for c in changes]
        old, before = new, now
    return events


def _groups_of(state: Ints) -> dict[int, PersonSet]:
    found: dict[int, set[int]] = {}
    for p in np.flatnonzero(state >= 0).tolist():
        found.setdefault(int(state[p]), set()).add(p)
    return {g: frozenset(people) for g, people in found.items() if len(people) > 1}


def _people_of(state: Ints) -> PersonSet:
    return frozenset(np.flatnonzero(state != -2).tolist())
