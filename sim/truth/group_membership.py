"""Who is in one group, from motion and intent: the truth of groups, measured with look-ahead.

The crowd is at every moment divided into parts (groups, and people alone). Parts that are meant to be one are joined
at the first frame of the first stretch in which the merge rule holds; a part whose people are meant to be in different
groups is divided at the first frame of the first stretch in which the split rule holds between those. Who enters
together and is meant to be together is one part from the first frame. Nothing knows when an order was given.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from sim.truth.merge_split_rules import HOLD_TIME, frames_of, holds_for, separation
from sim.types import Array, Bools, Ints

PersonSet = frozenset[int]
NEVER = np.iinfo(np.int64).max


@dataclass(frozen=True, slots=True)
class MeasuredMotion:
    """What is measured: pos, vel (T, P, 2) with nan where absent, present (T, P), intent (T, P); hold in frames."""

    pos: Array
    vel: Array
    present: Bools
    intent: Ints
    hold: int


def partitions(
    pos: Array, vel: Array, present: Bools, intent: Ints, fps: float
) -> Iterator[tuple[int, list[PersonSet]]]:
    """(t, parts) for each t (from 0) at which the parts of columns change, also by somebody who comes or goes."""
    there = present[..., None]
    scene = MeasuredMotion(
        np.where(there, pos, np.nan), np.where(there, vel, np.nan), present, intent, frames_of(HOLD_TIME, fps)
    )
    turns = _turns(present, intent)
    parts: list[PersonSet] = []
    clock = _Clock(scene)
    t, k = 0, 0
    while t < len(present):
        if k < len(turns) and turns[k] == t:
            parts = _come_and_go(parts, scene, t)
            k += 1
        parts = clock.settle(parts, t)
        yield t, parts
        t = min(clock.next_change(parts, t), int(turns[k]) if k < len(turns) else NEVER)


def _turns(present: Bools, intent: Ints) -> Ints:
    """Frames in which somebody comes, goes or is meant to be elsewhere, and the first."""
    if not len(present):
        return np.zeros(0, np.int64)
    moved = (np.diff(present, axis=0) | (np.diff(intent, axis=0) != 0)).any(axis=1)
    return np.concatenate([[0], np.flatnonzero(moved) + 1])


def _come_and_go(parts: list[PersonSet], scene: MeasuredMotion, t: int) -> list[PersonSet]:
    """The parts without who has gone, and with who comes, together where meant to be."""
    here = frozenset(np.flatnonzero(scene.present[t]).tolist())
    stay = [part & here for part in parts if part & here]
    return stay + list(_classes(here - frozenset().union(*stay), scene, t).values())


def _classes(people: Iterable[int], scene: MeasuredMotion, t: int) -> dict[int, PersonSet]:
    """PersonSet by what they are meant to be in."""
    found: dict[int, set[int]] = {}
    for p in sorted(people):
        found.setdefault(int(scene.intent[t, p]), set()).add(p)
    return {g: frozenset(some) for g, some in found.items()}


class _Clock:
    """When parts will join or divide. State: for each two parts, the frames from which their rule will last.

    A stretch is measured for parts as they are when both first exist, and holds for as long as they stay the same.
    """

    def __init__(self, scene: MeasuredMotion) -> None:
        self.scene = scene
        self._known: dict[tuple[str, PersonSet, PersonSet], Ints] = {}

    def settle(self, parts: list[PersonSet], t: int) -> list[PersonSet]:
        """Join and divide until nothing more is due at t."""
        while True:
            divided = [piece for part in parts for piece in self._divide(part, t)]
            joined = _connected(divided, self._joints(divided, t))
            if len(joined) == len(divided) == len(parts):
                return parts
            parts = joined

    def next_change(self, parts: list[PersonSet], t: int) -> int:
        """The first frame after t at which parts join or may divide; NEVER if none."""
        times = [_first(rows, t + 1) for _, rows in self._courtships(parts, t)]
        for part in parts:
            times += [_first(self._lasts("apart", a, b, t), t + 1) for a, b in self._rifts(part, t)]
        return min(times, default=NEVER)

    def _courtships(self, parts: list[PersonSet], t: int) -> Iterator[tuple[tuple[PersonSet, PersonSet], Ints]]:
        """Each two parts that are meant to be one, and from when they will be."""
        meant: dict[int, list[tuple[PersonSet, PersonSet]]] = {}
        for part in parts:
            g, core = max(_classes(part, self.scene, t).items(), key=lambda item: len(item[1]))
            if 2 * len(core) > len(part):
                meant.setdefault(g, []).append((part, core))
        for some in meant.values():
            for (a, core_a), (b, core_b) in combinations(some, 2):
                yield (a, b), self._lasts("together", core_a, core_b, t)

    def _joints(self, parts: list[PersonSet], t: int) -> list[tuple[PersonSet, PersonSet]]:
        return [pair for pair, rows in self._courtships(parts, t) if _first(rows, t) == t]

    def _rifts(self, part: PersonSet, t: int) -> Iterator[tuple[PersonSet, PersonSet]]:
        """Each two classes of a part whose people are meant to be in different groups."""
        return combinations(_classes(part, self.scene, t).values(), 2) if len(part) > 1 else iter(())

    def _divide(self, part: PersonSet, t: int) -> list[PersonSet]:
        near = [(a, b) for a, b in self._rifts(part, t) if _first(self._lasts("apart", a, b, t), t) != t]
        return _connected(list(_classes(part, self.scene, t).values()), near) if len(part) > 1 else [part]

    def _lasts(self, rule: str, a: PersonSet, b: PersonSet, t: int) -> Ints:
        """Frames from which the rule will hold long enough between a and b, measured from t on."""
        key = (rule, a, b)
        if key not in self._known:
            self._known[key] = self._measure(rule, np.array(sorted(a)), np.array(sorted(b)), t)
        return self._known[key]

    def _measure(self, rule: str, a: Ints, b: Ints, t: int) -> Ints:
        scene = self.scene
        both = scene.present[t:, a].any(axis=1) & scene.present[t:, b].any(axis=1)
        ends = np.flatnonzero(both)
        if not len(ends):
            return ends
        window = slice(t, t + int(ends[-1]) + 1)
        found = separation(scene.pos[window], scene.vel[window], a, b)
        holds = found.together() if rule == "together" else found.apart()
        holds &= self._meant(rule, window, a, b)
        return np.flatnonzero(holds_for(holds, scene.hold)) + t

    def _meant(self, rule: str, window: slice, a: Ints, b: Ints) -> Bools:
        """Where all who are there are meant to be one ("together"), or nobody of a with anybody of b ("apart")."""
        intent, present = self.scene.intent[window], self.scene.present[window]
        same = intent[:, a, None] == intent[:, None, b]
        there = present[:, a, None] & present[:, None, b]
        ok = ~there | (same if rule == "together" else ~same)
        return np.asarray(ok.all(axis=(1, 2)))


def _first(rows: Ints, t: int) -> int:
    k = int(np.searchsorted(rows, t))
    return int(rows[k]) if k < len(rows) else NEVER


def _connected(parts: list[PersonSet], links: list[tuple[PersonSet, PersonSet]]) -> list[PersonSet]:
    """Parts joined wherever they are linked, directly or through others."""
    whole = {part: part for part in parts}
    for a, b in links:
        one = whole[a] | whole[b]
        for part in parts:
            if part <= one:
                whole[part] = one
    return list(dict.fromkeys(whole[part] for part in parts))
