"""Decides when an order of the script fires, and whether a fired order has come true in the running simulation.

The second is only for the trigger `after`. The truth of a sequence is measured later, from its motion (sim.truth).
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from scenarios.schema.scenario import MergeOrder, QueueOrder, SplitOrder, expand
from sim.clock import SCRIPT_RATE
from sim.crowd.group_state import GroupState
from sim.elementary import length
from sim.truth.merge_split_rules import MERGE_DISTANCE, MERGE_VELOCITY, SPLIT_DISTANCE, SPLIT_VELOCITY
from sim.truth.order_fulfilment import RULE_TIME
from sim.truth.queue_detection import QUEUE_PEOPLE
from sim.types import Array

IN_PLACE = 0.4  # m from the own place in a queue
EPS = 1e-9  # s


@dataclass
class PendingOrder:
    """One order of the script and what became of it. Times count from the first recorded frame, s."""

    order: MergeOrder | SplitOrder | QueueOrder
    index: int  # in the file, from 0;
    delay: float  # s between trigger and firing;
    time: float  # of a `time` trigger, s, else inf
    # (2,) place of a `reach` trigger in the world, m; None: the group's goal, or no such trigger
    reach_at: Array | None = None
    fired: int | None = None  # tick of the script, from 0, at which it fired, None: not yet
    # time at which the trigger (the order's condition for firing) was first met, s; None: not yet
    met_at: float | None = None
    true_at: float | None = None  # time at which it had held long enough, s; None: not yet
    # s for which the order's rule (people are together, apart or in line, as ordered) has held without a break
    held_for: float = 0.0
    # before, after: columns (person id - 1) of the people of each group before and after the order; empty until it
    # fires. Times count from the first recorded frame.
    before: tuple[tuple[int, ...], ...] = field(default=())
    after: tuple[tuple[int, ...], ...] = field(default=())

    def is_due(self, t: float, state: Array, groups: GroupState, come_true: set[str]) -> bool:
        """Returns True if the order fires at time t (s): `delay` after its trigger was first met.

        state (P, 4): x, y, vx, vy by column. come_true: ids of the orders that have come true.
        """
        names = concerned(self.order, list(groups.alive))
        # An order waits until every group that it concerns exists and is wholly in the scene.
        if not all(n in groups.alive and groups.all_present(groups.alive[n]) for n in names):
            return False
        if self.met_at is None and self._is_met(t, state, groups, names, come_true):
            self.met_at = t
        return self.met_at is not None and t >= self.met_at + self.delay - EPS

    def _is_met(self, t: float, state: Array, groups: GroupState, names: list[str], come_true: set[str]) -> bool:
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
        return bool(length(middle - at) < when.reach.radius)

    def watch(self, t: float, holds: bool) -> None:
        """Notes whether the order's rule `holds` at this tick; sets true_at once it has held for its time."""
        self.held_for = self.held_for + 1 / SCRIPT_RATE if holds else 0.0
        if self.held_for >= RULE_TIME[self.order.type] - EPS:
            self.true_at = t


def concerned(order: MergeOrder | SplitOrder | QueueOrder, alive: list[str]) -> list[str]:
    """Returns the names of the groups that an order concerns; `g-*` stands for all existing names with `g-`."""
    if isinstance(order, SplitOrder):
        return [order.group]
    return list(dict.fromkeys(n for pattern in order.groups for n in expand(pattern, alive)))


def rule_holds(pending: PendingOrder, state: Array, targets: Array) -> bool:
    """Returns True if the rule of an order that has fired holds at this tick.

    state (P, 4): x, y, vx, vy by column, nan while absent. targets (P, 2): places in the queue.
    """
    order = pending.order
    if isinstance(order, QueueOrder):
        columns = list(pending.after[0])
        off = length(state[columns, :2] - targets[columns])
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
    return float(length(state[a, None, :2] - state[None, b, :2]).min())


def _velocity_difference(state: Array, a: list[int], b: list[int]) -> float:
    return float(length(state[a, 2:].mean(axis=0) - state[b, 2:].mean(axis=0)))
