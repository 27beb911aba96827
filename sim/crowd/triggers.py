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
    """One order of the script (merge, split or queue) and what became of it.

    - order; index: in the file, from 0; delay: s between trigger and firing; time: of a `time` trigger, s, else inf.
    - reach_at (2,): place of a `reach` trigger in the world, m; None: the group's goal, or no such trigger.
    - fired: tick of the script, from 0, at which it fired, None: not yet. met_at: time at which the trigger (the
      order's condition for firing) was first met, s; None: not yet.
    - held_for: s for which the order's rule (people are together, apart or in line, as ordered) has held without a
      break. true_at: time at which it had held long enough, s; None: not yet.
    - before, after: columns (person id - 1) of the people of each group before and after the order; empty until it
      fires. Times count from the first recorded frame.
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
        """Returns True if the order fires at time t (s, 0 in the first recorded frame); records in met_at when its
        trigger was first met.

        An order fires `delay` seconds after its trigger was first met, even if the trigger is no longer met. It fires
        only while every group it concerns exists and is wholly in the scene; until then the trigger is not examined
        either. A queue whose patterns match no group concerns none and may fire. state (P, 4): x, y, vx, vy by column,
        m, m/s. groups: the running groups, with their members and goals. come_true: ids of the orders that have come
        true.
        """
        names = concerned(self.order, list(groups.alive))
        if not all(n in groups.alive and groups.all_present(groups.alive[n]) for n in names):
            return False
        if self.met_at is None and self._is_met(t, state, groups, names, come_true):
            self.met_at = t
        return self.met_at is not None and t >= self.met_at + self.delay - EPS

    def _is_met(self, t: float, state: Array, groups: GroupState, names: list[str], come_true: set[str]) -> bool:
        """Returns True if the order's trigger is met at time t, s.

        - time: t has reached it. after: the order with that id is in come_true, the ids of orders that have come true.
        - distance_lt: in every two of the groups `names`, the nearest members are closer than it, m; False for fewer
          than two groups.
        - reach: the mean position of the trigger's group is nearer to the place than its radius; False if that group no
          longer exists or is not wholly in the scene.

        state (P, 4): x, y, vx, vy by column, m, m/s. names: of the groups that the order concerns.
        """
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
        """Adds one tick to held_for if the order's rule `holds` at this tick, else sets it to 0. Returns nothing.

        Sets true_at = t (s) once the rule has held for its time: 2 s for merge and split, 3 s for queue.
        """
        self.held_for = self.held_for + 1 / SCRIPT_RATE if holds else 0.0
        if self.held_for >= RULE_TIME[self.order.type] - EPS:
            self.true_at = t


def concerned(order: MergeOrder | SplitOrder | QueueOrder, alive: list[str]) -> list[str]:
    """Returns the names of the groups that an order concerns, in the order in which the order names them.

    A split concerns one group. alive: names of all existing groups. `g-*` stands for all existing names that begin with
    `g-`, in the order of alive; there may be none. A plain name is returned even if no such group exists. A name that
    several patterns match is returned once.
    """
    if isinstance(order, SplitOrder):
        return [order.group]
    return list(dict.fromkeys(n for pattern in order.groups for n in expand(pattern, alive)))


def rule_holds(pending: PendingOrder, state: Array, targets: Array) -> bool:
    """Returns True if the rule of an order that has fired holds in this frame: the people are together, apart or in
    line.

    state (P, 4): x, y, vx, vy by column, m, m/s, nan while absent. targets (P, 2): places in the queue, m, by column.

    - Queue: at least 3 of its people (all if they are fewer) are within IN_PLACE (0.4 m) of their targets; absent
      people are not.
    - Merge of n groups: at least n - 1 pairs of them are nearer than 1.5 m and differ by less than 0.5 m/s.
    - Split: all pairs of parts are more than 2.5 m apart, or more than 1.5 m and differ by more than 0.7 m/s.

    Distances are those of the nearest members, velocities the members' means. A merge or split does not hold while one
    of its people is absent. pending: the order with the columns of its people before and after.
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
    """Returns the distance in m of the nearest two people, one of columns a and one of columns b; nan if one of them is
    absent.

    state (P, 4): x, y, vx, vy, m, m/s, nan while absent. Raises ValueError if a or b is empty.
    """
    return float(length(state[a, None, :2] - state[None, b, :2]).min())


def _velocity_difference(state: Array, a: list[int], b: list[int]) -> float:
    """Returns the length in m/s of the difference of the mean velocities of columns a and b; nan if one of them is
    absent.

    state (P, 4): x, y, vx, vy, m, m/s, nan while absent.
    """
    return float(length(state[a, 2:].mean(axis=0) - state[b, 2:].mean(axis=0)))
