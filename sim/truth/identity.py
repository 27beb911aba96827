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


@dataclass(frozen=True, slots=True)
class GroupChange:
    """What happened to a group between two partitions of a crowd.

    - kind: merge, split, form (people alone become a group), dissolve (a group becomes people alone), enter or leave.
    - before, after: sorted ids of the groups concerned; -1 once for each person alone; empty where nobody is concerned.
    - members: sorted ids of the people concerned, as the caller numbers them.
    """

    kind: str
    before: tuple[int, ...]
    after: tuple[int, ...]
    members: tuple[int, ...]


def identify(old: Members, parts: Iterable[PersonSet], born: Mapping[int, int]) -> dict[PersonSet, int | None]:
    """Returns for each new group of two or more people the id that it keeps, or None if it needs a new id.

    old: members of each group before, by id. parts: the new partition, disjoint sets; sets of one person are ignored.
    born: time at which each id in `old` began; a missing one raises KeyError. A group with the same members keeps its
    id. The remaining old and new groups are matched greedily, most common members first; ties go to the older, then the
    smaller id, then the new group with the smallest person. Fewer than two common members never match.
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
    """Returns what happened to the groups between two partitions, old groups first, each in order of group id.

    old, new: members of each group by id. before, now: all people present. entered: people who count as having just
    entered though they are in both. People who are in only one of before and now have left or entered. People who stay
    are in both.

    - split: the people of an old group who stay are now in several groups, or in groups and alone; dissolve: two or
      more stay and all are alone.
    - merge: the people of a new group who stay were in several groups, or in groups and alone; form: two or more stay
      and all were alone.
    - enter: all people of a new group have just entered, or all but one who was alone.
    - leave: all people of an old group have left, or all but one who is now alone.

    `members` of a split or dissolve are the old group's people present now, of a leave all its old people, else all
    people of the new group. A group that only grows or shrinks by people who enter or leave gives no change.
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
    """Returns the group id of each person of `everybody`; a person alone gets a negative number that no other person
    has.

    groups: members by group id; they are in the result even if not in `everybody`.
    """
    unit = {p: -1 - k for k, p in enumerate(sorted(everybody))}
    return unit | {p: g for g, people in groups.items() for p in people}


def _names(units: Iterable[int]) -> tuple[int, ...]:
    """Returns the numbers of `units` sorted, with every negative number (a person alone) replaced by -1."""
    return tuple(sorted(max(u, ALONE) for u in units))


def _changes_of_old(
    g: int, people: PersonSet, stay: PersonSet, is_: dict[int, int], now: PersonSet
) -> list[GroupChange]:
    """Returns the split, dissolve or leave of the old group g as a list of one, or [] if it goes on or only merges.

    - Two or more of its people who stay are apart now: dissolve if all of them are alone, else split. Its `members` are
      the people present now.
    - Nobody stays, or one person who is alone now: leave. Its `members` are all old people.

    people: its members before. stay: people present before and now. is_: group id of each person now, negative if alone
    (each another number). now: all people present now.
    """
    left = people & stay
    targets = {is_[p] for p in left}
    if len(targets) > 1:
        kind = "dissolve" if max(targets) < 0 else "split"
        return [GroupChange(kind, (g,), _names(targets), tuple(sorted(people & now)))]
    if not left or (max(targets) < 0 and len(people) > 1):
        return [GroupChange("leave", (g,), _names(targets), tuple(sorted(people)))]
    return []


def _changes_of_new(g: int, people: PersonSet, stay: PersonSet, was: dict[int, int]) -> list[GroupChange]:
    """Returns the merge, form or enter of the new group g as a list of one, or [] if it only continues one old group.

    - Two or more of its people who stayed were apart: form if all of them were alone, else merge.
    - Nobody was there before, or only one person who was alone: enter.

    `members` are always all people of the new group. people: its members now. stay: people present before and now. was:
    group id of each person before, negative if alone (each another number).
    """
    sources = {was[p] for p in people & stay}
    if len(sources) > 1:
        kind = "form" if max(sources) < 0 else "merge"
        return [GroupChange(kind, _names(sources), (g,), tuple(sorted(people)))]
    if not sources or max(sources) < 0:
        return [GroupChange("enter", _names(sources), (g,), tuple(sorted(people)))]
    return []


@dataclass
class Identities:
    """Gives groups ids that last through time: a new object for each sequence, then one `step` for each partition.

    State: next_id: the next new id, from 1. groups: members of each present group, by id. born: time (an integer such
    as a frame) at which each id began, of ended groups, too. people: all people present at the last time.
    """

    next_id: int = 1
    groups: dict[int, PersonSet] = field(default_factory=dict)
    born: dict[int, int] = field(default_factory=dict)
    people: PersonSet = frozenset()

    def step(
        self, t: int, people: PersonSet, parts: Iterable[PersonSet], entered: PersonSet = frozenset()
    ) -> list[GroupChange]:
        """Takes the partition of time t and returns what has changed since the last call; updates groups, born, people
        and next_id.

        people: all people present. parts: the partition, disjoint sets; people alone may be left out. entered: people
        who count as having just entered although they were present before. t must not fall from call to call. At the
        first call all groups enter. The changes of old groups come first, each in order of group id; [] if nothing
        changed.
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
