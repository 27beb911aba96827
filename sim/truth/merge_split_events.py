"""Makes the merge, split, form, dissolve, enter and leave events of a crowd, and the group id of each person.

It takes positions, velocities and intent: the group that the script means a person to belong to. In every frame the
crowd is divided into parts: groups, and people alone. Two parts that are meant to be one are joined in the first frame
of the first stretch in which the merge rule holds between them. A part whose people are meant to be in different groups
is divided in the first frame of the first stretch in which the split rule holds between those people. People who enter
in the same frame and are meant to be together form one part from that frame on. sim.truth.merge_split_rules has the
rules. Stretches are found by looking ahead; the times at which the script gave orders are not used. sim.truth.identity
says which group keeps its id and what kind of event a change is.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations, pairwise
from typing import Literal

import numpy as np

from sim.truth.identity import GroupChange, Identities, PersonSet
from sim.truth.merge_split_rules import HOLD_TIME, frames_of, holds_for, mean_of_present, separation, strangers
from sim.types import Array, Bools, GroupEvent, Ints, Near

Rule = Literal["merge", "split"]
NEVER = np.iinfo(np.int64).max


def partitions(
    pos: Array, vel: Array, present: Bools, intent: Ints, fps: float
) -> Iterator[tuple[int, list[PersonSet]]]:
    """Yields (t, parts) for frame 0 and for each later frame t (from 0) in which the parts may have changed.

    parts: disjoint sets of columns (person id - 1) that make up all people present, valid until the next t. pos, vel
    (T, P, 2): m, m/s. present (T, P). intent (T, P): the group a person is meant to belong to, -1 while absent.
    """
    turns = _turns(present, intent)
    parts: list[PersonSet] = []
    rules = _RuleTimes(pos, vel, present, intent, frames_of(HOLD_TIME, fps))
    t, k = 0, 0
    while t < len(present):
        if k < len(turns) and turns[k] == t:
            parts = rules.enter_and_leave(parts, t)
            k += 1
        parts = rules.join_and_divide(parts, t)
        yield t, parts
        t = min(rules.next_change(parts, t), int(turns[k]) if k < len(turns) else NEVER)


def _turns(present: Bools, intent: Ints) -> Ints:
    """Returns frame 0 and the frames from which somebody else is present, or meant to be in another group."""
    if not len(present):
        return np.zeros(0, np.int64)
    moved = (np.diff(present, axis=0) | (np.diff(intent, axis=0) != 0)).any(axis=1)
    return np.concatenate([[0], np.flatnonzero(moved) + 1])


class _RuleTimes:
    """When parts of the crowd will join or divide in one motion.

    State: for each rule and two parts, the frames from which the rule will hold long enough. They are measured once,
    when both parts exist for the first time, and remain valid while the parts stay the same.
    """

    def __init__(self, pos: Array, vel: Array, present: Bools, intent: Ints, hold: int) -> None:
        there = present[..., None]
        self.pos, self.vel = np.where(there, pos, np.nan), np.where(there, vel, np.nan)
        self.present, self.intent, self.hold = present, intent, hold
        self._known: dict[tuple[Rule, PersonSet, PersonSet], Ints] = {}

    def enter_and_leave(self, parts: list[PersonSet], t: int) -> list[PersonSet]:
        """Returns the parts of those present in frame t; people who enter together are one part."""
        here = frozenset(np.flatnonzero(self.present[t]).tolist())
        stay = [part & here for part in parts if part & here]
        return stay + list(self._by_intent(here - frozenset().union(*stay), t).values())

    def _by_intent(self, people: Iterable[int], t: int) -> dict[int, PersonSet]:
        """Returns the people by the group that they are meant to belong to in frame t."""
        found: dict[int, set[int]] = {}
        for p in sorted(people):
            found.setdefault(int(self.intent[t, p]), set()).add(p)
        return {g: frozenset(some) for g, some in found.items()}

    def join_and_divide(self, parts: list[PersonSet], t: int) -> list[PersonSet]:
        """Returns the parts after all joins and divisions that are due in frame t (from 0)."""
        while True:
            divided = [piece for part in parts for piece in self._divide(part, t)]
            due = [pair for pair, frames in self._meant_to_join(divided, t) if _first(frames, t) == t]
            joined = connected(divided, due)
            if len(joined) == len(divided) == len(parts):
                return parts
            parts = joined

    def next_change(self, parts: list[PersonSet], t: int) -> int:
        """Returns the first frame after t in which parts join or may divide; NEVER if there is none."""
        times = [_first(frames, t + 1) for _, frames in self._meant_to_join(parts, t)]
        for part in parts:
            times += [_first(self._onsets("split", a, b, t), t + 1) for a, b in self._meant_to_divide(part, t)]
        return min(times, default=NEVER)

    def _meant_to_join(self, parts: list[PersonSet], t: int) -> Iterator[tuple[tuple[PersonSet, PersonSet], Ints]]:
        """Yields ((a, b), frames of the merge rule) for each two parts that are meant to be one group in frame t."""
        meant: dict[int, list[tuple[PersonSet, PersonSet]]] = {}
        for part in parts:
            g, core = max(self._by_intent(part, t).items(), key=lambda item: len(item[1]))
            # A part joins as the group that most of its people are meant to be in; the rule is measured between these.
            if 2 * len(core) > len(part):
                meant.setdefault(g, []).append((part, core))
        for some in meant.values():
            for (a, core_a), (b, core_b) in combinations(some, 2):
                yield (a, b), self._onsets("merge", core_a, core_b, t)

    def _meant_to_divide(self, part: PersonSet, t: int) -> Iterator[tuple[PersonSet, PersonSet]]:
        return combinations(self._by_intent(part, t).values(), 2) if len(part) > 1 else iter(())

    def _divide(self, part: PersonSet, t: int) -> list[PersonSet]:
        if len(part) == 1:
            return [part]
        # Two subsets stay together, too, if a third one connects them.
        unsplit = [(a, b) for a, b in self._meant_to_divide(part, t) if _first(self._onsets("split", a, b, t), t) != t]
        return connected(list(self._by_intent(part, t).values()), unsplit)

    def _onsets(self, rule: Rule, a: PersonSet, b: PersonSet, t: int) -> Ints:
        """Returns the frames, ascending, from which the rule will hold long enough between parts a and b."""
        key = (rule, a, b)
        if key not in self._known:
            self._known[key] = self._measure(rule, np.array(sorted(a)), np.array(sorted(b)), t)
        return self._known[key]

    def _measure(self, rule: Rule, a: Ints, b: Ints, t: int) -> Ints:
        both = self.present[t:, a].any(axis=1) & self.present[t:, b].any(axis=1)
        ends = np.flatnonzero(both)
        if not len(ends):
            return ends
        window = slice(t, t + int(ends[-1]) + 1)
        intent, present = self.intent[window], self.present[window]
        found = separation(self.pos[window], self.vel[window], a, b)
        holds = found.merge_rule() if rule == "merge" else found.split_rule()
        # Everybody must be meant to be in one group, or in two.
        same = intent[:, a, None] == intent[:, None, b]
        meant = same if rule == "merge" else ~same
        holds &= (meant | ~(present[:, a, None] & present[:, None, b])).all(axis=(1, 2))
        return np.flatnonzero(holds_for(holds, self.hold)) + t


def _first(frames: Ints, t: int) -> int:
    k = int(np.searchsorted(frames, t))
    return int(frames[k]) if k < len(frames) else NEVER


def connected(parts: Sequence[PersonSet], links: Sequence[tuple[PersonSet, PersonSet]]) -> list[PersonSet]:
    """Returns the parts, each united with all that links connect it to."""
    whole = {part: part for part in parts}
    for a, b in links:
        one = whole[a] | whole[b]
        for part in parts:
            if part <= one:
                whole[part] = one
    return list(dict.fromkeys(whole[part] for part in parts))


@dataclass(frozen=True, slots=True, eq=False)
class GroupsAndEvents:
    """What is measured of the groups in a motion of T frames and P people."""

    group: Ints  # (T, P) id of each person's group, from 1; -1 for a person who is alone or absent
    # merge, split, form, dissolve, enter and leave, in order of the frame in which the group changed; () if none
    events: tuple[GroupEvent, ...]
    # pairs of people who satisfy the merge rule (less than 1.5 m apart, velocities differing by less than 0.5 m/s, for
    # 2 s) but are strangers (hard negatives)
    near: Near


def groups_and_events(pos: Array, vel: Array, present: Bools, intent: Ints, fps: float) -> GroupsAndEvents:
    """Returns the group ids, the events (all kinds but cross and queue) and the near strangers of a motion.

    pos, vel (T, P, 2): m, m/s, nan while absent. present (T, P). intent (T, P): the group a person is meant to belong
    to, -1 while absent. Frames of events count from 1, a person's id is the column + 1. A merge, split, form or
    dissolve starts in the first frame in which its rule holds, and ends when it has held for HOLD_TIME. An enter lies
    in the group's first frame, a leave in the last frame before the group is gone.
    """
    group = np.full(present.shape, -1, np.int64)
    identities, events = Identities(), []
    hold = frames_of(HOLD_TIME, fps)
    steps = [*partitions(pos, vel, present, intent, fps), (len(present), [])]
    for (t, parts), (until, _) in pairwise(steps):
        here = frozenset(np.flatnonzero(present[t]).tolist())
        changes = identities.step(t, here, parts)
        for g, people in identities.groups.items():
            group[t:until, sorted(people)] = g
        events += [_event(c, t, hold, pos) for c in changes if t > 0]
    return GroupsAndEvents(group, tuple(events), strangers(pos, vel, present, intent, group, fps))


def _event(change: GroupChange, t: int, hold: int, pos: Array) -> GroupEvent:
    start = t if change.kind == "leave" else t + 1
    end = start if change.kind in ("enter", "leave") else start + hold - 1
    x, y = mean_of_present(pos[start - 1 : start, list(change.members)])[0]
    people = tuple(p + 1 for p in change.members)
    return GroupEvent(change.kind, start, end, None, change.before, change.after, people, (float(x), float(y)))
