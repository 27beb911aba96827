"""Carries out the orders of the script while the simulation runs: fires merges, splits and queues, serves queues.

Orders change who belongs to which group, ways, places and targets (GroupState). They never touch a position, a velocity
or a force. Whether an order came true is checked later, by sim.truth.order_fulfilment.
"""

from __future__ import annotations

import numpy as np

from scenarios.schema.scenario import MergeOrder, QueueOrder, Scenario, SplitOrder
from sim.clock import SCRIPT_RATE, FrameTimes
from sim.crowd.forces import GATHER
from sim.crowd.formation import divide, meeting_point, part_sizes, standing, walking
from sim.crowd.group_state import GroupState
from sim.crowd.population import ScriptPlacement, draw_point
from sim.crowd.queue_service import ServiceQueue
from sim.crowd.triggers import PendingOrder, concerned, rule_holds
from sim.elementary import unit
from sim.rng import draw, rng
from sim.types import Array, Order


def groups_made(scenario: Scenario) -> int:
    """Returns an upper bound of the number of new groups that the orders of a scenario make."""
    return sum(len(e.parts) if isinstance(e, SplitOrder) else 1 for e in scenario.event)


class OrderExecution:
    """Carries out the orders of one scenario on the groups of a running simulation.

    State: pending: all orders, fired or not; come_true: ids of orders whose rule has held long enough; queues: the
    opened ones, by index of their order in the file.
    """

    def __init__(
        self, scenario: Scenario, groups: GroupState, placement: ScriptPlacement, seed: int, repeat: int
    ) -> None:
        self.groups, self.placement, self.seed, self.repeat = groups, placement, seed, repeat
        self.queues: dict[int, ServiceQueue] = {}
        self.come_true: set[str] = set()
        self.pending = [self._pending(order, k) for k, order in enumerate(scenario.event)]

    def _rng(self, role: str, *keys: int) -> np.random.Generator:
        return rng(self.seed, role, *keys, repeat=self.repeat)

    def _pending(self, order: MergeOrder | SplitOrder | QueueOrder, k: int) -> PendingOrder:
        when = order.when
        time = np.inf if when.time is None else draw(when.time, self._rng("event", k, 1))
        at = None if when.reach is None or when.reach.at is None else self.placement.point(np.array(when.reach.at))
        return PendingOrder(order, k, draw(when.delay, self._rng("event", k, 0)), time, at)

    def advance(self, tick: int, t: float, state: Array) -> bool:
        """Fires orders that are due at tick and time t (s), serves queues, and lets arrived groups settle.

        state (P, 4): x, y, vx, vy by column, nan while absent. Returns True if something changed for `GroupState.fill`.
        """
        changed = bool(self.queues)
        for pending in self.pending:
            if pending.fired is None and pending.is_due(t, state, self.groups, self.come_true):
                self._fire(pending, tick, state)
                changed = True
            elif pending.fired is not None and pending.true_at is None:
                pending.watch(t, rule_holds(pending, state, self.groups.targets))
                if pending.true_at is not None:
                    self.come_true.add(pending.order.id)
        for k, queue in self.queues.items():
            self._serve(k, queue, t, state)
        return self.groups.settle_arrived(state) or changed

    def _fire(self, pending: PendingOrder, tick: int, state: Array) -> None:
        pending.fired = tick
        order = pending.order
        if isinstance(order, MergeOrder):
            self._merge(pending, order, state)
        elif isinstance(order, SplitOrder):
            self._split(pending, order, state)
        else:
            self._line_up(pending, order)

    def _merge(self, pending: PendingOrder, order: MergeOrder, state: Array) -> None:
        groups, arrays = self.groups, self.groups.arrays
        parents = [self._end(name) for name in order.groups]
        parts = [list(groups.members[g]) for g in parents]
        pending.before = tuple(tuple(c) for c in parts)
        columns = sorted(c for part in parts for c in part)
        pending.after = (tuple(columns),)
        g = groups.new_group(order.into, columns, float(np.mean([groups.spacing[p] for p in parents])))
        # No faster than the slowest parent: nobody runs to a merge.
        pace = min(float(arrays.speed[p]) for p in parents)
        r = self._rng("event", pending.index, 2)
        middles = np.array([state[c, :2].mean(axis=0) for c in parts])
        speeds = np.array([arrays.speed[p] for p in parents])
        goal = None if order.goal == "meet" else draw_point(order.goal, self.placement, r)
        meeting = meeting_point(middles, speeds, goal)
        groups.goals[g] = (meeting, "stand") if goal is None else (goal, order.at_goal)
        if goal is None:
            groups.write_way(g, [(meeting, GATHER)], "stand", pace, meeting)
            places = standing(len(columns), groups.spacing[g])
            groups.settled.add(g)
        else:
            via = [draw_point(p, self.placement, r) for p in order.via]
            speed = min(pace, groups.walking_speed(columns))
            groups.go(g, meeting, via, goal, order.at_goal, speed, gather=meeting)
            places = walking(len(columns), groups.spacing[g])
        groups.take_places(columns, places, meeting, g, state[columns, :2])

    def _end(self, name: str) -> int:
        g = self.groups.alive.pop(name)
        # A group that is in a queue leaves it.
        for queue in self.queues.values():
            queue.remove(g)
        return g

    def _split(self, pending: PendingOrder, order: SplitOrder, state: Array) -> None:
        groups = self.groups
        parent = self._end(order.group)
        columns = groups.members[parent]
        pending.before = (tuple(columns),)
        r = self._rng("event", pending.index, 2)
        goals = [draw_point(part.goal, self.placement, r) for part in order.parts]
        middle = state[columns, :2].mean(axis=0)
        sizes = part_sizes([part.size for part in order.parts], len(columns))
        part_of = divide(state[columns, :2] - middle, np.array(goals) - middle, sizes)
        after = []
        for k, (part, goal) in enumerate(zip(order.parts, goals, strict=True)):
            own = [c for c, p in zip(columns, part_of, strict=True) if p == k]
            after.append(tuple(own))
            g = groups.new_group(part.id, own, groups.spacing[parent])
            here = state[own, :2].mean(axis=0)
            via = [draw_point(p, self.placement, r) for p in part.via]
            groups.goals[g] = (goal, part.at_goal)
            groups.go(g, here, via, goal, part.at_goal, groups.walking_speed(own))
            groups.take_places(own, walking(len(own), groups.spacing[g]), here, g, state[own, :2])
            # A part turns to its goal, as people do, and does not jump round.
            groups.arrays.heading[g] = groups.arrays.heading[parent]
        pending.after = tuple(after)

    def _line_up(self, pending: PendingOrder, order: QueueOrder) -> None:
        groups = self.groups
        queuing = [groups.alive[n] for n in concerned(order, list(groups.alive))]
        for queue in self.queues.values():
            for g in queuing:
                queue.remove(g)
        r = self._rng("service", pending.index)
        service = {g: draw(order.service, r) for g in queuing}
        along = self.placement.vector(unit(order.direction_deg / 180 * np.pi))
        head = self.placement.point(np.array(order.at))
        self.queues[pending.index] = ServiceQueue(head, along, order.spacing, service, coming=list(queuing))
        columns = [c for g in queuing for c in groups.members[g]]
        groups.queue_of[columns] = pending.index
        pending.before = tuple(tuple(groups.members[g]) for g in queuing)
        pending.after = (tuple(sorted(columns)),)
        q = self._rng("event", pending.index, 2)
        for g in queuing:
            goal, finish = groups.goals[g]
            groups.goals[g] = (
                goal if order.goal is None else draw_point(order.goal, self.placement, q),
                finish if order.goal is None else order.at_goal,
            )

    def _serve(self, k: int, queue: ServiceQueue, t: float, state: Array) -> None:
        groups = self.groups
        slots, done = queue.advance(t, groups.members, state[:, :2])
        for column, slot in slots.items():
            groups.targets[column] = slot
        for g in done:
            columns = groups.members[g]
            groups.queue_of[columns] = -1
            goal, finish = groups.goals[g]
            groups.go(g, state[columns, :2].mean(axis=0), [], goal, finish, groups.walking_speed(columns))
            groups.settled.discard(g)
            groups.places[columns] = walking(len(columns), groups.spacing[g])

    def record(self, frames: FrameTimes) -> tuple[Order, ...]:
        """Returns all orders of the script with the frame at which each fired, and its people before and after."""

        def ids(parts: tuple[tuple[int, ...], ...]) -> tuple[tuple[int, ...], ...]:
            return tuple(tuple(c + 1 for c in part) for part in parts)

        def order(p: PendingOrder) -> Order:
            fired, time = (None, None) if p.fired is None else (frames.frame_of(p.fired), p.fired / SCRIPT_RATE)
            return Order(p.order.id, p.order.type, fired, ids(p.before), ids(p.after), time)

        return tuple(order(p) for p in self.pending)
