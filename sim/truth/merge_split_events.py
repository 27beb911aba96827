"""Makes the merge, split, form, dissolve, enter and leave events of a crowd, and the group id of each person.

It takes positions, velocities and intent: the group that the script means a person to belong to. In every frame the
crowd is divided into parts: groups, and people alone. Two parts that are meant to be one are joined in the first frame
of the first stretch in which the merge rule holds between them. A part whose people are meant to be in different groups
is divided in the first frame of the first stretch in which the split rule holds between those people. People who enter
in the same frame and are meant to be together form one part from that frame on. sim.truth.merge_split_rules has the
rules. Stretches are found by looking ahead; the times at which the script gave orders are not used.
sim.truth.group_ids_and_changes says which group keeps its id and what kind of event a change is.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import chain, combinations, pairwise
from typing import Literal

import numpy as np

from sim.truth.group_ids_and_changes import GroupChange, Identities, PersonSet
from sim.truth.merge_split_rules import HOLD_TIME, frames_of, holds_for, mean_of_present, separation, strangers
from sim.truth.motion_rows import MotionRows, frames_of_change
from sim.types import GroupEvent, Ints, Near

Rule = Literal["merge", "split"]
NEVER = np.iinfo(np.int64).max


def partitions(motion: MotionRows, fps: float) -> Iterator[tuple[int, list[PersonSet]]]:
    """Yields (t, parts) for frame 0 and for each later frame t (from 0) in which the parts may have changed.

    parts: disjoint sets of columns (person id - 1) that make up all people present, valid until the next t. motion:
    with the group that a person is meant to belong to.
    """
    order = np.lexsort((motion.column, motion.frame))
    frame, column, intent = motion.frame[order], motion.column[order], motion.group[order]
    # frame 0, and those from which somebody else is present, or meant to be in another group
    turns = [0, *frames_of_change(frame, column, intent, motion.length)]
    parts: list[PersonSet] = []
    rules = _RuleTimes(motion, frames_of(HOLD_TIME, fps))
    t, k = 0, 0
    while t < motion.length:
        if k < len(turns) and turns[k] == t:
            rows = slice(*np.searchsorted(frame, (t, t + 1)))
            parts = rules.enter_and_leave(parts, dict(zip(column[rows].tolist(), intent[rows].tolist(), strict=True)))
            k += 1
        parts = rules.join_and_divide(parts, t)
        yield t, parts
        t = min(rules.next_change(parts, t), turns[k] if k < len(turns) else NEVER)


class _RuleTimes:
    """When parts of the crowd will join or divide in one motion.

    State: intent, the group that each person present is meant to belong to now. For each rule and two parts, the frames
    from which the rule will hold long enough. They are measured once, when both parts exist for the first time, and
    remain valid while the parts stay the same.
    """

    def __init__(self, motion: MotionRows, hold: int) -> None:
        self.motion, self.hold = motion, hold
        self.intent: dict[int, int] = {}
        self._known: dict[tuple[Rule, PersonSet, PersonSet], Ints] = {}

    def enter_and_leave(self, parts: list[PersonSet], intent: dict[int, int]) -> list[PersonSet]:
        """Returns the parts of the people in `intent`, who are present now; people who enter together are one part."""
        self.intent = intent
        here = frozenset(intent)
        stay = [part & here for part in parts if part & here]
        return stay + list(self._by_intent(here - frozenset().union(*stay)).values())

    def _by_intent(self, people: Iterable[int]) -> dict[int, PersonSet]:
        """Returns the people by the group that they are meant to belong to now."""
        found: dict[int, set[int]] = {}
        for p in sorted(people):
            found.setdefault(self.intent[p], set()).add(p)
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
            times += [_first(self._onsets("split", a, b, t), t + 1) for a, b in self._meant_to_divide(part)]
        return min(times, default=NEVER)

    def _meant_to_join(self, parts: list[PersonSet], t: int) -> Iterator[tuple[tuple[PersonSet, PersonSet], Ints]]:
        """Yields ((a, b), frames of the merge rule) for each two parts that are meant to be one group in frame t."""
        meant: dict[int, list[tuple[PersonSet, PersonSet]]] = {}
        for part in parts:
            g, core = max(self._by_intent(part).items(), key=lambda item: len(item[1]))
            # A part joins as the group that most of its people are meant to be in; the rule is measured between these.
            if 2 * len(core) > len(part):
                meant.setdefault(g, []).append((part, core))
        for some in meant.values():
            for (a, core_a), (b, core_b) in combinations(some, 2):
                yield (a, b), self._onsets("merge", core_a, core_b, t)

    def _meant_to_divide(self, part: PersonSet) -> Iterator[tuple[PersonSet, PersonSet]]:
        return combinations(self._by_intent(part).values(), 2) if len(part) > 1 else iter(())

    def _divide(self, part: PersonSet, t: int) -> list[PersonSet]:
        if len(part) == 1:
            return [part]
        # Two subsets stay together, too, if a third one connects them.
        unsplit = [(a, b) for a, b in self._meant_to_divide(part) if _first(self._onsets("split", a, b, t), t) != t]
        return connected(list(self._by_intent(part).values()), unsplit)

    def _onsets(self, rule: Rule, a: PersonSet, b: PersonSet, t: int) -> Ints:
        """Returns the frames, ascending, from which the rule will hold long enough between parts a and b."""
        key = (rule, a, b)
        if key not in self._known:
            self._known[key] = self._measure(rule, sorted(a), sorted(b), t)
        return self._known[key]

    def _measure(self, rule: Rule, a: list[int], b: list[int], t: int) -> Ints:
        end = min(int(self.motion.last(np.array(part)).max()) for part in (a, b)) + 1
        pos, vel, intent = self.motion.window(a + b, t, end)
        first, second = np.split(np.arange(len(a + b)), [len(a)])
        found = separation(pos, vel, first, second, self.motion.walls, t)
        holds = found.merge_rule() if rule == "merge" else found.split_rule()
        # Everybody must be meant to be in one group, or in two.
        one, other = intent[:, first, None], intent[:, None, second]
        meant = (one == other) if rule == "merge" else (one != other)
        holds &= (meant | (one < 0) | (other < 0)).all(axis=(1, 2))
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
    """What is measured of the groups in a motion of R rows."""

    group: Ints  # (R,) id of each person's group, from 1; -1 for a person who is alone
    # merge, split, form, dissolve, enter and leave, in order of the frame in which the group changed; () if none
    events: tuple[GroupEvent, ...]
    # pairs of people who satisfy the merge rule (less than 1.5 m apart, velocities differing by less than 0.5 m/s, for
    # 2 s) but are strangers (hard negatives)
    near: Near


def groups_and_events(motion: MotionRows, fps: float) -> GroupsAndEvents:
    """Returns the group ids, the events (all kinds but cross and queue) and the near strangers of a motion.

    motion: `group` is the group that a person is meant to belong to, from 0. Frames of events count from 1, a person's
    id is the column + 1. A merge, split, form or dissolve starts in the first frame in which its rule holds, and ends
    when it has held for HOLD_TIME. An enter lies in the group's first frame, a leave in the last frame before the group
    is gone.
    """
    group = np.full(len(motion.frame), -1)
    identities, events = Identities(), []
    hold = frames_of(HOLD_TIME, fps)
    for (t, parts), (until, _) in pairwise(chain(partitions(motion, fps), [(motion.length, [])])):
        changes = identities.step(t, frozenset().union(*parts), parts)
        for g, people in identities.groups.items():
            for p in people:
                group[int(motion.find(p, t)) : int(motion.find(p, until))] = g
        events += [_event(c, t, hold, motion) for c in changes if t > 0]
    return GroupsAndEvents(group, tuple(events), strangers(motion, group, fps))


def _event(change: GroupChange, t: int, hold: int, motion: MotionRows) -> GroupEvent:
    start = t if change.kind == "leave" else t + 1
    end = start if change.kind in ("enter", "leave") else start + hold - 1
    x, y = mean_of_present(motion.window(change.members, start - 1, start)[0])[0]
    people = tuple(p + 1 for p in change.members)
    return GroupEvent(change.kind, start, end, None, change.before, change.after, people, (float(x), float(y)))
