"""Leads groups from stop to stop while the simulation runs: where they stand, how long, and who stays behind.

Stops change ways, places and targets (GroupState), never a position, a velocity or a force.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from sim.crowd.forces import END
from sim.crowd.formation import standing, to_world
from sim.crowd.group_state import GroupState
from sim.crowd.population import EnteringGroup, PlannedStop, TakenPlaces, is_free
from sim.elementary import length, unit
from sim.types import Array, Scene

LOOK_AHEAD = 3.0  # m from the stop: the group looks for a free place
PATIENCE = 8.0  # s after that: a group that has not reached its place stands where it is
STRAY = 1.5  # m from the stop: the members who stop stay behind
STANDING = 0.5  # m/s: slower people hold their place
RING, RINGS, ANGLES = 0.6, 5, 8  # m between the rings of places round a stop; rings; places on a ring


@dataclass
class _Visit:
    """What one group has before it."""

    group: EnteringGroup
    stops: list[PlannedStop]
    looked: float | None = None  # time at which it looked for a place at this stop, s; None: not yet
    leaves: float | None = None  # time at which it walks on from this stop; None while it walks to it
    places: Array = field(default_factory=lambda: np.zeros((0, 2)))  # (n, 2) where its members stand or will stand, m


class Stops:
    """The stops of the groups of one running simulation; an order of the script ends the stops of its groups.

    State: visits: the stops of each group that has stops left, by group index; stray: the time (s) at which a member
    who stays behind at a stop walks on, by column (person id - 1); left: the time (s) at which a group, or a member who
    stayed behind, last walked on from a stop, by group index.
    """

    def __init__(self, entering: Sequence[EnteringGroup], groups: GroupState, scene: Scene) -> None:
        self.groups, self.scene = groups, scene
        self.visits = {g.index: _Visit(g, list(g.stops)) for g in entering if g.stops and g.head == g.index}
        self.stray: dict[int, float] = {}
        self.left: dict[int, float] = {}

    def advance(self, t: float, state: Array) -> bool:
        """Lets groups stop and walk on at time t (s); returns True if `GroupState.rows` must be called afterwards.

        state (P, 4): x, y, vx, vy by column, nan while absent. A group that comes near a stop walks to the free place
        nearest to the stop and stands there in a circle until the time of the stop is over. If only some members stop,
        they stand still near the stop, and the group walks on without them.
        """
        if not self.visits and not self.stray:
            return False
        over = [column for column, end in self.stray.items() if end <= t]
        for column in over:
            del self.stray[column]
            self.groups.held[column] = False
            self.left[int(self.groups.group_of[column])] = t
        changed = bool(over)
        for g, visit in list(self.visits.items()):
            columns = self.groups.people(g)
            if not self._concerns(visit, g, columns):
                del self.visits[g]
            elif self.groups.present[columns].all():
                changed |= self._advance(g, visit, t, state)
        return changed

    def standing(self) -> list[int]:
        """Returns the groups that stand at a stop."""
        return [g for g, visit in self.visits.items() if visit.leaves is not None]

    def stood(self, g: int, columns: list[int], since: float) -> bool:
        """Returns True if a group has stood at a stop since this time (s), or some of its members have."""
        now = bool(self.groups.held[columns].any()) or (g in self.visits and self.visits[g].leaves is not None)
        return now or self.left.get(g, -np.inf) >= since

    def _concerns(self, visit: _Visit, g: int, columns: list[int]) -> bool:
        exists = self.groups.alive.get(visit.group.name) == g
        return bool(visit.stops) and exists and bool((self.groups.queue_of[columns] < 0).all())

    def _advance(self, g: int, visit: _Visit, t: float, state: Array) -> bool:
        columns = self.groups.members[g]
        stop, pos = visit.stops[0], state[columns, :2]
        middle = pos.mean(axis=0)
        far = float(length(middle - stop.at))
        if visit.leaves is not None:
            if t < visit.leaves:
                return False
            self.left[g] = t
            self._walk_on(g, visit, middle)
            self.groups.form_up(g, state)
            return True
        if not stop.whole:
            if far > STRAY:
                return False
            for column in (columns[m] for m in stop.members):
                self.groups.held[column], self.groups.targets[column] = True, state[column, :2]
                self.stray[column] = stop.end(t)
            self._walk_on(g, visit, middle)
            return True
        if visit.looked is None and far < LOOK_AHEAD:
            visit.looked = t
            place = self._free_place(g, stop.at, self.groups.people(g), state)
            visit.places = self._circle(g, place)
            self.groups.go(g, middle, [], place, "stand", float(self.groups.arrays.speed[g]))
            self.groups.lead(g)
        arrived = bool(self.groups.arrays.arrived[g])
        if visit.looked is None or not (arrived or t >= visit.looked + PATIENCE):
            return False
        if not arrived:
            self.groups.write_way(g, [(middle, END)], "stand", float(self.groups.arrays.speed[g]), middle)
            visit.places = self._circle(g, middle)
        self.groups.settled.add(g)
        self.groups.take_places(columns, standing(len(columns), self.groups.spacing[g]), middle, g, pos)
        visit.leaves = stop.end(t)
        return True

    def _walk_on(self, g: int, visit: _Visit, middle: Array) -> None:
        visit.stops = visit.stops[1:]
        visit.looked, visit.leaves, visit.places = None, None, np.zeros((0, 2))
        via, target, finish = visit.group.leg(visit.stops)
        self.groups.settled.discard(g)
        self.groups.go(g, middle, via, target, finish, float(self.groups.arrays.speed[g]))
        self.groups.lead(g)

    def _circle(self, g: int, middle: Array) -> Array:
        places = standing(len(self.groups.members[g]), self.groups.spacing[g])
        return to_world(places, middle, self.groups.arrays.heading[g])

    def _free_place(self, g: int, at: Array, columns: list[int], state: Array) -> Array:
        """Returns the place (2,) nearest to `at` where a group can stand clear of all others; `at` if none."""
        others = np.ones(len(state), np.bool_)
        others[columns] = False
        slow = others & (length(state[:, 2:]) < STANDING)
        taken = TakenPlaces()
        for places in (state[slow, :2], *(visit.places for other, visit in self.visits.items() if other != g)):
            taken.add(places)
        ring = unit(2 * np.pi * np.arange(ANGLES) / ANGLES)
        rings = [at + k * RING * ring for k in range(1, RINGS + 1)]
        for middle in np.concatenate([at[None], *rings]):
            if is_free(self._circle(g, middle), self.scene, taken):
                return np.asarray(middle)
        return at
