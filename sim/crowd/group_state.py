"""The state of groups while the simulation runs: who belongs to which group, and each group's way.

Nothing here touches a position, a velocity or a force. The physics reads this state through `fill` and the kernels'
arrays.
"""

from __future__ import annotations

import numpy as np

from sim.crowd.forces import (
    END,
    GATHER,
    GROUP,
    IN_GROUP,
    LEAVE,
    MODE,
    NARROW,
    PASS,
    QUEUE,
    STAND,
    TO_TARGET,
    WAYPOINT,
    GroupArrays,
    PeopleArrays,
)
from sim.crowd.formation import assign, standing, to_world, walking
from sim.crowd.navigation import Navigator
from sim.crowd.population import EnteringGroup, walking_speed
from sim.types import Array, Ints

MAX_WAY = 32  # waypoints
WALK_ON = 1000.0  # m that a group walks on beyond its goal
MAX_QUEUE_SPEED = 1.4  # m/s, of people on the way to their place in a queue


class GroupState:
    """Groups by index and people by column.

    State: `alive` (index of each existing group by name); `members` (columns), `spacing` (m) and `goals` (point, what
    to do there) by group index; `arrays` (ways of the groups, as the kernels use them); `settled` (groups that stand in
    a circle); by column: `group_of`, `queue_of` (-1: none), `present`, `places` (P, 2) in the formation, `targets`
    (P, 2) in a queue, `waypoint` (first waypoint not passed).
    """

    def __init__(self, entering: list[EnteringGroup], new: int, navigator: Navigator, slowdown: float) -> None:
        """`new`: how many groups orders may still make; `slowdown`: m/s for each member after the first."""
        people = [m for g in entering for m in g.members]
        self.navigator, self.slowdown = navigator, slowdown
        self.arrays = GroupArrays.empty(len(entering) + new, MAX_WAY)
        self.next_group = len(entering)
        self.alive: dict[str, int] = {g.name: g.index for g in entering}
        self.members: dict[int, list[int]] = {g.index: [m.column for m in g.members] for g in entering}
        self.spacing: dict[int, float] = {g.index: g.spacing for g in entering}
        self.goals: dict[int, tuple[Array, str]] = {g.index: (g.goal, g.finish) for g in entering}
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

    def all_present(self, g: int) -> bool:
        """True if every member of group g is in the scene."""
        return bool(self.present[self.members[g]].all())

    def enter(self, group: EnteringGroup) -> None:
        """Marks the members as present, starts the group's way and gives the members their places."""
        g = group.index
        self.go(g, group.start, group.via, group.goal, group.finish, group.speed)
        columns = self.members[g]
        self.present[columns] = True
        places = walking(len(columns), group.spacing)
        if not group.walks:
            places = standing(len(columns), group.spacing)
            self.settled.add(g)
        self.places[columns] = places

    def remove_leaving(self, columns: Ints) -> list[int]:
        """Returns those of the columns whose group has arrived where it leaves, and marks them as absent.

        People in a queue stay.
        """
        done = self.arrays.arrived & (self.arrays.finish == LEAVE)
        if not done.any():
            return []
        out = done[self.group_of[columns]] & (self.queue_of[columns] < 0)
        gone = [int(c) for c in columns[out]]
        self.present[gone] = False
        return gone

    def go(
        self,
        g: int,
        start: Array,
        via: list[Array],
        goal: Array,
        finish: str,
        speed: float,
        gather: Array | None = None,
    ) -> None:
        """Gives group g a way from start past via to goal, points (2,) in m, round walls and through doors.

        finish: "stand", "leave" or "walk" (straight on beyond the goal); speed: m/s; gather: point where the group
        first waits for all members, None to start at once. Where no way exists, the group walks straight. Waypoints
        after the first MAX_WAY are dropped.
        """
        way: list[tuple[Array, int]] = [] if gather is None else [(gather, GATHER)]
        here = start if gather is None else gather
        for target in [*via, goal]:
            found = self.navigator.way(here, target)
            points, narrow = found if found is not None else (target[None], np.zeros(1, dtype=bool))
            way += [(p, NARROW if n else PASS) for p, n in zip(points, narrow, strict=True)]
            here = target
        if finish == "walk":
            along = goal - (way[-2][0] if len(way) > 1 else start)
            way[-1] = (goal + WALK_ON * along / max(float(np.linalg.norm(along)), 1e-9), END)
        way[-1] = (way[-1][0], END)
        self.write_way(g, way[:MAX_WAY], finish, speed, start)

    def write_way(self, g: int, way: list[tuple[Array, int]], finish: str, speed: float, start: Array) -> None:
        """Writes a way, (point, kind) each, to the arrays of group g, which then faces the first point from start."""
        arrays = self.arrays
        for k, (point, kind) in enumerate(way):
            arrays.route[g, k], arrays.kind[g, k] = point, kind
        arrays.length[g], arrays.current[g], arrays.speed[g] = len(way), 0, speed
        arrays.finish[g] = LEAVE if finish == "leave" else STAND
        arrays.arrived[g] = False
        first = way[0][0] if way[0][1] != GATHER or len(way) == 1 else way[1][0]
        ahead = first - (way[0][0] if way[0][1] == GATHER else start)
        size = float(np.linalg.norm(ahead))
        if size > 1e-6:
            arrays.heading[g] = ahead / size
        self.waypoint[self.members[g]] = 0

    def new_group(self, name: str, columns: list[int], spacing: float) -> int:
        """Makes a group of the people in these columns, takes them out of queues, and returns its index."""
        g = self.next_group
        self.next_group += 1
        self.alive[name], self.members[g], self.spacing[g] = g, sorted(columns), spacing
        self.group_of[columns] = g
        self.queue_of[columns] = -1
        return g

    def walking_speed(self, columns: list[int]) -> float:
        """Returns the speed in m/s of a group of these people."""
        return walking_speed(list(self.free_speed[columns]), self.slowdown)

    def take_places(self, columns: list[int], places: Array, middle: Array, g: int, pos: Array) -> None:
        """Gives each person at pos (n, 2) the nearest of the places (n, 2) of group g, whose middle is at `middle`."""
        points = to_world(places, middle, self.arrays.heading[g])
        self.places[columns] = places[assign(pos, points)]

    def settle_arrived(self, state: Array) -> bool:
        """Lets groups that have arrived stand in a circle; returns True if there was one. state (P, 4) by column."""
        changed = False
        for g in np.flatnonzero(self.arrays.arrived).tolist():
            if g not in self.settled and self.arrays.finish[g] == STAND:
                self.settled.add(g)
                columns = [c for c in self.members[g] if self.present[c]]
                pos = state[columns, :2]
                self.take_places(columns, standing(len(columns), self.spacing[g]), pos.mean(axis=0), g, pos)
                changed = True
        return changed

    def fill(self, people: PeopleArrays, columns: Ints) -> None:
        """Writes groups, places, modes, queues and targets of the people in these columns to the kernels' arrays."""
        queue = self.queue_of[columns]
        people.place[:] = self.places[columns]
        people.target[:] = self.targets[columns]
        people.pace[:] = np.minimum(self.arrays.speed[self.group_of[columns]], MAX_QUEUE_SPEED)
        people.tag[:, GROUP] = self.group_of[columns]
        people.tag[:, MODE] = np.where(queue >= 0, TO_TARGET, IN_GROUP)
        people.tag[:, QUEUE] = queue
        people.tag[:, WAYPOINT] = self.waypoint[columns]
