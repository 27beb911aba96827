"""From links between two people to groups over time: group ids in each frame, and events of membership.

A group is a connected component of linked people. Where the grouping says who is together *now*, these groups are
shown, with the ids of the linked groups that they stand for; events are those of the linked groups. Frames count from
0. Events are form, dissolve, merge, split, enter and leave; crossings and queues are not found here. Ids follow the
rule of the truth (sim.truth.group_ids_and_changes): a group that changes keeps its id where it shares most members.
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
from tracking.grouping.person_motion import frames_per_step


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


class GroupLabels:
    """The group ids and membership events of people, frame by frame.

    State: people, who is present and linked to whom, by id; last, the last frame of whoever is present; shown, the
    groups that are shown, by id; end, number of frames so far.
    """

    def __init__(self, fps: float, rule: LinkRule | Belief) -> None:
        self.memory, self.size = frames_of(rule.memory, fps), frames_per_step(fps)
        self.people, self.shown = LinkedPeople(), dict[int, PersonSet]()
        self.last, self.end = dict[int, int](), 0

    def add(
        self, frame: Ints, column: Ints, ids: Ints, motion: TrackedMotion, found: FoundGroups, end: int
    ) -> tuple[Ints, list[GroupEvent]]:
        """Adds the frames up to `end`. Returns the group id of each row (R,), from 1, -1 alone, and the membership
        events in order of `emitted`; members are ids, frames count from 1.

        frame, column (R,): frame, ascending, and person of each row, from 0. ids (K,): of the persons, ascending.
        motion: of these frames, too. found: of these frames.
        """
        first, links, events, state = self.end, found.links, list[GroupEvent](), self.people
        spells = self._spells(frame, ids[column], end)
        group, group_of = np.full(len(frame), -1), np.full(len(ids), -1)
        changes_now = _changes(found, self.size)
        cuts, rows = (np.searchsorted(x, np.arange(first, end + 1)) for x in (links.frame, frame))
        times = sorted({*spells, *changes_now, *links.frame.tolist()})

        def fill(since: int, until: int) -> None:
            for g, people in self.shown.items():
                group_of[np.searchsorted(ids, list(people))] = g
            lasting = slice(int(rows[since - first]), int(rows[until - first]))
            group[lasting] = group_of[column[lasting]]
            group_of[:] = -1

        fill(first, times[0] if times else end)
        for t, until in pairwise([*times, end]):
            for p, since in spells.get(t, ()):
                if since is None:
                    state.present.pop(p, None)
                else:
                    state.present[p] = since
            now = slice(int(cuts[t - first]), int(cuts[t - first + 1]))
            linked = ids[links.a[now]].tolist(), ids[links.b[now]].tolist(), links.on[now].tolist()
            switched = list(zip(*linked, links.sure[now].tolist(), strict=True))
            old = state.identities.groups
            for a, b, on, _ in switched:
                state.switch(a, b, on)
            changes = state.step(t, self.shown)
            parts = _together_now(found, t // self.size, ids, state)
            self.shown = state.identities.name(t, parts, self.shown)
            fill(t, until)
            joined, parted = (
                {frozenset((a, b)): sure for a, b, x, sure in switched if x == on} for on in (True, False)
            )
            real = [c for c in changes if not corrects(c, parted)]
            told = (
                event_of_change(c, t, parts_of_change(c, old, state), motion, late=True, met=were_apart(c, joined))
                for c in real
            )
            events += [e for e in told if e is not None]
        self.end = end
        return _without_singles(frame, group), events

    def forget(self, ids: Set[int]) -> None:
        """Forgets everybody but these people, and when groups began that are there no more."""
        linked = self.people.linked
        self.people.linked = {p: linked[p] & ids for p in linked.keys() & ids}
        named = self.people.identities
        named.born = {g: t for g, t in named.born.items() if g in named.groups or g in self.shown}

    def _spells(self, frame: Ints, id: Ints, end: int) -> dict[int, list[tuple[int, int | None]]]:
        """Returns by frame who comes, (person, frame), and whose spell ends, (person, None), after the last row."""
        order = np.lexsort((frame, id))
        before = np.array(sorted(self.last.items()), np.int64).reshape(-1, 2)
        id, frame = np.append(before[:, 0], id[order]), np.append(before[:, 1], frame[order])
        order = np.argsort(id, kind="stable")
        found, present = dict[int, list[tuple[int, int | None]]](), dict[int, int]()
        spells = stretches(id[order], frame[order], 1, self.memory + 1)
        for p, first, last in zip(*(x.tolist() for x in spells), strict=True):
            if first >= self.end:
                found.setdefault(first, []).append((p, first))
            if last + self.memory + 1 < end:
                found.setdefault(last + self.memory + 1, []).append((p, None))
            else:
                present[p] = last
        self.last = present
        return found


def _changes(found: FoundGroups, size: int) -> list[int]:
    """Returns the frames in which it changes who is together now."""
    if found.now is None or found.steps is None:
        return []
    now, before, length = found.now, found.steps.first - 1, found.steps.end - found.steps.first + 1
    changed = frames_of_change(now.step - before, now.person, now.group, length)
    return [(before + step) * size for step in changed]


def _together_now(found: FoundGroups, step: int, ids: Ints, state: LinkedPeople) -> Iterable[PersonSet]:
    """Returns the groups of a step, without people who are gone."""
    if found.now is None:
        return state.identities.groups.values()
    parts = dict[int, set[int]]()
    rows = slice(*np.searchsorted(found.now.step, (step, step + 1)))
    for p, g in zip(ids[found.now.person[rows]].tolist(), found.now.group[rows].tolist(), strict=True):
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


def _without_singles(frame: Ints, group: Ints) -> Ints:
    key = frame * (int(group.max(initial=0)) + 2) + group + 1
    _, place, count = np.unique(key, return_inverse=True, return_counts=True)
    return np.where(count[place] > 1, group, -1)
