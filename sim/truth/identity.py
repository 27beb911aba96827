"""Keeps group ids through merges and splits, and names the change between two partitions. For truth and trackers alike.

A merge keeps the id of the parent with most members; a split gives it to the child with most members. To this end pairs
of an old and a new group are matched greedily, the pair with most people in common first. Ties go to the older group,
then to the smaller group id, then to the new group with the smallest person id. Groups with fewer than two people in
common are never the same group. New groups without a match get new ids.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

PersonSet = frozenset[int]
Members = Mapping[int, PersonSet]
ALONE = -1


@dataclass(frozen=True, slots=True)
class GroupChange:
    """What happened to a group between two partitions.

    kind: merge, split, form (people alone become a group), dissolve (a group becomes people alone), enter or leave;
    before, after: sorted ids of the groups concerned, -1 once for each person alone; members: sorted person ids.
    """

    kind: str
    before: tuple[int, ...]
    after: tuple[int, ...]
    members: tuple[int, ...]


def identify(old: Members, parts: Iterable[PersonSet], born: Mapping[int, int]) -> dict[PersonSet, int | None]:
    """Returns the old id that each new group keeps, None for a group that needs a new id.

    old: members of each group before; parts: the new partition, in which sets of one person are ignored; born: when
    each old group began.
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


def lineage(
    old: Members, new: Members, before: PersonSet, now: PersonSet, entered: PersonSet = frozenset()
) -> list[GroupChange]:
    """Returns what happened to the groups between two partitions, old groups first, each kind in order of the ids.

    old, new: members of each group; before, now: all people present; entered: people who count as having just entered
    though they are in both. People who are not in both have entered or left.

    A group that only grows or shrinks by such people gives no change. A new group enters if
    all its people have just entered, or all but one who was alone. An old group leaves if all its people have left, or
    all but one.
    """
    stay = (before & now) - entered
    was, is_ = _unit_of(old, before), _unit_of(new, now)
    unchanged = {g for g, people in old.items() if new.get(g) == people and people <= stay}
    found: list[GroupChange] = []
    for g in sorted(old.keys() - unchanged):
        found += _changes_of_old(g, old[g], stay, is_, now)
    for g in sorted(new.keys() - unchanged):
        found += _changes_of_new(g, new[g], stay, was)
    return found


def _unit_of(groups: Members, everybody: PersonSet) -> dict[int, int]:
    """The group id of each person; a person alone gets a negative number of their own."""
    unit = {p: -1 - k for k, p in enumerate(sorted(everybody))}
    return unit | {p: g for g, people in groups.items() for p in people}


def _names(units: Iterable[int]) -> tuple[int, ...]:
    """Sorted group ids, with -1 for each person alone."""
    return tuple(sorted(max(u, ALONE) for u in units))


def _changes_of_old(
    g: int, people: PersonSet, stay: PersonSet, is_: dict[int, int], now: PersonSet
) -> list[GroupChange]:
    """The split, dissolve or leave of an old group, if there is one."""
    left = people & stay
    targets = {is_[p] for p in left}
    if len(targets) > 1:
        kind = "dissolve" if max(targets) < 0 else "split"
        return [GroupChange(kind, (g,), _names(targets), tuple(sorted(people & now)))]
    if not left or (max(targets) < 0 and len(people) > 1):
        return [GroupChange("leave", (g,), _names(targets), tuple(sorted(people)))]
    return []


def _changes_of_new(g: int, people: PersonSet, stay: PersonSet, was: dict[int, int]) -> list[GroupChange]:
    """The merge, form or enter of a new group, if there is one."""
    sources = {was[p] for p in people & stay}
    if len(sources) > 1:
        kind = "form" if max(sources) < 0 else "merge"
        return [GroupChange(kind, _names(sources), (g,), tuple(sorted(people)))]
    if not sources or max(sources) < 0:
        return [GroupChange("enter", _names(sources), (g,), tuple(sorted(people)))]
    return []


@dataclass
class Identities:
    """Group ids through time.

    State: `groups`: members of each group; `born`: when each id began; `people`: all people present; `next_id`.
    """

    next_id: int = 1
    groups: dict[int, PersonSet] = field(default_factory=dict)
    born: dict[int, int] = field(default_factory=dict)
    people: PersonSet = frozenset()

    def step(
        self, t: int, people: PersonSet, parts: Iterable[PersonSet], entered: PersonSet = frozenset()
    ) -> list[GroupChange]:
        """Takes the partition of time t and returns what has changed; `groups` then has the new members by id.

        people: all people present; parts: the partition, in which people alone may be left out; entered: as in
        `lineage`. Times must not fall.
        """
        new: dict[int, PersonSet] = {}
        for part, kept in identify(self.groups, parts, self.born).items():
            g = self.next_id if kept is None else kept
            self.next_id += kept is None
            new[g] = part
            self.born.setdefault(g, t)
        changes = lineage(self.groups, new, self.people, people, entered)
        self.groups, self.people = new, people
        return changes
