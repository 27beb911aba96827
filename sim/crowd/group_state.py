"""The state of groups while the simulation runs: who belongs to which group, each group's way, and people's places in
formations and queues.

Nothing here touches a position, a velocity or a force. The physics reads this state through `rows` and the kernels'
arrays.
"""

from __future__ import annotations

import numpy as np

from scenarios.schema.scenario import CrowdSpec

# isort: off
# fmt: off
from sim.crowd.forces import (
    ALIGN, ALONE, END, FLOCK_ALIGNMENT, FLOCK_REACH, FREE, GATHER, IN_GROUP, LEAVE, PASS, REACH, STAND, TO_TARGET,
    GroupArrays, PeopleArrays,
)
# fmt: on
# isort: on
from sim.crowd.formation import assign, standing, to_world, walking
from sim.crowd.navigation import Navigator
from sim.crowd.population import EnteringGroup, walking_speed
from sim.elementary import length
from sim.types import Array, Ints

WAY = 32  # waypoints of a group for which there is room from the start
WALK_ON = 1000.0  # m that a group walks on beyond its goal
MAX_QUEUE_SPEED = 1.4  # m/s, of people on the way to their place in a queue


class GroupState:
    """The groups of a running simulation, by group index, and their people, by column (person id - 1).

    A sub-group is a group here, and the group of the script, its procession, has the index of the first one, the head.
    State: alive: index of each existing group by name; processions: the indices of its sub-groups, front first, by
    index; arrays: the ways of groups, as the kernels use them; next_group: index of the next new group; settled:
    indices of groups that stand in a circle. By group index, also for groups that ended: members (columns), spacing
    (m), goals (point and "stand", "leave" or "walk"); gate (G, W): the gate that each waypoint lies in, FREE or CORNER
    for none; beyond (G, W): the side of it to which the way leads, 1.0 for its left, or -1.0. everybody: all people, by
    column, as the kernels use those who are present; its columns are also places (in the formation, m), group_of (group
    index), mode and queue_of (index of the queue order, -1 in no queue). Also by column: targets (place in the queue,
    or where a held person stands, m); held: True for a person who stays behind at a stop; alone: True for a person who
    walks alone, at `share` of the speed, to the point `aims`, m; waypoint (the first one not passed); apart: of people
    who have lost the group, the first column of those with whom they walk, else -1; gone: True for a person who has
    come to the end of the way alone, and leaves; present; free_speed (m/s).
    """

    def __init__(self, entering: list[EnteringGroup], new: int, navigator: Navigator, crowd: CrowdSpec) -> None:
        """Starts with nobody present. new: greatest number of groups that orders make."""
        people = [m for g in entering for m in g.members]
        self.navigator, self.crowd = navigator, crowd
        self.arrays = GroupArrays.empty(len(entering) + new, WAY)
        self.next_group = len(entering)
        self.alive: dict[str, int] = {g.name: g.head for g in entering}
        self.processions: dict[int, list[int]] = {g.head: [] for g in entering}
        self.members: dict[int, list[int]] = {g.index: [m.column for m in g.members] for g in entering}
        self.spacing: dict[int, float] = {g.index: g.spacing for g in entering}
        self.goals: dict[int, tuple[Array, str]] = {g.index: (g.goal, g.finish) for g in entering}
        self.free_speed = np.array([m.free_speed for m in people])
        self.everybody = PeopleArrays.empty(len(people))
        self.places = self.everybody.place
        self.group_of, self.mode, self.queue_of, self.procession_of = self.everybody.tag.T
        self.targets, self.aims = np.zeros((2, len(people), 2))
        self.share = np.ones(len(people))
        self.alone, self.gone = np.zeros(len(people), np.bool_), np.zeros(len(people), np.bool_)
        self.waypoint, self.apart = np.zeros(len(people), np.int64), np.full(len(people), -1)
        self.gate, self.beyond = np.full(self.arrays.kind.shape, FREE), np.zeros(self.arrays.kind.shape)
        for g in entering:
            self.group_of[self.members[g.index]] = g.index
            self.processions[g.head].append(g.index)
            self.arrays.head[g.index], self.arrays.gap[g.index] = g.head, g.gap
            self._hold_together(g.index, g.flock)
        self.held = np.zeros(len(people), np.bool_)
        self.present = np.zeros(len(people), np.bool_)
        self.settled: set[int] = set()

    def people(self, g: int) -> list[int]:
        """Returns the columns of the members of group g, of all of its sub-groups if it has some."""
        return [c for part in self.processions[g] for c in self.members[part]]

    def all_present(self, g: int) -> bool:
        """Returns True if every member of group g is in the scene."""
        return bool(self.present[self.people(g)].all())

    def enter(self, group: EnteringGroup) -> None:
        """Records the group's members as present, starts its way and gives them places in the formation."""
        g = group.index
        way = group.leg(group.stops)
        if not group.walks and len(self.processions[group.head]) > 1:  # each part stands where it is
            way = [], group.pos.mean(axis=0), way[2]
        self.go(g, group.start, *way, group.speed)
        columns = self.members[g]
        self.present[columns] = True
        places = walking(len(columns), group.spacing)
        if not group.walks:
            places = standing(len(columns), group.spacing)
            self.settled.add(g)
        self.places[columns] = places

    def remove_leaving(self, columns: Ints) -> list[int]:
        """Records as absent the people whose group leaves the scene and has reached the end of its way.

        columns (N,): the people to examine; those in a queue stay. Returns the columns of the people who left.
        """
        done = self.arrays.arrived & (self.arrays.finish == LEAVE)
        if not done.any() and not self.gone.any():
            return []
        out = done[self.group_of[columns]] & (self.queue_of[columns] < 0) | self.gone[columns]
        gone = [int(c) for c in columns[out]]
        self.present[gone] = False
        for g in {int(self.group_of[c]) for c in gone if self.gone[c]}:  # the others are a smaller group
            stay = [c for c in self.members[g] if self.present[c]]
            if stay:
                self.places[stay] -= self.places[stay].mean(axis=0)
        return gone

    def go(
        self, g: int, start: Array, via: list[Array], goal: Array, finish: str, speed: float,
        gather: Array | None = None,
    ) -> None:  # fmt: skip
        """Sets the way of group g from start past the via points to goal, round walls and through doors.

        Points (2,) are in m, speed in m/s. finish: what the group does at the goal, "stand", "leave" the scene or
        "walk" straight on. gather: an additional first waypoint, where the group waits for all members; None: no such
        point.
        """
        way: list[tuple[Array, int]] = [] if gather is None else [(gather, GATHER)]
        gates = [FREE] * len(way)
        here = start if gather is None else gather
        for target in [*via, goal]:
            found = self.navigator.way(here, target)
            # Where no way exists, the group walks straight.
            points, gate = found if found is not None else (target[None], np.full(1, FREE))
            way += [(p, PASS) for p in points]
            gates += gate.tolist()
            here = target
        if finish == "walk":
            along = goal - (way[-2][0] if len(way) > 1 else start)
            way[-1] = (goal + WALK_ON * along / max(float(length(along)), 1e-9), END)
        way[-1] = (way[-1][0], END)
        self.write_way(g, way, finish, speed, start)
        self.gate[g, : len(gates)] = gates
        passing = [start, *(point for point, _ in way)]
        for k, passed in enumerate(gates):
            if passed >= 0:
                self.beyond[g, k] = self.navigator.beyond(passed, passing[k], passing[min(k + 2, len(way))])

    def lead(self, g: int) -> None:
        """Gives the sub-groups behind the head g its way; they follow it."""
        arrays = self.arrays
        for part in self.processions[g][1:]:
            way = arrays.route, arrays.kind, arrays.length, arrays.current, arrays.finish, self.gate, self.beyond
            for values in way:
                values[part] = values[g]
            arrays.arrived[part], arrays.filing[part], arrays.held_up[part] = False, False, 0.0
            self.waypoint[self.members[part]] = 0

    def ahead(self, g: int) -> list[Array]:
        """Returns the points (2,) m that a group has yet to pass, without doors and the end of its way."""
        current, count = int(self.arrays.current[g]), int(self.arrays.length[g])
        points = [k for k in range(current, count) if self.arrays.kind[g, k] == PASS and self.gate[g, k] < 0]
        return [self.arrays.route[g, k] for k in points]

    def gathers(self, g: int) -> bool:
        """Returns True if the group waits for others at the first point of its way."""
        return bool(self.arrays.kind[g, self.arrays.current[g]] == GATHER)

    def write_way(self, g: int, way: list[tuple[Array, int]], finish: str, speed: float, start: Array) -> None:
        """Overwrites the waypoints, speed (m/s) and finish of group g; the group starts anew at the first waypoint.

        way: pairs of a point (2,) m and a kind of waypoint (PASS, GATHER, END). finish: as in `go`. start (2,):
        the group's position in m, from which the group turns to its first waypoint.
        """
        self.arrays = arrays = self.arrays.with_room(len(way))
        if room := arrays.kind[0].size - self.gate[0].size:
            self.gate = np.pad(self.gate, ((0, 0), (0, room)), constant_values=FREE)
            self.beyond = np.pad(self.beyond, ((0, 0), (0, room)))
        self.gate[g] = FREE
        for k, (point, kind) in enumerate(way):
            arrays.route[g, k], arrays.kind[g, k] = point, kind
        arrays.length[g], arrays.current[g], arrays.speed[g] = len(way), 0, speed
        arrays.finish[g] = LEAVE if finish == "leave" else STAND
        arrays.arrived[g], arrays.filing[g], arrays.held_up[g] = False, False, 0.0
        first = way[0][0] if way[0][1] != GATHER or len(way) == 1 else way[1][0]
        ahead = first - (way[0][0] if way[0][1] == GATHER else start)
        size = float(length(ahead))
        if size > 1e-6:
            arrays.heading[g] = ahead / size
        self.waypoint[self.members[g]] = 0

    def _hold_together(self, g: int, flock: bool) -> None:
        """Sets the forces between the members of group g. flock: it has no formation."""
        crowd, boids = self.crowd, self.arrays.boids[g]
        self.arrays.flock[g] = flock
        boids *= crowd.separation, 1.0, crowd.alignment, crowd.cohesion
        if flock:
            boids[REACH], boids[ALIGN] = FLOCK_REACH * self.spacing[g], FLOCK_ALIGNMENT * crowd.alignment

    def new_group(self, name: str, columns: list[int], parents: list[int]) -> int:
        """Makes a group of the people in `columns`, takes them out of queues, and returns the new group's index.

        parents: the groups they come from. It keeps their mean spacing, and is a flock if all of them were.
        """
        g = self.next_group
        self.next_group += 1
        self.alive[name], self.members[g], self.processions[g] = g, sorted(columns), [g]
        self.spacing[g] = float(np.mean([self.spacing[p] for p in parents]))
        self._hold_together(g, bool(self.arrays.flock[parents].all()))
        self.group_of[columns] = g
        self.queue_of[columns] = -1
        return g

    def walking_speed(self, columns: list[int]) -> float:
        """Returns the speed in m/s of a group of the people in `columns`; see `population.walking_speed`."""
        return walking_speed(list(self.free_speed[columns]), self.crowd.slowdown_per_member)

    def take_places(self, columns: list[int], places: Array, middle: Array, g: int, pos: Array) -> None:
        """Gives each of the people in `columns` one of the places (n, 2) of group g, so that they walk least together.

        places: m forward and left of the group's middle (2,) m. pos (n, 2): the people's positions, m.
        """
        points = to_world(places, middle, self.arrays.heading[g])
        self.places[columns] = places[assign(pos, points)]

    def settle_arrived(self, state: Array) -> bool:
        """Puts groups that have just arrived at a goal where they stand into a circle.

        state (P, 4): x, y, vx, vy by column. Returns True if there was such a group.
        """
        changed = False
        arrived = self.arrays.arrived & (self.arrays.finish == STAND)
        for g in (part for head in self.alive.values() for part in self.processions[head]):
            if arrived[g] and g not in self.settled:
                self.settled.add(g)
                columns = [c for c in self.members[g] if self.present[c]]
                pos = state[columns, :2]
                middle = pos.mean(axis=0)
                if self.arrays.head[g] != g:  # it stands behind the others, not at their goal
                    self.write_way(g, [(middle, END)], "stand", float(self.arrays.speed[g]), middle)
                    self.arrays.arrived[g] = True
                self.take_places(columns, standing(len(columns), self.spacing[g]), middle, g, pos)
                changed = True
        return changed

    def form_up(self, g: int, state: Array) -> None:
        """Gives members of group g and its sub-groups, who stood, places to walk in. state (P, 4): by column."""
        for part in self.processions[g]:
            self.settled.discard(part)
            columns, pos = self.members[part], state[self.members[part], :2]
            self.take_places(columns, walking(len(columns), self.spacing[part]), pos.mean(axis=0), part, pos)

    def intent(self, columns: Ints) -> Ints:
        """Returns the group that each person in columns (N,) means to be in; of the lost a number beyond all groups."""
        apart = self.apart[columns]
        return np.where(apart >= 0, len(self.arrays.length) + apart, self.arrays.head[self.group_of[columns]])

    def subgroups(self) -> Ints:
        """Returns the index of the sub-group of each person (P,); -1 for who is absent or in a group without any."""
        several = np.bincount(self.arrays.head)[self.arrays.head[self.group_of]] > 1
        return np.where(self.present & several, self.group_of, -1)

    def rows(self, columns: Ints) -> PeopleArrays:
        """Returns copies of the arrays of the people in columns (N,), for the kernels."""
        speed, group = self.arrays.speed[self.group_of], self.group_of
        self.procession_of[:] = self.arrays.head[group]
        self.mode[:] = np.where(self.alone, ALONE, np.where((self.queue_of >= 0) | self.held, TO_TARGET, IN_GROUP))
        self.everybody.pace[:] = np.where(self.alone, speed * self.share, np.minimum(speed, MAX_QUEUE_SPEED))
        flocks = self.arrays.flock[group] & (self.mode == IN_GROUP)
        if flocks.any():  # each at the own speed, together as fast as the group
            total, count = (np.bincount(group, weights) for weights in (self.free_speed, None))
            self.everybody.pace[flocks] = (speed * self.free_speed * count[group] / total[group])[flocks]
        self.everybody.target[:] = np.where(self.alone[:, None], self.aims, self.targets)
        return PeopleArrays._make(values[columns] for values in self.everybody)
