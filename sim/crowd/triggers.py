"""Decides when an order of the script fires, and whether a fired order has come true in the running simulation.

The second is only for the trigger `after`. The truth of a sequence is measured later, from its motion (sim.truth).
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from scenarios.schema.scenario import MergeOrder, QueueOrder, SplitOrder, expand
from sim.crowd.group_state import GroupState
from sim.truth.merge_split_rules import MERGE_DISTANCE, MERGE_VELOCITY, SPLIT_DISTANCE, SPLIT_VELOCITY
from sim.truth.order_fulfilment import RULE_TIME
from sim.truth.queue_detection import QUEUE_PEOPLE
from sim.types import Array

IN_PLACE = 0.4  # m from the own place in a queue
EPS = 1e-9  # s


@dataclass
class PendingOrder:
    """One order of the script and what became of it.

    Fixed: the order; its index in the script; delay and time of the trigger, s (time: inf if the trigger is no time);
    reach_at (2,): the place of a `reach` trigger in the world, m, None for the group's goal. State: the 1-based frame
    in which it fired; when its trigger was met and when it came true, s; for how long its rule has held, s; columns of
    the people of each group before and after it. None: not yet.
    """

    order: MergeOrder | SplitOrder | QueueOrder
    index: int
    delay: float
    time: float
    reach_at: Array | None = None
    fired: int | None = None
    met_at: float | None = None
    true_at: float | None = None
    held_for: float = 0.0
    before: tuple[tuple[int, ...], ...] = field(default=())
    after: tuple[tuple[int, ...], ...] = field(default=())

    def is_due(self, t: float, state: Array, groups: GroupState, come_true: set[str]) -> bool:
        """Returns True if the order fires at time t (s), and records when its trigger was first met.

        An order fires `delay` seconds after its trigger was met, and only while every group it concerns exists and is
        wholly in the scene. state (P, 4) by column; come_true: ids of orders that have come true.
        """
        names = concerned(self.order, list(groups.alive))
        if not all(n in groups.alive and groups.all_present(groups.alive[n]) for n in names):
            return False
        if self.met_at is None and self._is_met(t, state, groups, names, come_true):
            self.met_at = t
        return self.met_at is not None and t >= self.met_at + self.delay - EPS

    def _is_met(self, t: float, state: Array, groups: GroupState, names: list[str], come_true: set[str]) -> bool:
        """True if the trigger is met at time t; names: of the groups concerned."""
        when = self.order.when
        if when.time is not None:
            return t >= self.time - EPS
        if when.after is not None:
            return when.after in come_true
        if when.distance_lt is not None:
            columns = [groups.members[groups.alive[n]] for n in names]
            pairs = [(a, b) for k, a in enumerate(columns) for b in columns[k + 1 :]]
            return bool(pairs) and max(_nearest(state, a, b) for a, b in pairs) < when.distance_lt
        assert when.reach is not None
        g = groups.alive.get(when.reach.group)
        if g is None or not groups.all_present(g):
            return False
        at = groups.goals[g][0] if self.reach_at is None else self.reach_at
        middle = state[groups.members[g], :2].mean(axis=0)
        return bool(np.linalg.norm(middle - at) < when.reach.radius)

    def watch(self, t: float, fps: float, holds: bool) -> None:
        """Counts how long the order's rule has held up to this frame; sets `true_at` once that is long enough."""
        self.held_for = self.held_for + 1 / fps if holds else 0.0
        if self.held_for >= RULE_TIME[self.order.type] - EPS:
            self.true_at = t


def concerned(order: MergeOrder | SplitOrder | QueueOrder, alive: list[str]) -> list[str]:
    """Returns the names of the groups that an order concerns; `alive`: names of all existing groups."""
    if isinstance(order, SplitOrder):
        return [order.group]
    return [n for pattern in order.groups for n in expand(pattern, alive)]


def rule_holds(pending: PendingOrder, state: Array, targets: Array) -> bool:
    """Returns True if the rule of a fired order holds in this frame; state (P, 4), targets (P, 2) by column.

    Queue: at least QUEUE_PEOPLE people, or all if they are fewer, are within IN_PLACE of their targets. Merge: of all
    pairs of parents, at least as many as there are parents less one satisfy the merge rule. Split: all pairs of parts
    satisfy the split rule. A merge or split does not hold while somebody is absent.
    """
    order = pending.order
    if isinstance(order, QueueOrder):
        columns = list(pending.after[0])
        off = np.linalg.norm(state[columns, :2] - targets[columns], axis=1)
        return bool(np.sum(off < IN_PLACE) >= min(QUEUE_PEOPLE, len(columns)))
    parts = [list(p) for p in (pending.before if isinstance(order, MergeOrder) else pending.after)]
    if not all(np.isfinite(state[p]).all() for p in parts):
        return False
    pairs = [(a, b) for k, a in enumerate(parts) for b in parts[k + 1 :]]
    gaps = [(_nearest(state, a, b), _velocity_difference(state, a, b)) for a, b in pairs]
    if isinstance(order, MergeOrder):
        joined = [d < MERGE_DISTANCE and v < MERGE_VELOCITY for d, v in gaps]
        return sum(joined) >= len(parts) - 1
    return all(d > SPLIT_DISTANCE or (d > MERGE_DISTANCE and v > SPLIT_VELOCITY) for d, v in gaps)


def _nearest(state: Array, a: list[int], b: list[int]) -> float:
    """Distance of the nearest two people of columns a and b, m."""
    return float(np.linalg.norm(state[a, None, :2] - state[None, b, :2], axis=2).min())


def _velocity_difference(state: Array, a: list[int], b: list[int]) -> float:
    """Length of the difference of the mean velocities of columns a and b, m/s."""
    return float(np.linalg.norm(state[a, 2:].mean(axis=0) - state[b, 2:].mean(axis=0)))
