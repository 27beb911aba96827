"""From the probability that two people walk together, in each frame, to groups with ids and events (ours).

The links, group ids and events are those of tracking.grouping, one frame after the other:
    decision   log odds of a Markov relation whose evidence is the log odds of the pair     changed
    groups     consistent partition by the mean decision over pairs                         belief_partition.partition
    links      between any two members of a group                                           WalkingGroups
    ids        identity rule                                                                group_labels.LinkedPeople
    events     changes of groups                                                            merge_split_events
A link is set only while the two are near and move alike, and removed only while they are apart, by the distances of
the truth's merge and split rules. Its onset is the first frame of this stretch.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from sim.truth.identity import GroupChange
from sim.truth.merge_split_rules import Separation, frames_of
from sim.types import Array, Bools, GroupEvent, Ints
from tracking.grouping.belief_partition import partition
from tracking.grouping.group_labels import LinkedPeople
from tracking.grouping.link_rule import ARRIVAL
from tracking.grouping.merge_split_events import BRIDGED, LinkSwitch
from tracking.papers.relational.config import RelationalConfig

SURE = 0.01
"""Probabilities of pairs are taken at least so far from 0 and 1, as particles are few."""
NEVER = -(10**9)
"""Frame number of what has not happened."""
NEAR, FAR = range(2)
"""Rows of `begun` and `lasted`: the pair is near and alike; it is apart."""


@dataclass(frozen=True)
class PeopleNow:
    """The people of a frame, one row for each of K slots.

    frame: number. id (K,): of the track, -1 until it is first reported. pos (K, 2): m. vel (K, 2): m/s. together (K,
    K): probability that two people walk together. shown (K,) bool: reported in this frame. seen (K,) bool: measured in
    this frame.
    """

    frame: int
    id: Ints
    pos: Array
    vel: Array
    together: Array
    shown: Bools
    seen: Bools


@dataclass
class WalkingGroups:
    """Groups of people over time; arrays have a row and a column for each of K slots.

    decision (K, K): log odds that two people are in one group, nan for a new pair. linked (K, K): pairs with a link.
    begun (2, K, K): first frame of the present or last stretch in which the pair was near and alike (NEAR), or apart
    (FAR); lasted (2, K, K): last frame of this stretch. Gaps of up to 0.5 s do not end it. last: dict by id of the last
    frame and place, m, in which the person was reported. people: ids, links and groups.
    """

    decision: Array = field(default_factory=lambda: np.zeros((0, 0)))
    linked: Bools = field(default_factory=lambda: np.zeros((0, 0), bool))
    begun: Ints = field(default_factory=lambda: np.zeros((2, 0, 0), np.int64))
    lasted: Ints = field(default_factory=lambda: np.zeros((2, 0, 0), np.int64))
    last: dict[int, tuple[int, Array]] = field(default_factory=dict)
    people: LinkedPeople = field(default_factory=LinkedPeople)

    def add(self) -> None:
        """Add a slot."""
        grow = ((0, 1), (0, 1))
        self.decision = np.pad(self.decision, grow, constant_values=np.nan)
        self.linked = np.pad(self.linked, grow)
        self.begun, self.lasted = (np.pad(x, ((0, 0), *grow), constant_values=NEVER) for x in (self.begun, self.lasted))

    def keep(self, rows: Bools) -> None:
        """Remove all slots but those where `rows` (K,) is True."""
        some = np.ix_(rows, rows)
        self.decision, self.linked = self.decision[some], self.linked[some]
        self.begun, self.lasted = self.begun[:, rows][:, :, rows], self.lasted[:, rows][:, :, rows]

    def step(self, now: PeopleNow, fps: float, config: RelationalConfig) -> tuple[Ints, tuple[GroupEvent, ...]]:
        """Return the group of each slot (K,), -1 for a person alone or not reported yet, and the events of the frame.

        Frames come in order. A group of which only one person is reported in the frame counts as alone. The events are
        merge, split, form, dissolve, enter and leave; members are ids, places are in m. Groups that enter within 1 s of
        frame 1 have no event.
        """
        arrival = frames_of(ARRIVAL, fps)
        self._present(now)
        self._follow_stretches(now, frames_of(BRIDGED, fps))
        self._decide(now, 1 / fps, config)
        switched = self._switches(now, frames_of(BRIDGED, fps))
        changes = self.people.step(now.frame, switched, arrival)
        events = [self._event(c, now, switched, arrival) for c in changes]
        gone = self.last.keys() - self.people.present.keys()
        self.last = {person: seen for person, seen in self.last.items() if person not in gone}
        return self._labels(now), tuple(e for e in events if e is not None)

    def _present(self, now: PeopleNow) -> None:
        """Bring up to date who is present, and where people were reported last."""
        named, present = set(now.id[now.id >= 0].tolist()), self.people.present
        for person in present.keys() - named:
            del present[person]
            for other in self.people.linked.pop(person, set()):
                self.people.linked[other].discard(person)
        for k in np.flatnonzero(now.shown).tolist():
            present.setdefault(int(now.id[k]), now.frame)
            self.last[int(now.id[k])] = now.frame, now.pos[k]

    def _follow_stretches(self, now: PeopleNow, bridge: int) -> None:
        """Bring `begun` and `lasted` up to date; bridge: frames of a gap that does not end a stretch."""
        found = Separation(*(np.linalg.norm(x[:, None] - x, axis=2) for x in (now.pos, now.vel)))
        both = now.seen[:, None] & now.seen
        for kind, flag in ((NEAR, found.merge_rule() & both), (FAR, found.split_rule() & both)):
            new = flag & (now.frame - self.lasted[kind] > bridge)
            self.begun[kind][new] = now.frame
            self.lasted[kind][flag] = now.frame

    def _decide(self, now: PeopleNow, seconds: float, config: RelationalConfig) -> None:
        """Bring `decision` up to date by the evidence of a frame, which lasts `seconds`; pairs with a missed person
        keep theirs."""
        odds = np.clip(now.together, SURE, 1 - SURE)
        evidence = np.log(odds / (1 - odds)) - np.log(config.together / (1 - config.together))
        later = np.full(self.decision.shape, seconds)
        decision = changed(self.decision, config.join_rate, config.part_rate, later) + seconds * evidence
        decision = np.where(now.seen[:, None] & now.seen, decision, self.decision)
        self.decision = np.where(np.isnan(self.decision), evidence, decision)

    def _switches(self, now: PeopleNow, bridge: int) -> list[LinkSwitch]:
        """Return the links that are set or removed in this frame, as (id, id, on, first frame of the cause)."""
        named = np.flatnonzero(now.id >= 0)
        a, b = (named[k] for k in np.triu_indices(len(named), 1))
        _, person, group = partition(np.zeros_like(a), a, b, self.decision[a, b], 0.0)
        part = -1 - np.arange(len(now.id))
        part[person] = group
        same = part[:, None] == part
        lasts = now.frame - self.lasted <= bridge
        joined = ~self.linked & lasts[NEAR] & same
        left = self.linked & lasts[FAR] & ~same
        switched: list[LinkSwitch] = []
        for kind, pairs in ((NEAR, joined), (FAR, left)):
            for i, j in np.argwhere(np.triu(pairs, 1)).tolist():
                switched.append((int(now.id[i]), int(now.id[j]), kind == NEAR, int(self.begun[kind, i, j])))
        self.linked = (self.linked | joined) & ~left
        return switched

    def _event(
        self, change: GroupChange, now: PeopleNow, switched: list[LinkSwitch], arrival: int
    ) -> GroupEvent | None:
        """Return the event of a change of groups; None for a group that was there from the beginning."""
        start = onset_of_change(change, now.frame, switched)
        if change.kind in ("split", "dissolve"):
            start = self._parted(change, now)
        if change.kind == "leave":
            start = sorted(self.last[person][0] for person in change.members)[-2]
        if change.kind == "enter" and start <= arrival + 1:
            return None
        end = start if change.kind in ("enter", "leave") else now.frame
        x, y = np.mean([self.last[person][1] for person in change.members], axis=0).tolist()
        return GroupEvent(change.kind, start, end, now.frame, change.before, change.after, change.members, (x, y))

    def _parted(self, change: GroupChange, now: PeopleNow) -> int:
        """Return the frame since which the nearest people of two parts of a group have been apart; now if they are not.

        A removed link alone does not tell it: the parts may have been held together by a person who is gone.
        """
        rows = np.flatnonzero(np.isin(now.id, change.members))
        group = self._group(now)[rows]
        part = np.where(group < 0, -1 - np.arange(len(rows)), group)
        i, j = np.nonzero(part[:, None] != part)
        begun = self.begun[FAR][rows[i], rows[j]]
        return int(begun.max()) if len(begun) and begun.min() > NEVER else now.frame

    def _group(self, now: PeopleNow) -> Ints:
        """Return the group of each slot (K,), of people who are not reported, too."""
        group_of = {person: g for g, people in self.people.identities.groups.items() for person in people}
        return np.array([group_of.get(person, -1) for person in now.id.tolist()], np.int64)

    def _labels(self, now: PeopleNow) -> Ints:
        """Return the group of each slot (K,)."""
        group = self._group(now)
        known, count = np.unique(group[now.shown], return_counts=True)
        return np.where(np.isin(group, known[count > 1]), group, -1)


def onset_of_change(change: GroupChange, t: int, switched: Sequence[LinkSwitch]) -> int:
    """Return the first onset among the switches of links that caused the change of groups in frame t; t if there is
    none.

    They are the links set (merge, form, enter) or removed (split, dissolve, leave) between two of its people. switched:
    the links switched in frame t, as (a, b, True if set, first frame of the cause).
    """
    people = set(change.members)
    joins = change.kind in ("merge", "form", "enter")
    return min((since for a, b, on, since in switched if on == joins and a in people and b in people), default=t)


def changed(log_odds: Array, join: float, part: float, seconds: Array) -> Array:
    """Return the log-odds (K, K) of a two-state Markov relation after `seconds` (K, K) without evidence.

    log_odds (K, K): before. Strangers become mates `join` times, mates strangers `part` times per second.
    """
    usual = join / (join + part)
    share = usual + (1 / (1 + np.exp(-log_odds)) - usual) * np.exp(-(join + part) * seconds)
    return np.asarray(np.log(share / (1 - share)))
