"""From the probability that two people walk together, in each frame, to groups with ids and events (ours).

The groups, ids and events are those of tracking.grouping, one frame after the other:
    groups     average linkage of log odds, with hysteresis      linkage_kernels.linked_groups
    ids        identity rule                                     group_labels.LinkedPeople
    events     changes of groups, dated back to their onset      merge_split_events.event_of_change
Only people who were measured within the last MEMORY s make groups. A person who is missed for longer tells nothing
about others: the person stays in the group to which the relation is strongest, and holds no parts together.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field, replace

import numpy as np

from sim.truth.identity import GroupChange
from sim.truth.merge_split_rules import frames_of
from sim.types import Array, Bools, GroupEvent, Ints
from tracking.grouping.group_labels import LinkedPeople, parts_of_change
from tracking.grouping.link_rule import ARRIVAL
from tracking.grouping.linkage_kernels import linked_groups
from tracking.grouping.merge_split_events import LinkSwitch, Parts, TrackedMotion, event_of_change

STAY = 3.0
"""Log odds added for people who were in one group in the frame before."""
COME = 1.3
"""Log odds taken for all other people."""
SURE = 0.001
"""Probabilities of pairs are taken at least so far from 0 and 1, as particles are few."""
MEMORY = 1.0
"""s: a person who is missed for longer makes no groups."""


@dataclass(frozen=True)
class PeopleNow:
    """The people of a frame, one row for each of K slots.

    frame: number. id (K,): of the track, -1 until it is first reported. pos (K, 2): m. vel (K, 2): m/s. together (K,
    K): probability that two people walk together. shown (K,) bool: reported in this frame. missed (K,): time since the
    last measurement, s, 0 if measured in this frame.
    """

    frame: int
    id: Ints
    pos: Array
    vel: Array
    together: Array
    shown: Bools
    missed: Array


@dataclass
class WalkingGroups:
    """Groups of people over time; arrays have a row for each of K slots.

    log_odds (K, K): that two people walk together, in the last frame in which both were measured, nan for a new pair.
    label (K,): people with equal numbers are in one group, -1 alone. people: by id: ids, links and groups. path: dict
    by id of the frames (from 0), places and velocities (x, y, vx, vy) in which the person was measured.
    """

    log_odds: Array = field(default_factory=lambda: np.zeros((0, 0)))
    label: Ints = field(default_factory=lambda: np.zeros(0, np.int64))
    people: LinkedPeople = field(default_factory=LinkedPeople)
    path: dict[int, list[tuple[int, float, float, float, float]]] = field(default_factory=dict)

    def add(self) -> None:
        """Add a slot."""
        self.log_odds = np.pad(self.log_odds, (0, 1), constant_values=np.nan)
        self.label = np.append(self.label, -1)

    def keep(self, rows: Bools) -> None:
        """Remove all slots but those where `rows` (K,) is True."""
        self.log_odds, self.label = self.log_odds[np.ix_(rows, rows)], self.label[rows]

    def step(self, now: PeopleNow, fps: float) -> tuple[Ints, tuple[GroupEvent, ...]]:
        """Return the group of each slot (K,), -1 for a person alone or not reported yet, and the events of the frame.

        Frames come in order. A group of which only one person is reported in the frame counts as alone. The events are
        merge, split, form, dissolve, enter and leave; members are ids, places are in m. Groups that enter within 1 s of
        frame 1 have no event.
        """
        t, arrival = now.frame - 1, frames_of(ARRIVAL, fps)
        self._present(now)
        self._partition(now)
        switched = self._switches(now, fps)
        old = self.people.identities.groups
        changes = self.people.step(t, switched, arrival)
        events = [self._event(c, t, parts_of_change(c, old, self.people), fps, arrival) for c in changes]
        for person in self.path.keys() - self.people.present.keys():
            del self.path[person]
        return self._labels(now), tuple(e for e in events if e is not None)

    def _present(self, now: PeopleNow) -> None:
        """Bring up to date who is present, and where people were measured."""
        named, present = set(now.id[now.id >= 0].tolist()), self.people.present
        for person in present.keys() - named:
            del present[person]
            for other in self.people.linked.pop(person, set()):
                self.people.linked[other].discard(person)
        for k in np.flatnonzero(now.shown).tolist():
            present.setdefault(int(now.id[k]), now.frame - 1)
        for k in np.flatnonzero((now.id >= 0) & ((now.missed == 0) | now.shown)).tolist():
            row = (now.frame - 1, *now.pos[k].tolist(), *now.vel[k].tolist())
            if now.missed[k] == 0 or int(now.id[k]) not in self.path:
                self.path.setdefault(int(now.id[k]), []).append(row)

    def _partition(self, now: PeopleNow) -> None:
        """Bring `log_odds` and `label` up to date.

        People who are missed for longer than MEMORY then join the group with the highest mean log odds if that is above
        0; two of them who were in one group stay in it.
        """
        p = np.clip(now.together, SURE, 1 - SURE)
        new = np.log(p / (1 - p))
        seen = now.missed == 0
        self.log_odds = np.where((seen[:, None] & seen) | np.isnan(self.log_odds), new, self.log_odds)
        recent = np.flatnonzero((now.missed <= MEMORY) & (now.id >= 0))
        a, b = (recent[k] for k in np.triu_indices(len(recent), 1))
        label = np.stack([self.label, np.full_like(self.label, -1)])
        cut = np.array([0, 0, len(a)])
        linked_groups(cut, a, b, self.log_odds[a, b], 0.0, STAY, COME, label)
        before, after = label
        after[recent] = np.where(after[recent] >= 0, after[recent], recent)
        for k in np.flatnonzero((now.missed > MEMORY) & (now.id >= 0)).tolist():
            memory = np.where((before[k] >= 0) & (before == before[k]), STAY, -COME)
            groups = np.unique(after[recent])
            mean = np.array([(self.log_odds + memory)[k, recent[after[recent] == g]].mean() for g in groups])
            after[k] = groups[mean.argmax()] if len(mean) and mean.max() > 0 else k
            if after[k] == k and before[k] >= 0:
                mates = np.flatnonzero((before == before[k]) & (now.missed > MEMORY) & (after >= 0))
                after[k] = after[mates].min()
        number, count = np.unique(after, return_counts=True)
        self.label = np.where(np.isin(after, number[count > 1]), after, -1)

    def _switches(self, now: PeopleNow, fps: float) -> list[LinkSwitch]:
        """Return the links that are set or removed in this frame, as (id, id, on, first frame of the cause)."""
        named = now.id >= 0
        linked = (self.label[:, None] == self.label) & (self.label >= 0) & named & named[:, None]
        was = self.people.linked
        grouped = {p for people in self.people.identities.groups.values() for p in people}
        switched: list[LinkSwitch] = []
        for i, j in np.argwhere(np.triu(named[:, None] & named, 1)).tolist():
            a, b = int(now.id[i]), int(now.id[j])
            if linked[i, j] == (b in was.get(a, ())):
                continue
            since = now.frame - 1
            if linked[i, j] and not {a, b} <= grouped:
                motion = self._motion((a, b), since, fps)
                since = motion.onset(frozenset([0]), frozenset([1]), since, joins=True)
            switched.append((a, b, bool(linked[i, j]), since))
        return switched

    def _event(self, change: GroupChange, t: int, parts: Parts, fps: float, arrival: int) -> GroupEvent | None:
        """Return the event of a change of groups in frame t (from 0); None for one that is no event."""
        people = sorted(p for p in change.members if p in self.path)
        column = {p: k for k, p in enumerate(people)}
        columns = replace(change, members=tuple(range(len(people))))
        sets = [frozenset(column[p] for p in part) for part in parts.sets]
        event = event_of_change(columns, t, Parts(sets, parts.since), self._motion(people, t, fps), arrival)
        return None if event is None else replace(event, members=tuple(people))

    def _motion(self, people: Iterable[int], t: int, fps: float) -> TrackedMotion:
        """Return the motion of some people, ids, up to frame t (from 0)."""
        paths = [np.array(self.path[p]) for p in people]
        state = np.full((t + 1, len(paths), 4), np.nan)
        for k, path in enumerate(paths):
            state[path[:, 0].astype(int), k] = path[:, 1:]
        return TrackedMotion(state[..., :2], state[..., 2:], fps)

    def _labels(self, now: PeopleNow) -> Ints:
        """Return the group of each slot (K,)."""
        group_of = {person: g for g, people in self.people.identities.groups.items() for person in people}
        group = np.array([group_of.get(person, -1) for person in now.id.tolist()], np.int64)
        known, count = np.unique(group[now.shown], return_counts=True)
        return np.where(np.isin(group, known[count > 1]), group, -1)
