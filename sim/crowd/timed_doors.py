"""Doors that open at times: which of them are shut, and whose people pass first when one opens.

A shut door is a wall. When its time is over nobody enters it any more, and it shuts once nobody stands in it. When it
opens, the people in the smaller room, such as a vehicle, pass first, and the others stand aside meanwhile.
"""

from __future__ import annotations

import numpy as np

from scenarios.schema.geometry import cut_walls
from scenarios.schema.world import WorldSpec
from sim.crowd.arrival import room_sizes
from sim.crowd.forces import CLOSING, FIRST, HOLDER, SHUT
from sim.crowd.navigation import CLEARANCE
from sim.elementary import length
from sim.geometry.walls import wall_distances
from sim.types import Array, Bools, Scene

IN_DOOR = 0.35  # m: people nearer to a door stand in it
EPS = 1e-9  # s


class TimedDoors:
    """The doors of one running simulation; at first all with times are shut. State: the first D rows of gate_state
    (K, 3), that of `Wayfinding`."""

    def __init__(self, world: WorldSpec, scene: Scene, gate_state: Array) -> None:
        self.world, self.scene, self.gate_state = world, scene, gate_state[: len(scene.doors)]
        self.times = {k: door.open for k, door in enumerate(world.doors[: len(scene.doors)]) if door.open is not None}
        self.gate_state[list(self.times), HOLDER] = SHUT
        self._left_first = {k: self._side_left_first(scene.doors[k]) for k in self.times}

    @property
    def shut(self) -> Bools:
        """Flags (D,), True for doors that are shut."""
        return np.asarray(self.gate_state[:, HOLDER] == SHUT)

    def advance(self, t: float, pos: Array) -> bool:
        """Opens and shuts doors at time t (s); returns True if there was one. pos (P, 2): m, nan while absent."""
        before = self.shut
        for k, times in self.times.items():
            if any(start - EPS <= t < end - EPS for start, end in times):
                if self.gate_state[k, HOLDER] >= SHUT:
                    side = self._left_first[k]
                    self.gate_state[k] = side, -FIRST * abs(side), 0.0
            elif self.gate_state[k, HOLDER] != SHUT:
                occupied = (wall_distances(pos, self.scene.doors[k]) < IN_DOOR).any()
                self.gate_state[k, HOLDER] = CLOSING if occupied else SHUT
        return bool((before != self.shut).any())

    def walls(self) -> Array:
        """Returns the walls (W, 2, 2) m, with the doors that are shut as parts of them."""
        shut = set(np.flatnonzero(self.shut).tolist())
        opened = tuple(door for k, door in enumerate(self.world.doors) if k not in shut)
        return np.array(cut_walls(self.world.model_copy(update={"doors": opened}))[0]).reshape(-1, 2, 2)

    def _side_left_first(self, door: Array) -> float:
        """Returns the side of a door, 1.0 for its left or -1.0, on which the smaller room is; 0.0 if they are one."""
        along = (door[1] - door[0]) / length(door[1] - door[0])
        aside = CLEARANCE * np.array([-along[1], along[0]])
        (room, left), (other, right) = room_sizes(
            self.scene, self.walls(), door.mean(axis=0) + np.stack([aside, -aside])
        )
        return 0.0 if room == other else 1.0 if left < right else -1.0
