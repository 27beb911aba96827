"""When an order fires, and whether what it orders has come true in the running simulation (for `after` triggers).

The truth of a sequence is measured afresh from its motion (sim.truth); this is only for the script.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from scenarios.schema.scenario import MergeOrder, QueueOrder, SplitOrder, expand
from sim.types import Array

if TYPE_CHECKING:
    from sim.crowd.script import Script

HOLD = {"merge": 2.0, "split": 2.0, "queue": 3.0}  # s for which a rule must hold


@dataclass
class Pending:
    """One order: its trigger, the frame in which it fired and the time at which it came true."""

    event: MergeOrder | SplitOrder | QueueOrder
    index: int
    delay: float
    time: float
    fired: int | None = None
    met_at: float | None = None
    true_at: float | None = None
    held: float = 0.0
    before: tuple[tuple[int, ...], ...] = field(default=())
    after: tuple[tuple[int, ...], ...] = field(default=())

    def is_due(self, t: float, state: Array, script: Script) -> bool:
        """Whether the order fires at time t; remembers when its trigger was met."""
        names = concerned(self.event, list(script.alive))
        if not all(n in script.alive and script.present[script.members[script.alive[n]]].all() for n in names):
            return False
        if self.met_at is None and self._is_met(t, state, script, names):
            self.met_at = t
        return self.met_at is not None and t >= self.met_at + self.delay - 1e-9

    def _is_met(self, t: float, state: Array, script: Script, names: list[str]) -> bool:
        when = self.event.when
        if when.time is not None:
            return t >= self.time - 1e-9
        if when.after is not None:
            other = next(p for p in script.pending if p.event.id == when.after)
            return other.true_at is not None
        columns = [script.members[script.alive[n]] for n in names]
        if when.distance_lt is not None:
            pairs = [(a, b) for k, a in enumerate(columns) for b in columns[k + 1 :]]
            return bool(pairs) and max(_nearest(state, a, b) for a, b in pairs) < when.distance_lt
        assert when.reach is not None
        g = script.alive.get(when.reach.group)
        if g is None or not script.present[script.members[g]].all():
            return False
        at = script.goals[g][0] if when.reach.at is None else script.frame.point(np.array(when.reach.at))
        middle = state[script.members[g], :2].mean(axis=0)
        return bool(np.linalg.norm(middle - at) < when.reach.radius)

    def watch(self, t: float, fps: float, holds: bool) -> None:
        """Count how long the ordered rule has held."""
        self.held = self.held + 1 / fps if holds else 0.0
        if self.held >= HOLD[self.event.type] - 1e-9:
            self.true_at = t


def concerned(event: MergeOrder | SplitOrder | QueueOrder, alive: list[str]) -> list[str]:
    """Names of the groups that an order concerns."""
    if isinstance(event, SplitOrder):
        return [event.group]
    return [n for pattern in event.groups for n in expand(pattern, alive)]


def has_come_true(pending: Pending, state: Array, script: Script) -> bool:
    """Whether the order's rule holds in this frame."""
    event = pending.event
    if isinstance(event, QueueOrder):
        columns = list(pending.after[0])
        off = np.linalg.norm(state[columns, :2] - script.targets[columns], axis=1)
        return bool(np.sum(off < 0.4) >= min(3, len(columns)))
    parts = [list(p) for p in (pending.before if isinstance(event, MergeOrder) else pending.after)]
    if not all(np.isfinite(state[p]).all() for p in parts):
        return False
    pairs = [(a, b) for k, a in enumerate(parts) for b in parts[k + 1 :]]
    gaps = [(_nearest(state, a, b), _speed_between(state, a, b)) for a, b in pairs]
    if isinstance(event, MergeOrder):
        joined = [d < 1.5 and v < 0.5 for d, v in gaps]
        return sum(joined) >= len(parts) - 1
    return all(d > 2.5 or (d > 1.5 and v > 0.7) for d, v in gaps)


def _nearest(state: Array, a: list[int], b: list[int]) -> float:
    return float(np.linalg.norm(state[a, None, :2] - state[None, b, :2], axis=2).min())


def _speed_between(state: Array, a: list[int], b: list[int]) -> float:
    return float(np.linalg.norm(state[a, 2:].mean(axis=0) - state[b, 2:].mean(axis=0)))
