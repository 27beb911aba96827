"""Which group is which: ids through merges and splits, and what became of whom. One rule for truth and trackers.

A merge keeps the id of the parent with most members, a split gives it to the child with most: of all pairs of an old
and a new group, those with most people in common are matched first. Ties: the older group, then the smaller id; among
children the one with the smaller person id. Fewer than two in common is not the same group. All others get fresh ids.
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
    """What happened between two partitions: before, after: sorted group ids, -1 once for each person alone."""

    kind: str
    before: tuple[int, ...]
    after: tuple[int, ...]
    members: tuple[int, ...]


def identify(old: Members, parts: Iterable[PersonSet], born: Mapping[int, int]) -> dict[PersonSet, int | None]:
    """The old id that each new group (2 or more people) keeps; None: it needs a fresh one.

    old: members of each group before; born: when each old group came up, smaller is older.
    """
    new = sorted((p for p in parts if len(p) > 1), key=min)
    same = {people: g for g, people in old.items()}  # mostly nothing has changed: no need to compare all with all
    kept: dict[PersonSet, int | None] = {part: same.get(part) for part in new}
    taken = {g for g in kept.values() if g is not None}
    was = {p: g for g, people in old.items() if g not in taken for p in people}
    shared = []
    for k, part in enumerate(new):
        if kept[part] is None:
            held = Counter(was[p] for p in part if p in was)
            shared += [(-n, born[g], g, k) for g, n in held.items()]
    for common, _, g, k in sorted(shared):
        if common <= -2 and g not in taken and kept[new[k]] is None:
            kept[new[k]] = g
            taken.add(g)
    return kept


def lineage(
    old: Members, new: Members, before: PersonSet, now: PersonSet, entered: PersonSet = frozenset()
) -> list[GroupChange]:
    """What happened to the groups between two partitions.

    before, now: all people of each. Who is not in both, and whoever is named in `entered`, came or went: a group
    that grows or shrinks so neither merges nor splits. One whose people are all new enters, also round one person who
    was there; one that is left with nobody, or with one, because others went, leaves.
    """
    stay = (before & now) - entered
    was, is_ = _unit_of(old, before), _unit_of(new, now)
    unchanged = {g for g, people in old.items() if new.get(g) == people and people <= stay}
    found: list[GroupChange] = []
    for g in sorted(old.keys() - unchanged):
        found += _of_old(g, old[g], stay, is_, now)
    for g in sorted(new.keys() - unchanged):
        found += _of_new(g, new[g], stay, was)
    return found


def _unit_of(groups: Members, everybody: PersonSet) -> dict[int, int]:
    """The group of each person; who is alone gets a negative number of their own."""
    unit = {p: -1 - k for k, p in enumerate(sorted(everybody))}
    return unit | {p: g for g, people in groups.items() for p in people}


def _names(units: Iterable[int]) -> tuple[int, ...]:
    return tuple(sorted(max(u, ALONE) for u in units))


def _of_old(g: int, people: PersonSet, stay: PersonSet, is_: dict[int, int], now: PersonSet) -> list[GroupChange]:
    """How an old group ended or fell into parts."""
    left = people & stay
    targets = {is_[p] for p in left}
    if len(targets) > 1:
        kind = "dissolve" if max(targets) < 0 else "split"
        return [GroupChange(kind, (g,), _names(targets), tuple(sorted(people & now)))]
    if not left or (max(targets) < 0 and len(people) > 1):
        return [GroupChange("leave", (g,), _names(targets), tuple(sorted(people)))]
    return []


def _of_new(g: int, people: PersonSet, stay: PersonSet, was: dict[int, int]) -> list[GroupChange]:
    """How a new group began or came together."""
    sources = {was[p] for p in people & stay}
    if len(sources) > 1:
        kind = "form" if max(sources) < 0 else "merge"
        return [GroupChange(kind, _names(sources), (g,), tuple(sorted(people)))]
    if not sources or max(sources) < 0:
        return [GroupChange("enter", _names(sources), (g,), tuple(sorted(people)))]
    return []


@dataclass
class Identities:
    """Groups through time. State: members of each living group, when each came up, the people there, the next id."""

    next_id: int = 1
    groups: dict[int, PersonSet] = field(default_factory=dict)
    born: dict[int, int] = field(default_factory=dict)
    people: PersonSet = frozenset()

    def step(
        self, t: int, people: PersonSet, parts: Iterable[PersonSet], entered: PersonSet = frozenset()
    ) -> list[GroupChange]:
        """Take the partition of time t (singles may be left out); `groups` then has its ids. Arguments as `lineage`."""
        new: dict[int, PersonSet] = {}
        for part, kept in identify(self.groups, parts, self.born).items():
            g = self.next_id if kept is None else kept
            self.next_id += kept is None
            new[g] = part
            self.born.setdefault(g, t)
        changes = lineage(self.groups, new, self.people, people, entered)
        self.groups, self.people = new, people
        return changes
