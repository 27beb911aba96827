"""Finds who is in one group in each frame, from motion and intent: the truth of group membership.

Intent is the group that the script means a person to belong to. In every frame the crowd is divided into parts: groups,
and people alone. Two parts that are meant to be one are joined in the first frame of the first stretch in which the
merge rule holds between them. A part whose people are meant to be in different groups is divided in the first frame of
the first stretch in which the split rule holds between those people. People who enter in the same frame and are meant
to be together form one part from that frame on.

Merge rule: less than 1.5 m apart, velocities differing by less than 0.5 m/s. Split rule: more than 2.5 m apart, or 1.5
m with velocities differing by more than 0.7 m/s. Both for 2 s. Stretches are found by looking ahead. The times at which
the script gave orders are not used.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from itertools import combinations
from typing import Literal

import numpy as np

from sim.truth.identity import PersonSet
from sim.truth.merge_split_rules import HOLD_TIME, frames_of, holds_for, separation
from sim.types import Array, Bools, Ints

Rule = Literal["merge", "split"]
NEVER = np.iinfo(np.int64).max


@dataclass(frozen=True, slots=True)
class MeasuredMotion:
    """The motion from which groups are found: T frames, P people.

    - pos, vel (T, P, 2): m, m/s, nan while absent. present (T, P): flags.
    - intent (T, P): index of the group that the script means a person to belong to, -1 while absent.
    - hold: number of frames for which the merge or split rule must hold.
    """

    pos: Array
    vel: Array
    present: Bools
    intent: Ints
    hold: int


def partitions(
    pos: Array, vel: Array, present: Bools, intent: Ints, fps: float
) -> Iterator[tuple[int, list[PersonSet]]]:
    """Yields (t, parts) for frame 0 and for each later frame t in which the parts may have changed; frames count from
    0.

    parts: disjoint sets of columns (person id - 1) that make up all people present; a set of one is a person alone.
    They are valid until the next t. Parts meant to be one group join in the first frame from which they are less than
    1.5 m apart, with velocities differing by less than 0.5 m/s, for 2 s. A part meant to be several groups divides
    likewise: more than 2.5 m apart, or 1.5 m with a difference above 0.7 m/s.

    pos, vel (T, P, 2): m, m/s. present (T, P): flags. intent (T, P): index of the group a person is meant to belong to,
    -1 while absent. fps: frames per s. Yields nothing for a motion without frames.
    """
    there = present[..., None]
    pos, vel = np.where(there, pos, np.nan), np.where(there, vel, np.nan)
    motion = MeasuredMotion(pos, vel, present, intent, frames_of(HOLD_TIME, fps))
    turns = _turns(present, intent)
    parts: list[PersonSet] = []
    rules = _RuleTimes(motion)
    t, k = 0, 0
    while t < len(present):
        if k < len(turns) and turns[k] == t:
            parts = _enter_and_leave(parts, motion, t)
            k += 1
        parts = rules.join_and_divide(parts, t)
        yield t, parts
        t = min(rules.next_change(parts, t), int(turns[k]) if k < len(turns) else NEVER)


def _turns(present: Bools, intent: Ints) -> Ints:
    """Returns frame 0 and the frames, counted from 0 and ascending, from which on something is different.

    That is the first frame of a person, the first frame without a person who has left, and the first frame in which a
    person is meant to be in another group.

    present (T, P): flags. intent (T, P): index of the group each person is meant to belong to, -1 while absent. Empty
    for a motion without frames.
    """
    if not len(present):
        return np.zeros(0, np.int64)
    moved = (np.diff(present, axis=0) | (np.diff(intent, axis=0) != 0)).any(axis=1)
    return np.concatenate([[0], np.flatnonzero(moved) + 1])


def _enter_and_leave(parts: list[PersonSet], motion: MeasuredMotion, t: int) -> list[PersonSet]:
    """Returns the parts (sets of columns) in frame t, without people who have left and with people who have entered.

    Parts with nobody left are dropped; the others keep their order. People who enter come last and form one new part
    for each group that `motion.intent` means them to belong to. They join no existing part here.
    """
    here = frozenset(np.flatnonzero(motion.present[t]).tolist())
    stay = [part & here for part in parts if part & here]
    return stay + list(_by_intent(here - frozenset().union(*stay), motion, t).values())


def _by_intent(people: Iterable[int], motion: MeasuredMotion, t: int) -> dict[int, PersonSet]:
    """Returns sets of the given columns `people`, keyed by the index of the group that they are meant to belong to in
    frame t; -1 for absent people.

    The keys are in the order of each group's least column.
    """
    found: dict[int, set[int]] = {}
    for p in sorted(people):
        found.setdefault(int(motion.intent[t, p]), set()).add(p)
    return {g: frozenset(some) for g, some in found.items()}


class _RuleTimes:
    """When parts (sets of columns, person id - 1) will join or divide in one motion.

    State: for each rule ("merge" or "split") and two parts, the frames from which the rule will hold long enough (2 s).
    They are measured once, when both parts exist for the first time, and remain valid while the parts stay the same.
    """

    def __init__(self, motion: MeasuredMotion) -> None:
        self.motion = motion
        self._known: dict[tuple[Rule, PersonSet, PersonSet], Ints] = {}

    def join_and_divide(self, parts: list[PersonSet], t: int) -> list[PersonSet]:
        """Returns the parts (sets of columns) after all joins and divisions that are due in frame t, which counts from
        0.

        It divides, then joins, and repeats this until nothing changes. If nothing is due, `parts` itself is returned.
        """
        while True:
            divided = [piece for part in parts for piece in self._divide(part, t)]
            joined = _connected(divided, self._due_to_join(divided, t))
            if len(joined) == len(divided) == len(parts):
                return parts
            parts = joined

    def next_change(self, parts: list[PersonSet], t: int) -> int:
        """Returns the first frame after t in which parts join or may divide; NEVER (the largest int64) if there is
        none.

        parts: disjoint sets of columns. Frames count from 0.
        """
        times = [_first(frames, t + 1) for _, frames in self._meant_to_join(parts, t)]
        for part in parts:
            times += [_first(self._onsets("split", a, b, t), t + 1) for a, b in self._meant_to_divide(part, t)]
        return min(times, default=NEVER)

    def _meant_to_join(self, parts: list[PersonSet], t: int) -> Iterator[tuple[tuple[PersonSet, PersonSet], Ints]]:
        """Yields ((a, b), frames) for each two of the parts (sets of columns) that are meant to be one group in frame
        t.

        frames: ascending, from 0, those from which the merge rule will hold long enough. A part counts only if more
        than half of its people are meant to be in that group; the rule is measured between these people.
        """
        meant: dict[int, list[tuple[PersonSet, PersonSet]]] = {}
        for part in parts:
            g, core = max(_by_intent(part, self.motion, t).items(), key=lambda item: len(item[1]))
            if 2 * len(core) > len(part):
                meant.setdefault(g, []).append((part, core))
        for some in meant.values():
            for (a, core_a), (b, core_b) in combinations(some, 2):
                yield (a, b), self._onsets("merge", core_a, core_b, t)

    def _due_to_join(self, parts: list[PersonSet], t: int) -> list[tuple[PersonSet, PersonSet]]:
        return [pair for pair, frames in self._meant_to_join(parts, t) if _first(frames, t) == t]

    def _meant_to_divide(self, part: PersonSet, t: int) -> Iterator[tuple[PersonSet, PersonSet]]:
        """Returns an iterator over each two subsets of a part (a set of columns) that are meant to be different groups
        in frame t; may be empty."""
        return combinations(_by_intent(part, self.motion, t).values(), 2) if len(part) > 1 else iter(())

    def _divide(self, part: PersonSet, t: int) -> list[PersonSet]:
        """Returns the pieces (sets of columns) into which a part divides in frame t; the part itself, in a list, if it
        does not divide.

        The pieces are its subsets by intended group. Two subsets stay together unless frame t is one from which the
        split rule holds between them for 2 s, or if a third one connects them.
        """
        if len(part) == 1:
            return [part]
        unsplit = [(a, b) for a, b in self._meant_to_divide(part, t) if _first(self._onsets("split", a, b, t), t) != t]
        return _connected(list(_by_intent(part, self.motion, t).values()), unsplit)

    def _onsets(self, rule: Rule, a: PersonSet, b: PersonSet, t: int) -> Ints:
        """Returns the frames (from 0), ascending, from which the rule ("merge" or "split") will hold long enough
        between parts a and b.

        a, b: sets of columns. The frames are measured at the first call for this rule and these parts, from frame t on;
        later calls return the same array.
        """
        key = (rule, a, b)
        if key not in self._known:
            self._known[key] = self._measure(rule, np.array(sorted(a)), np.array(sorted(b)), t)
        return self._known[key]

    def _measure(self, rule: Rule, a: Ints, b: Ints, t: int) -> Ints:
        """Returns the frames from t on (from 0), ascending, from which the rule holds between columns a and b for
        `hold` frames.

        rule: "merge" or "split". The intent must agree in these frames, too. Empty if a and b are never both present
        from t on.
        """
        motion = self.motion
        both = motion.present[t:, a].any(axis=1) & motion.present[t:, b].any(axis=1)
        ends = np.flatnonzero(both)
        if not len(ends):
            return ends
        window = slice(t, t + int(ends[-1]) + 1)
        found = separation(motion.pos[window], motion.vel[window], a, b)
        holds = found.merge_rule() if rule == "merge" else found.split_rule()
        holds &= self._intended(rule, window, a, b)
        return np.flatnonzero(holds_for(holds, motion.hold)) + t

    def _intended(self, rule: Rule, window: slice, a: Ints, b: Ints) -> Bools:
        """Returns for each frame of the window (a slice of frames) whether intent agrees with the rule between columns
        a and b, shape (frames,).

        merge: each person of a is meant to be in the same group as each person of b. split: no person of a is meant to
        be in the group of a person of b. Absent people are ignored; a frame in which a or b has nobody agrees.
        """
        intent, present = self.motion.intent[window], self.motion.present[window]
        same = intent[:, a, None] == intent[:, None, b]
        there = present[:, a, None] & present[:, None, b]
        ok = ~there | (same if rule == "merge" else ~same)
        return np.asarray(ok.all(axis=(1, 2)))


def _first(frames: Ints, t: int) -> int:
    """Returns the first of the ascending `frames` that is t or later; NEVER (the largest int64) if there is none."""
    k = int(np.searchsorted(frames, t))
    return int(frames[k]) if k < len(frames) else NEVER


def _connected(parts: list[PersonSet], links: list[tuple[PersonSet, PersonSet]]) -> list[PersonSet]:
    """Returns the parts, each set united with all sets that links connect it to, directly or through other parts.

    The order of the first sets is kept; a united set appears once.
    """
    whole = {part: part for part in parts}
    for a, b in links:
        one = whole[a] | whole[b]
        for part in parts:
            if part <= one:
                whole[part] = one
    return list(dict.fromkeys(whole[part] for part in parts))
