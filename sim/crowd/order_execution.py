"""Carries out the orders of the script while the simulation runs: when they fire, what they do, how queues are served.

Orders change who belongs to which group, ways, places and targets (GroupState). They never touch a position, a velocity
or a force. For the trigger `after` they are also examined for having come true; the truth of a sequence is measured
later, from its motion, by sim.truth.order_fulfilment. Groups join a queue at the tail in the order in which they reach
it; the members of a group stay together and are served as one.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from scenarios.schema.scenario import MergeOrder, QueueOrder, Scenario, SplitOrder, expand
from sim.clock import SCRIPT_RATE, FrameTimes
from sim.crowd.forces import GATHER
from sim.crowd.formation import divide, meeting_point, part_sizes, standing, walking
from sim.crowd.group_state import GroupState
from sim.crowd.population import ScriptPlacement, draw_point
from sim.elementary import length, unit
from sim.rng import draw, rng
from sim.truth.merge_split_rules import Separation, separation
from sim.truth.order_fulfilment import PATIENCE, RULE_TIME, queued
from sim.types import Array, Order

JOIN_RADIUS = 0.5  # m from the first free place: a group has joined
SERVED_RADIUS = 0.35  # m from the head's place: service can begin


@dataclass
class ServiceQueue:
    """One queue at a service point. Groups are given by index; a group is served as a whole."""

    head: Array
    counters: Array  # (K, 2) m: where people are served; K = 0: at the head
    along: Array  # (2,) unit vector from head to tail
    spacing: float  # between neighbouring places, m
    # service time in s of each group, by group index. State: joined: groups in the queue, head first.
    service: dict[int, float]
    joined: list[int] = field(default_factory=list)
    coming: list[int] = field(default_factory=list)  # groups on their way to it
    # time at which the group at the head is done, s; None while no group is being served
    busy_until: float | None = None
    # by number of the counter: the group there or on its way there, and the time at which the group there is done, s
    called: dict[int, int] = field(default_factory=dict)
    until: dict[int, float] = field(default_factory=dict)

    def slot(self, k: int) -> Array:
        """Returns the place (2,) m of the k-th person in the queue; k = 0 is the head."""
        return self._behind(self.head, k)

    def _behind(self, first: Array, k: int) -> Array:
        return first + k * self.spacing * self.along

    def remove(self, g: int) -> None:
        """Takes group g out of the queue if the group is in it. If it is being served, its service is broken off."""
        if self.joined[:1] == [g]:
            self.busy_until = None
        self.joined = [other for other in self.joined if other != g]
        self.coming = [other for other in self.coming if other != g]
        for k in [k for k, other in self.called.items() if other == g]:
            del self.called[k]
            self.until.pop(k, None)

    def advance(self, t: float, members: dict[int, list[int]], pos: Array) -> tuple[dict[int, Array], list[int]]:
        """Advances the queue to time t (s): ends and begins service, and lets groups join at the tail.

        Returns the place (2,) m of each person by column, and the indices of the groups whose service has ended now.
        members: columns of each group, by group index; for a group that is still coming
        this list is sorted in place, nearest to the head first. pos (P, 2): m, by column.
        """
        done = self._serve_at_counters(t, members, pos) if len(self.counters) else self._serve(t, members, pos)

        def far(g: int, tail: int) -> float:
            return float(np.min(length(pos[members[g]] - self.slot(tail))))

        tail = sum(len(members[g]) for g in self.joined)
        self.coming.sort(key=lambda g: (far(g, tail), g))
        while self.coming and far(self.coming[0], tail) < JOIN_RADIUS:
            self.joined.append(self.coming.pop(0))
            tail += len(members[self.joined[-1]])
        for g in self.coming:
            members[g].sort(key=lambda c: (float(length(pos[c] - self.head)), c))
        line = [column for g in self.joined + self.coming for column in members[g]]
        places = {column: self.slot(k) for k, column in enumerate(line)}
        for k, g in self.called.items():
            places |= {column: self._behind(self.counters[k], n) for n, column in enumerate(members[g])}
        return places, done

    def _serve_at_counters(self, t: float, members: dict[int, list[int]], pos: Array) -> list[int]:
        """Returns the groups whose service ends by time t; calls the first group of the queue to a free counter."""
        done = []
        for k, g in list(self.called.items()):
            if k not in self.until and length(pos[members[g][0]] - self.counters[k]) < SERVED_RADIUS:
                self.until[k] = t + self.service[g]
            elif t >= self.until.get(k, np.inf):
                del self.until[k]
                done.append(self.called.pop(k))
        free = [k for k in range(len(self.counters)) if k not in self.called]
        if free and self.joined and length(pos[members[self.joined[0]][0]] - self.head) < SERVED_RADIUS:
            nearest = min(free, key=lambda k: float(length(self.counters[k] - self.head)))
            self.called[nearest] = self.joined.pop(0)
        return done

    def _serve(self, t: float, members: dict[int, list[int]], pos: Array) -> list[int]:
        """Returns the group whose service ends by time t, in a list; begins the service of the next."""
        if not self.joined:
            return []
        first = self.joined[0]
        if self.busy_until is None:
            if length(pos[members[first][0]] - self.head) < SERVED_RADIUS:
                self.busy_until = t + self.service[first]
            return []
        if t < self.busy_until:
            return []
        self.busy_until = None
        return [self.joined.pop(0)]


EPS = 1e-9  # s


@dataclass
class PendingOrder:
    """One order of the script and its progress. Times are in s after the first recorded frame."""

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
    # of a queue: states (P, 4) of everybody at each tick since the order fired
    seen: list[Array] = field(default_factory=list)
    nearest: float = np.inf  # m: least distance so far of which the trigger asks for a smaller one
    # before, after: columns (person id - 1) of the people of each group before and after the order; empty until it
    # fires. Times count from the first recorded frame.
    before: tuple[tuple[int, ...], ...] = ()
    after: tuple[tuple[int, ...], ...] = ()

    def is_due(self, t: float, state: Array, groups: GroupState, come_true: set[str]) -> bool:
        """Returns True if the order fires at time t (s): its groups are present, and its trigger was met `delay` s ago.

        state (P, 4): x, y, vx, vy by column. come_true: ids of the orders whose rule has held long enough.
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
            gaps = _separations(state, [groups.people(groups.alive[n]) for n in names])
            gap = max((float(gap.distance[0]) for gap in gaps), default=np.inf)
            self.nearest = min(self.nearest, gap)
            return gap < when.distance_lt
        assert when.reach is not None
        g = groups.alive.get(when.reach.group)
        if g is None or not groups.all_present(g):
            return False
        at = groups.goals[g][0] if self.reach_at is None else self.reach_at
        middle = state[groups.people(g), :2].mean(axis=0)
        gap = float(length(middle - at))
        self.nearest = min(self.nearest, gap)
        return gap < when.reach.radius

    def obstacle(self, groups: GroupState) -> str:
        """Returns in words, at the end of the recording, why the order has not fired."""
        when, names = self.order.when, concerned(self.order, list(groups.alive))
        absent = [n for n in names if n not in groups.alive or not groups.all_present(groups.alive[n])]
        if absent or not names:
            return f"at the end, {', '.join(absent) or 'all groups'} were not in the scene"
        if self.met_at is not None:
            return f"its trigger was met at {self.met_at:g} s, and `delay` is {self.delay:.1f} s"
        if when.after is not None:
            return f"{when.after} had not come true"
        return f"its groups came within {self.nearest:.2f} m" if np.isfinite(self.nearest) else ""

    def watch(self, t: float, state: Array) -> None:
        """Sets `true_at` to t (s) if the order's rule has held by now for the time that its kind requires.

        state (P, 4): x, y, vx, vy by column, nan while absent. A queue is measured as the truth measures it.
        """
        if isinstance(self.order, QueueOrder):
            if len(self.seen) <= PATIENCE * SCRIPT_RATE:
                self.seen.append(state.copy())
                done = queued({c + 1 for c in self.after[0]}, np.array(self.seen), SCRIPT_RATE)
                self.true_at = t if done else None
            return
        self.held_for = self.held_for + 1 / SCRIPT_RATE if rule_holds(self, state) else 0.0
        if self.held_for >= RULE_TIME[self.order.type] - EPS:
            self.true_at = t


