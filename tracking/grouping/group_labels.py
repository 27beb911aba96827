"""From links between two people to groups over time: group ids in each frame, and events of membership.

A group is a connected component of linked people. Where the grouping says who is together *now*, these groups are
shown, with the ids of the linked groups that they stand for; events are those of the linked groups. People are numbered
as columns of arrays by frame and person, from 0; frames count from 0. Events are form, dissolve, merge, split, enter
and leave; crossings and queues are not found here. Ids follow the rule of the truth
(sim.truth.group_ids_and_changes): a group that changes keeps its id where it shares most members.
"""

from __future__ import annotations

from collections.abc import Iterable, Set
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np

from sim.truth.group_ids_and_changes import GroupChange, Identities, Members, PersonSet
from sim.truth.merge_split_rules import frames_of, stretches
from sim.truth.motion_rows import frames_of_change
from sim.types import GroupEvent, Ints
from tracking.grouping.belief import Belief
from tracking.grouping.belief_groups import FoundGroups
from tracking.grouping.group_events import Parts, TrackedMotion, corrects, event_of_change, were_apart
from tracking.grouping.link_rule import LinkRule


@dataclass
class LinkedPeople:
    """Who is present and who is linked to whom at one moment. A person is a number, such as a column or a track id."""

    # dict by person: the frame since which the person has been present; the caller decides how long a person who is
    # missed stays present
    present: dict[int, int] = field(default_factory=dict)
    # dict by person, the set of people with a link to the person, present or not
    linked: dict[int, set[int]] = field(default_factory=dict)
    # the groups of the last step, with members (people) and ids (from 1)
    identities: Identities = field(default_factory=Identities)

    def components(self) -> list[PersonSet]:
        """Returns the groups: connected components of two or more present, linked people, in order of lowest number."""
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

    def step(self, t: int, known: Members) -> list[GroupChange]:
        """Returns the changes of the groups in frame t; the caller updates `present` and the links before.

        known: groups by id, from which a new group takes over the id.
        """
        return self.identities.step(t, frozenset(self.present), self.components(), known)

    def switch(self, a: int, b: int, on: bool) -> None:
        """Sets (`on` True) or removes (False) the link between two people; no effect if it is already so."""
        for p, q in ((a, b), (b, a)):
            partners = self.linked.setdefault(p, set())
            (partners.add if on else partners.discard)(q)


def label_people(
    frame: Ints, column: Ints, motion: TrackedMotion, found: FoundGroups, rule: LinkRule | Belief
) -> tuple[Ints, list[GroupEvent]]:
    """Returns the group id of each row (R,), from 1, -1 alone, and the membership events in order of `emitted`. frame,
    column (R,): frame, ascending, and person of each row, from 0. In events members are columns + 1, frames from 1."""
    length = motion.rows.length
    spells = _spells(frame, column, frames_of(rule.memory, motion.fps), length)
    state, events = LinkedPeople(), []
    group, group_of = np.full(len(frame), -1), np.full(int(column.max(initial=0)) + 1, -1)
    links, shown, changes_now = found.links, dict[int, PersonSet](), _changes(found)
    cuts, rows = (np.searchsorted(x, np.arange(length + 1)) for x in (links.frame, frame))
    for t, until in pairwise([*sorted({*spells, *changes_now, *links.frame.tolist()}), length]):
        for p, since in spells.get(t, ()):
            if since is None:
                state.present.pop(p, None)
            else:
                state.present[p] = since
        now = slice(int(cuts[t]), int(cuts[t + 1]))
        switched = list(zip(*(getattr(links, k)[now].tolist() for k in ("a", "b", "on", "sure")), strict=True))
        old = state.identities.groups
        for a, b, on, _ in switched:
            state.switch(a, b, on)
        changes = state.step(t, shown)
        shown = state.identities.name(t, _together_now(found, t, state), shown)
        for g, people in shown.items():
            group_of[list(people)] = g
        lasting = slice(int(rows[t]), int(rows[until]))
        group[lasting] = group_of[column[lasting]]
        for people in shown.values():
            group_of[list(people)] = -1
        joined, parted = ({frozenset((a, b)): sure for a, b, x, sure in switched if x == on} for on in (True, False))
        real = [c for c in changes if not corrects(c, parted)]
        told = (
            event_of_change(c, t, parts_of_change(c, old, state), motion, late=True, met=were_apart(c, joined))
            for c in real
        )
        events += [e for e in told if e is not None]
    return _without_singles(frame, group), events


def _changes(found: FoundGroups) -> list[int]:
    """Returns the frames in which it changes who is together now."""
    if found.now is None:
        return []
    changed = frames_of_change(found.now.step, found.now.person, found.now.group, found.now.shape[0])
    return [step * found.size for step in changed]


def _together_now(found: FoundGroups, t: int, state: LinkedPeople) -> Iterable[PersonSet]:
    """Returns the groups of frame t, without people who are gone."""
    if found.now is None:
        return state.identities.groups.values()
    parts, step = dict[int, set[int]](), t // found.size
    rows = slice(*np.searchsorted(found.now.step, (step, step + 1)))
    for p, g in zip(found.now.person[rows].tolist(), found.now.group[rows].tolist(), strict=True):
        parts.setdefault(g, set()).update({p} & state.present.keys())
    return [frozenset(people) for people in parts.values() if len(people) > 1]


def parts_of_change(change: GroupChange, old: Members, state: LinkedPeople) -> Parts:
    """Returns the parts that a change joined, or into which it divided a group, and since when all are present. old:
    the groups by id before the change."""
    parts = part_sets(change, old, state.identities.groups, frozenset(state.present.keys() & set(change.members)))
    since = max((min(state.present[p] for p in part) for part in parts), default=0)
    return Parts(parts, since, gone_people(change, old, state.present.keys()))


def gone_people(change: GroupChange, old: Members, present: Set[int]) -> PersonSet:
    """Returns the people of a group that a change divided who are present no more; nobody for other changes."""
    return old[change.before[0]] - present if change.kind in ("split", "dissolve") else frozenset()


def part_sets(change: GroupChange, old: Members, new: Members, people: PersonSet) -> list[PersonSet]:
    """Returns the parts that a change joined, or divided a group into: groups, cut to `people`, then people alone. old,
    new: the groups by id before and after the change."""
    groups, names = (new, change.after) if change.kind in ("split", "dissolve") else (old, change.before)
    parts = [part for g in names if g >= 0 and (part := groups[g] & people)]
    return parts + [frozenset([p]) for p in sorted(people.difference(*parts))]


def _spells(frame: Ints, column: Ints, memory: int, length: int) -> dict[int, list[tuple[int, int | None]]]:
    """Returns by frame who comes, (column, frame), and whose spell ends, (column, None), after the last row."""
    order = np.lexsort((frame, column))
    found: dict[int, list[tuple[int, int | None]]] = {}
    for p, first, last in zip(*stretches(column[order], frame[order], 1, memory + 1), strict=True):
        found.setdefault(int(first), []).append((int(p), int(first)))
        if last + memory + 1 < length:
            found.setdefault(int(last) + memory + 1, []).append((int(p), None))
    return found


def _without_singles(frame: Ints, group: Ints) -> Ints:
    key = frame * (int(group.max(initial=0)) + 2) + group + 1
    _, place, count = np.unique(key, return_inverse=True, return_counts=True)
    return np.where(count[place] > 1, group, -1)
