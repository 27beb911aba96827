"""From links between two people to groups over time: the group id of each person in each frame, and the events.

A group is a connected component of linked people. Ids follow the identity rule of the truth (sim.truth.identity).
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np

from sim.truth.identity import Identities, PersonSet
from sim.truth.merge_split_rules import frames_of
from sim.truth.proximity import stretches
from sim.types import Array, GroupEvent, Ints
from tracking.grouping.link_rule import LinkRule, Links
from tracking.grouping.merge_split_events import LinkSwitch, event_of_change


@dataclass
class _LinkedPeople:
    """State at one moment. People are columns.

    present: the frame since which each person has been present; a missed person stays present for `memory` s.
    linked: the partners of each person. identities: the groups and their ids.
    """

    present: dict[int, int] = field(default_factory=dict)
    linked: dict[int, set[int]] = field(default_factory=dict)
    identities: Identities = field(default_factory=Identities)

    def components(self) -> list[PersonSet]:
        """Connected components, of two or more, of the present people."""
        found, seen = [], set[int]()
        for p in sorted(self.present.keys() & self.linked.keys()):
            part, new = {p}, [] if p in seen else [p]
            while new:
                more = (self.linked[new.pop()] & self.present.keys()) - part
                part |= more
                new += more
            seen |= part
            found += [frozenset(part)] if len(part) > 1 else []
        return found

    def switch(self, a: int, b: int, on: bool) -> None:
        """Set or remove the link between two people."""
        for p, q in ((a, b), (b, a)):
            partners = self.linked.setdefault(p, set())
            (partners.add if on else partners.discard)(q)


def label_people(
    frame: Ints, column: Ints, pos: Array, links: Links, fps: float, rule: LinkRule
) -> tuple[Ints, list[GroupEvent]]:
    """Return the group id of each row (R,), -1 for a person alone, and the membership events in order of `emitted`.

    frame, column (R,) of the rows, sorted by frame (from 0); pos (T, P, 2) in m by frame and column, nan where absent;
    links: of the whole sequence. In the events people are columns + 1 and frames count from 1.
    A member who is not seen stays in the group for `rule.memory` s. In a frame in which only one member of a group is
    seen, that member's label is -1.
    """
    spells = _spells(frame, column, frames_of(rule.memory, fps), len(pos))
    state, events = _LinkedPeople(), []
    group = np.full(pos.shape[:2], -1, np.int64)
    arrival = frames_of(rule.arrival, fps)
    cuts = np.searchsorted(links.frame, np.arange(len(pos) + 1))
    for t, until in pairwise([*sorted({*spells, *links.frame.tolist()}), len(pos)]):
        for p, since in spells.get(t, ()):
            _come_or_go(state, p, since)
        now = slice(int(cuts[t]), int(cuts[t + 1]))
        switched = list(zip(*(getattr(links, k)[now].tolist() for k in ("a", "b", "on", "since")), strict=True))
        for a, b, on, _ in switched:
            state.switch(a, b, on)
        entered = _entered(state, switched, arrival)
        changes = state.identities.step(t, frozenset(state.present), state.components(), entered)
        for g, people in state.identities.groups.items():
            group[t:until, sorted(people)] = g
        events += [e for c in changes if (e := event_of_change(c, t, switched, pos, arrival)) is not None]
    return _without_singles(frame, group[frame, column]), events


def _spells(frame: Ints, column: Ints, memory: int, length: int) -> dict[int, list[tuple[int, int | None]]]:
    """By frame: the people who come (column, frame) and those whose memory ends (column, None).

    A gap of at most `memory` frames does not end a spell.
    """
    order = np.lexsort((frame, column))
    found: dict[int, list[tuple[int, int | None]]] = {}
    for p, first, last in zip(*stretches(column[order], frame[order], 1, memory + 1), strict=True):
        found.setdefault(int(first), []).append((int(p), int(first)))
        if last + memory + 1 < length:
            found.setdefault(int(last) + memory + 1, []).append((int(p), None))
    return found


def _come_or_go(state: _LinkedPeople, p: int, since: int | None) -> None:
    if since is None:
        state.present.pop(p, None)
    else:
        state.present[p] = since


def _entered(state: _LinkedPeople, switched: Iterable[LinkSwitch], arrival: int) -> PersonSet:
    """People in no group whose new link began within `arrival` frames of their first frame: they enter with it."""
    grouped = {p for people in state.identities.groups.values() for p in people}
    return frozenset(
        p for a, b, on, since in switched if on for p in (a, b)
        if p not in grouped and p in state.present and since <= state.present[p] + arrival
    )  # fmt: skip


def _without_singles(frame: Ints, group: Ints) -> Ints:
    """Labels (R,) in which a group that has only one row in a frame is -1 there."""
    key = frame * (int(group.max(initial=0)) + 2) + group + 1
    _, place, count = np.unique(key, return_inverse=True, return_counts=True)
    return np.where(count[place] > 1, group, -1)