def concerned(order: MergeOrder | SplitOrder | QueueOrder, alive: list[str]) -> list[str]:
    """Returns the names of the groups that an order concerns, each once.

    alive: names of the existing groups. `g-*` in the order stands for all of them that begin with `g-`.
    """
    if isinstance(order, SplitOrder):
        return [order.group]
    return list(dict.fromkeys(n for pattern in order.groups for n in expand(pattern, alive)))


def rule_holds(pending: PendingOrder, state: Array) -> bool:
    """Returns True if the rule of a merge or split that has fired holds at this tick.

    state (P, 4): x, y, vx, vy by column, nan while absent.
    """
    order = pending.order
    parts = [list(p) for p in (pending.before if isinstance(order, MergeOrder) else pending.after)]
    if not all(np.isfinite(state[p]).all() for p in parts):
        return False
    gaps = _separations(state, parts)
    if isinstance(order, MergeOrder):
        # A chain of parts is together although its ends are far apart.
        return sum(bool(gap.merge_rule()[0]) for gap in gaps) >= len(parts) - 1
    return all(bool(gap.split_rule()[0]) for gap in gaps)


def _separations(state: Array, parts: list[list[int]]) -> list[Separation]:
    """Returns how far apart the people of each pair of parts (columns) are."""
    pos, vel = state[None, :, :2], state[None, :, 2:]
    return [separation(pos, vel, np.array(a), np.array(b)) for k, a in enumerate(parts) for b in parts[k + 1 :]]


