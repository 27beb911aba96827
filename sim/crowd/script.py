"""The script at work: who belongs to whom, where groups go, when orders fire and what they change.

Orders change intent (`group_of`), ways, places and targets; they never touch a position, a velocity or a force.
"""

from __future__ import annotations

import numpy as np

from scenarios.schema.scenario import MergeOrder, QueueOrder, Scenario, SplitOrder, expand
from scenarios.schema.values import draw
from sim.crowd.formation import assign, place, standing, walking
from sim.crowd.meeting import meeting_point, part_sizes, share_out
from sim.crowd.navigation import Navigator
from sim.crowd.population import STANDS, Party, frame_of, point_of, walking_speed
from sim.crowd.queue_service import Line
from sim.crowd.steering import END, GATHER, IN_GROUP, LEAVE, NARROW, PASS, STAND, TO_TARGET, Groups, People
from sim.crowd.triggers import Pending, has_come_true
from sim.rng import rng
from sim.types import Array, Ints, Order

MAX_WAY = 32
FAR = 1000.0  # m that somebody who walks on has before him


class Script:
    """State: groups' ways (`groups`), everybody's group, place, target and queue by column, and the pending orders."""

    def __init__(self, scenario: Scenario, parties: list[Party], navigator: Navigator, seed: int, repeat: int) -> None:
        self.scenario, self.navigator, self.seed, self.repeat = scenario, navigator, seed, repeat
        self.frame = frame_of(scenario, seed, repeat)
        self.parties, self.waiting = parties, list(parties)
        people = [m for p in parties for m in p.members]
        made = sum(len(e.parts) if isinstance(e, SplitOrder) else 1 for e in scenario.event)
        self.groups = Groups.empty(len(parties) + made, MAX_WAY)
        self.next_group = len(parties)
        self.alive: dict[str, int] = {p.name: p.index for p in parties}
        self.members: dict[int, list[int]] = {p.index: [m.column for m in p.members] for p in parties}
        self.spacing: dict[int, float] = {p.index: p.spacing for p in parties}
        self.goals: dict[int, tuple[Array, str]] = {p.index: (p.goal, p.finish) for p in parties}
        self.free_speed = np.array([m.free_speed for m in people])
        self.group_of = np.zeros(len(people), np.int64)
        for index, columns in self.members.items():
            self.group_of[columns] = index
        self.places = np.zeros((len(people), 2))
        self.targets = np.zeros((len(people), 2))
        self.queue_of = np.full(len(people), -1)
        self.waypoint = np.zeros(len(people), np.int64)
        self.present = np.zeros(len(people), np.bool_)
        self.settled: set[int] = set()
        self.lines: dict[int, Line] = {}
        self.pending = [
            Pending(e, k, draw(e.when.delay, rng(seed, "event", k, 0, repeat=repeat)), self._time(e, k))
            for k, e in enumerate(scenario.event)
        ]

    def _time(self, event: MergeOrder | SplitOrder | QueueOrder, k: int) -> float:
        time = event.when.time
        return np.inf if time is None else draw(time, rng(self.seed, "event", k, 1, repeat=self.repeat))

    # coming and going

    def walks(self, party: Party) -> bool:
        """Whether the group has somewhere to go at its start."""
        return bool(np.linalg.norm(party.goal - party.start) > STANDS)

    def enter(self, party: Party) -> None:
        """The group comes: its way begins, its members take their places."""
        self.waiting.remove(party)
        g = party.index
        self._go(g, party.start, party.via, party.goal, party.finish, party.speed)
        columns = self.members[g]
        self.present[columns] = True
        offsets = walking(len(columns), party.spacing)
        if not self.walks(party):
            offsets = standing(len(columns), party.spacing)
            self.settled.add(g)
        self.places[columns] = offsets

    def leaving(self, columns: Ints) -> list[int]:
        """Columns of those present whose group has arrived where it leaves the scene."""
        done = self.groups.arrived & (self.groups.finish == LEAVE)
        if not done.any():
            return []
        out = done[self.group_of[columns]] & (self.queue_of[columns] < 0)
        gone = [int(c) for c in columns[out]]
        self.present[gone] = False
        return gone

    def _go(
        self,
        g: int,
        start: Array,
        via: list[Array],
        goal: Array,
        finish: str,
        speed: float,
        gather: Array | None = None,
    ) -> None:
        """Give group g a way; `gather`: a place where it waits for all its members first."""
        way: list[tuple[Array, int]] = [] if gather is None else [(gather, GATHER)]
        here = start if gather is None else gather
        for target in [*via, goal]:
            found = self.navigator.way(here, target)
            points, narrow = found if found is not None else (target[None], np.zeros(1, dtype=bool))
            way += [(p, NARROW if n else PASS) for p, n in zip(points, narrow, strict=True)]
            here = target
        if finish == "walk":
            along = goal - (way[-2][0] if len(way) > 1 else start)
            way[-1] = (goal + FAR * along / max(float(np.linalg.norm(along)), 1e-9), END)
        way[-1] = (way[-1][0], END)
        self._write_way(g, way[:MAX_WAY], finish, speed, start)

    def _write_way(self, g: int, way: list[tuple[Array, int]], finish: str, speed: float, start: Array) -> None:
        groups = self.groups
        for k, (point, kind) in enumerate(way):
            groups.route[g, k], groups.kind[g, k] = point, kind
        groups.length[g], groups.at[g], groups.speed[g] = len(way), 0, speed
        groups.finish[g] = LEAVE if finish == "leave" else STAND
        groups.arrived[g] = False
        first = way[0][0] if way[0][1] != GATHER or len(way) == 1 else way[1][0]
        ahead = first - (way[0][0] if way[0][1] == GATHER else start)
        size = float(np.linalg.norm(ahead))
        if size > 1e-6:
            groups.heading[g] = ahead / size
        self.waypoint[self.members[g]] = 0

    # each frame

    def advance(self, frame: int, t: float, state: Array) -> bool:
        """Fire what is due at time t, serve the queues, let those who have arrived stand in a circle.

        Whether anything may have changed that `fill` writes.
        """
        changed = bool(self.lines)
        for pending in self.pending:
            if pending.fired is None and pending.is_due(t, state, self):
                self._fire(pending, frame, state)
                changed = True
            elif pending.fired is not None and pending.true_at is None:
                pending.watch(t, self.scenario.camera.fps, has_come_true(pending, state, self))
        for k, line in self.lines.items():
            self._serve(k, line, t, state)
        for g in np.flatnonzero(self.groups.arrived):
            if int(g) not in self.settled and self.groups.finish[g] == STAND:
                self._stand(int(g), state)
                changed = True
        return changed

    def _stand(self, g: int, state: Array) -> None:
        self.settled.add(g)
        columns = [c for c in self.members[g] if self.present[c]]
        pos = state[columns, :2]
        offsets = standing(len(columns), self.spacing[g])
        slots = place(offsets, pos.mean(axis=0), self.groups.heading[g])
        self.places[columns] = offsets[assign(pos, slots)]

    def _fire(self, pending: Pending, frame: int, state: Array) -> None:
        pending.fired = frame + 1
        event = pending.event
        if isinstance(event, MergeOrder):
            self._merge(pending, event, state)
        elif isinstance(event, SplitOrder):
            self._split(pending, event, state)
        else:
            self._line_up(pending, event)

    def _new_group(self, name: str, columns: list[int], spacing: float) -> int:
        g = self.next_group
        self.next_group += 1
        self.alive[name], self.members[g], self.spacing[g] = g, sorted(columns), spacing
        self.group_of[columns] = g
        self.queue_of[columns] = -1
        return g

    def _pace(self, columns: list[int]) -> float:
        return walking_speed(list(self.free_speed[columns]), self.scenario.crowd.slowdown_per_member)

    def _merge(self, pending: Pending, event: MergeOrder, state: Array) -> None:
        parents = [self.alive.pop(name) for name in event.groups]
        parts = [list(self.members[g]) for g in parents]
        pending.before = tuple(tuple(c) for c in parts)
        columns = sorted(c for part in parts for c in part)
        pending.after = (tuple(columns),)
        g = self._new_group(event.into, columns, float(np.mean([self.spacing[p] for p in parents])))
        pace = min(float(self.groups.speed[p]) for p in parents)
        r = rng(self.seed, "event", pending.index, 2, repeat=self.repeat)
        middles = np.array([state[c, :2].mean(axis=0) for c in parts])
        speeds = np.array([self.groups.speed[p] for p in parents])
        goal = None if event.goal == "meet" else point_of(event.goal, self.frame, r)
        meeting = meeting_point(middles, speeds, goal)
        if goal is None:
            self._write_way(g, [(meeting, GATHER)], "stand", pace, meeting)
            offsets = standing(len(columns), self.spacing[g])
            self.settled.add(g)
        else:
            via = [point_of(p, self.frame, r) for p in event.via]
            self._go(g, meeting, via, goal, event.at_goal, min(pace, self._pace(columns)), gather=meeting)
            offsets = walking(len(columns), self.spacing[g])
        slots = place(offsets, meeting, self.groups.heading[g])
        self.places[columns] = offsets[assign(state[columns, :2], slots)]

    def _split(self, pending: Pending, event: SplitOrder, state: Array) -> None:
        parent = self.alive.pop(event.group)
        columns = self.members[parent]
        pending.before = (tuple(columns),)
        r = rng(self.seed, "event", pending.index, 2, repeat=self.repeat)
        goals = [point_of(part.goal, self.frame, r) for part in event.parts]
        middle = state[columns, :2].mean(axis=0)
        sizes = part_sizes([part.size for part in event.parts], len(columns))
        owner = share_out(state[columns, :2] - middle, np.array(goals) - middle, sizes)
        after = []
        for k, (part, goal) in enumerate(zip(event.parts, goals, strict=True)):
            mine = [c for c, o in zip(columns, owner, strict=True) if o == k]
            after.append(tuple(mine))
            g = self._new_group(part.id, mine, self.spacing[parent])
            here = state[mine, :2].mean(axis=0)
            via = [point_of(p, self.frame, r) for p in part.via]
            self._go(g, here, via, goal, part.at_goal, self._pace(mine))
            offsets = walking(len(mine), self.spacing[g])
            slots = place(offsets, here, self.groups.heading[g])
            self.places[mine] = offsets[assign(state[mine, :2], slots)]
            self.groups.heading[g] = self.groups.heading[parent]
        pending.after = tuple(after)

    def _line_up(self, pending: Pending, event: QueueOrder) -> None:
        names = [n for pattern in event.groups for n in expand(pattern, list(self.alive))]
        groups = [self.alive[n] for n in names]
        r = rng(self.seed, "service", pending.index, repeat=self.repeat)
        service = {g: draw(event.service, r) for g in groups}
        a = np.deg2rad(event.direction_deg)
        along = self.frame.vector(np.array([np.cos(a), np.sin(a)]))
        line = Line(self.frame.point(np.array(event.at)), along, event.spacing, service, coming=list(groups))
        self.lines[pending.index] = line
        columns = [c for g in groups for c in self.members[g]]
        self.queue_of[columns] = pending.index
        pending.before = tuple(tuple(self.members[g]) for g in groups)
        pending.after = (tuple(sorted(columns)),)
        q = rng(self.seed, "event", pending.index, 2, repeat=self.repeat)
        for g in groups:
            goal, finish = self.goals.get(g, (line.head, "stand"))
            self.goals[g] = (
                goal if event.goal is None else point_of(event.goal, self.frame, q),
                finish if event.goal is None else event.at_goal,
            )

    def _serve(self, k: int, line: Line, t: float, state: Array) -> None:
        slots, done = line.advance(t, self.members, state[:, :2])
        for column, slot in slots.items():
            self.targets[column] = slot
        for g in done:
            columns = self.members[g]
            self.queue_of[columns] = -1
            goal, finish = self.goals[g]
            self._go(g, state[columns, :2].mean(axis=0), [], goal, finish, self._pace(columns))
            self.settled.discard(g)
            self.places[columns] = walking(len(columns), self.spacing[g])

    # for the kernel and the record

    def fill(self, people: People, columns: Ints) -> None:
        """Write groups, places, modes, queues and targets of those present, in the order of `columns`."""
        queue = self.queue_of[columns]
        people.place[:] = self.places[columns]
        people.target[:] = self.targets[columns]
        people.pace[:] = np.minimum(self.groups.speed[self.group_of[columns]], 1.4)
        people.tag[:, 0] = self.group_of[columns]
        people.tag[:, 1] = np.where(queue >= 0, TO_TARGET, IN_GROUP)
        people.tag[:, 2] = queue
        people.tag[:, 3] = self.waypoint[columns]

    def orders(self) -> tuple[Order, ...]:
        """All orders, fired or not, with person ids (column + 1)."""

        def ids(parts: tuple[tuple[int, ...], ...]) -> tuple[tuple[int, ...], ...]:
            return tuple(tuple(c + 1 for c in part) for part in parts)

        return tuple(Order(p.event.id, p.event.type, p.fired, ids(p.before), ids(p.after)) for p in self.pending)
