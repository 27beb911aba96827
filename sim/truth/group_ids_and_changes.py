"""Keeps group ids through merges and splits, and names the change between two partitions. For truth and trackers alike.

A partition divides the people of one moment into groups and people alone. A merge keeps the id of the parent with most
members; a split gives it to the child with most members. To this end pairs of an old and a new group are matched
greedily, the pair with most people in common first. Ties go to the older group, then to the smaller group id, then to
the new group with the smallest person id. Groups with fewer than two people in common are never the same group. New
groups without a match get new ids.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

PersonSet = frozenset[int]
Members = Mapping[int, PersonSet]
ALONE = -1
NOBODY: Members = {}


@dataclass(frozen=True, slots=True)
class GroupChange:
    """What happened to a group between two partitions of a crowd."""

    # merge, split, form (people alone become a group), dissolve (a group becomes people alone), enter or leave
    kind: str
    # before, after: sorted ids of the groups concerned; -1 once for each person alone; empty where nobody is concerned
    before: tuple[int, ...]
    after: tuple[int, ...]
    members: tuple[int, ...]  # sorted ids of the people concerned, as the caller numbers them


def identify(old: Members, parts: Iterable[PersonSet], born: Mapping[int, int]) -> dict[PersonSet, int | None]:
    """Returns for each part of two or more people the old id that it keeps, or None if it needs a new id.

    old: members of each group before, by id. parts: the new partition, disjoint sets of people. born: time at which
    each id in `old` began. The rules are in the module's text.
    """
    new = sorted((p for p in parts if len(p) > 1), key=min)
    same = {people: g for g, people in old.items()}  # mostly nothing has changed: no need to compare all with all
    kept: dict[PersonSet, int | None] = {part: same.get(part) for part in new}
    taken = {g for g in kept.values() if g is not None}
    was = {p: g for g, people in old.items() if g not in taken for p in people}
    shared = []
    for k, part in enumerate(new):
        if kept[part] is None:
            common_with = Counter(was[p] for p in part if p in was)
            shared += [(-n, born[g], g, k) for g, n in common_with.items()]
    for common, _, g, k in sorted(shared):
        if common <= -2 and g not in taken and kept[new[k]] is None:
            kept[new[k]] = g
            taken.add(g)
    return kept


def group_changes(old: Members, new: Members, before: PersonSet, now: PersonSet) -> list[GroupChange]:
    """Returns what happened to the groups between two partitions: changes of old groups first, each in order of id.

    old, new: members of each group, by id. before, now: all people present at the two times. `members` of a split or
    dissolve: the old group's people who are present now; of a leave: all people of the old group; of the other kinds:
    the new group's people.
    """
    stay = before & now
    was, is_ = _unit_of(old, before), _unit_of(new, now)
    unchanged = {g for g, people in old.items() if new.get(g) == people and people <= stay}
    found: list[GroupChange] = []
    for g in sorted(old.keys() - unchanged):
        people = old[g]
        targets = {is_[p] for p in people & stay}
        alone = max(targets, default=-1) < 0
        if len(targets) > 1:
            kind = "dissolve" if alone else "split"
            found.append(GroupChange(kind, (g,), _names(targets), tuple(sorted(people & now))))
        elif not targets or (alone and len(people) > 1):
            found.append(GroupChange("leave", (g,), _names(targets), tuple(sorted(people))))
    for g in sorted(new.keys() - unchanged):
        people = new[g]
        sources = {was[p] for p in people & stay}
        alone = max(sources, default=-1) < 0
        if len(sources) > 1 or alone:
            kind = "enter" if len(sources) < 2 else "form" if alone else "merge"
            found.append(GroupChange(kind, _names(sources), (g,), tuple(sorted(people))))
    return found


def _unit_of(groups: Members, everybody: PersonSet) -> dict[int, int]:
    """Returns the group id of each person; a person alone gets a negative number that no other person has."""
    unit = {p: -1 - k for k, p in enumerate(sorted(everybody))}
    return unit | {p: g for g, people in groups.items() for p in people}


def _names(units: Iterable[int]) -> tuple[int, ...]:
    return tuple(sorted(max(u, ALONE) for u in units))


@dataclass
class Identities:
    """Gives groups ids that last through time: a new object for each sequence, then one `step` for each partition.

    State: next_id: the next new id, from 1. groups: members of each present group, by id. born: time at which each id
    began, also for ended groups. people: all people present at the last step.
    """

    next_id: int = 1
    groups: dict[int, PersonSet] = field(default_factory=dict)  # members of each present group, by id
    # time (an integer such as a frame) at which each id began, of ended groups, too
    born: dict[int, int] = field(default_factory=dict)
    people: PersonSet = frozenset()  # all people present at the last time

    def name(self, t: int, parts: Iterable[PersonSet], known: Members) -> dict[int, PersonSet]:
        """Returns the parts of two or more people at time t, by id.

        A part keeps the id of a present group, or of a group in `known` (members of ended groups, by id), as `identify`
        says; otherwise it gets a new id.
        """
        new: dict[int, PersonSet] = {}
        for part, kept in identify({**known, **self.groups}, parts, self.born).items():
            g = self.next_id if kept is None else kept
            self.next_id += kept is None
            new[g] = part
            self.born.setdefault(g, t)
        return new

    def step(self, t: int, people: PersonSet, parts: Iterable[PersonSet], known: Members = NOBODY) -> list[GroupChange]:
        """Takes the partition at time t and returns the changes since the last step; at first all groups enter.

        people: all people present. parts: the partition. known: as for `name`.
        """
        new = self.name(t, parts, known)
        changes = group_changes(self.groups, new, self.people, people)
        self.groups, self.people = new, people
        return changes