def groups_made(scenario: Scenario) -> int:
    """Returns an upper bound of the number of new groups that the orders of a scenario make."""
    return sum(len(e.parts) if isinstance(e, SplitOrder) else 1 for e in scenario.event)


class OrderExecution:
    """Carries out the orders of one scenario on the groups of a running simulation.

    State: pending: all orders, fired or not; come_true: ids of orders whose rule has held long enough; awaited: ids of
    orders that others wait for (`after`); queues: the opened ones, by index of their order in the file.
    """

    def __init__(
        self, scenario: Scenario, groups: GroupState, placement: ScriptPlacement, seed: int, repeat: int
    ) -> None:
        self.groups, self.placement, self.seed, self.repeat = groups, placement, seed, repeat
        self.queues: dict[int, ServiceQueue] = {}
        self.come_true: set[str] = set()
        self.awaited = {order.when.after for order in scenario.event}
        self.pending = [self._pending(order, k) for k, order in enumerate(scenario.event)]

    def _rng(self, role: str, *keys: int) -> np.random.Generator:
        return rng(self.seed, role, *keys, repeat=self.repeat)

    def _pending(self, order: MergeOrder | SplitOrder | QueueOrder, k: int) -> PendingOrder:
        when = order.when
        time = np.inf if when.time is None else draw(when.time, self._rng("event", k, 1))
        at = None if when.reach is None or when.reach.at is None else self.placement.point(np.array(when.reach.at))
        return PendingOrder(order, k, draw(when.delay, self._rng("event", k, 0)), time, at)

    def advance(self, tick: int, t: float, state: Array) -> bool:
        """Fires the orders that are due at this tick of time t (s), and serves queues.

        state (P, 4): x, y, vx, vy by column, nan while absent. Groups that have arrived to stand form a circle. Returns
        True if `GroupState.rows` must be called afterwards.
        """
        changed = bool(self.queues)
        for pending in self.pending:
            if pending.fired is None and pending.is_due(t, state, self.groups, self.come_true):
                pending.fired, changed = tick, True
                if isinstance(pending.order, MergeOrder):
                    self._merge(pending, pending.order, state)
                elif isinstance(pending.order, SplitOrder):
                    self._split(pending, pending.order, state)
                else:
                    self._line_up(pending, pending.order)
            elif pending.fired is not None and pending.true_at is None and pending.order.id in self.awaited:
                pending.watch(t, state)
                if pending.true_at is not None:
                    self.come_true.add(pending.order.id)
        for queue in self.queues.values():
            self._serve(queue, t, state)
        return self.groups.settle_arrived(state) or changed

    def _merge(self, pending: PendingOrder, order: MergeOrder, state: Array) -> None:
        groups, arrays = self.groups, self.groups.arrays
        parents = [self._end(name) for name in order.groups]
        parts = [groups.people(g) for g in parents]
        pending.before, speeds = tuple(map(tuple, parts)), arrays.speed[parents]
        columns = sorted(c for part in parts for c in part)
        pending.after = (tuple(columns),)
        g = groups.new_group(order.into, columns, parents)
        # No faster than the slowest parent: nobody runs to a merge.
        pace = float(speeds.min())
        r = self._rng("event", pending.index, 2)
        middles = np.array([state[c, :2].mean(axis=0) for c in parts])
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
            for part in self.groups.processions[g]:
                queue.remove(part)
        return g

    def _split(self, pending: PendingOrder, order: SplitOrder, state: Array) -> None:
        groups = self.groups
        parent = self._end(order.group)
        columns = groups.people(parent)
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
            g = groups.new_group(part.id, own, [parent])
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
        lined = [groups.alive[n] for n in concerned(order, list(groups.alive))]
        queuing = [part for g in lined for part in groups.processions[g]]
        for queue in self.queues.values():
            for g in queuing:
                queue.remove(g)
        r = self._rng("service", pending.index)
        service = {g: draw(order.service, r) for g in queuing}
        along = self.placement.vector(unit(order.direction_deg / 180 * np.pi))
        head = self.placement.point(np.array(order.at))
        counters = np.array([self.placement.point(np.array(at)) for at in order.counters or ()]).reshape(-1, 2)
        self.queues[pending.index] = ServiceQueue(head, counters, along, order.spacing, service, coming=list(queuing))
        columns = [c for g in queuing for c in groups.members[g]]
        groups.queue_of[columns] = pending.index
        pending.before = tuple(tuple(groups.people(g)) for g in lined)
        pending.after = (tuple(sorted(columns)),)
        if order.goal is not None:
            q = self._rng("event", pending.index, 2)
            groups.goals.update({g: (draw_point(order.goal, self.placement, q), order.at_goal) for g in queuing})

    def _serve(self, queue: ServiceQueue, t: float, state: Array) -> None:
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

    def unfired(self) -> tuple[tuple[str, str], ...]:
        """Returns the id of each order that has not fired, and why, in words."""
        return tuple((p.order.id, p.obstacle(self.groups)) for p in self.pending if p.fired is None)

    def record(self, frames: FrameTimes) -> tuple[Order, ...]:
        """Returns all orders of the script with the frame (from 1) of firing, and the people before and after."""

        def ids(parts: tuple[tuple[int, ...], ...]) -> tuple[tuple[int, ...], ...]:
            return tuple(tuple(c + 1 for c in part) for part in parts)

        def order(p: PendingOrder) -> Order:
            fired, time = (None, None) if p.fired is None else (frames.frame_of(p.fired), p.fired / SCRIPT_RATE)
            return Order(p.order.id, p.order.type, fired, ids(p.before), ids(p.after), time)

        return tuple(order(p) for p in self.pending)
