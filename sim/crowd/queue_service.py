"""Moves queues on: who stands where, which group joins at the tail, which group is served and leaves.

Groups join at the tail in the order in which they reach it; the members of a group stay together and are served as one.
Queues are recognised in measured motion by sim.truth.queue_detection, which knows nothing of this module.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from sim.elementary import length
from sim.types import Array

JOIN_RADIUS = 0.5  # m from the first free place: a group has joined
SERVED_RADIUS = 0.35  # m from the head's place: service can begin


@dataclass
class ServiceQueue:
    """One queue at a service point. Groups are given by index; a group is served as a whole."""

    head: Array
    along: Array  # (2,) unit vector from head to tail
    spacing: float  # between neighbouring places, m
    # service time in s of each group, by group index. State: joined: groups in the queue, head first.
    service: dict[int, float]
    joined: list[int] = field(default_factory=list)
    coming: list[int] = field(default_factory=list)  # groups on their way to it
    # time at which the group at the head is done, s; None while no group is being served
    busy_until: float | None = None

    def slot(self, k: int) -> Array:
        """Returns the place (2,) with index k in the queue; 0 is the head's."""
        return self.head + k * self.spacing * self.along

    def remove(self, g: int) -> None:
        """Takes group g out of the queue, if it is in it, as when it merges; its service ends."""
        if self.joined[:1] == [g]:
            self.busy_until = None
        self.joined = [other for other in self.joined if other != g]
        self.coming = [other for other in self.coming if other != g]

    def advance(self, t: float, members: dict[int, list[int]], pos: Array) -> tuple[dict[int, Array], list[int]]:
        """Advances the queue to time t (s): ends and begins service, and lets groups join at the tail.

        Returns the place of each person by column, and the group that was served, in a list. members: columns of each
        group; those of a group still coming are sorted, nearest to the head first. pos (P, 2): m.
        """
        done = self._serve(t, members, pos)
        tail = sum(len(members[g]) for g in self.joined)
        self.coming.sort(key=lambda g: (float(np.min(length(pos[members[g]] - self.slot(tail)))), g))
        slots: dict[int, Array] = {}
        k = 0
        for g in self.joined:
            k = self._give_slots(g, k, members, slots)
        while self.coming and self._has_reached(self.coming[0], k, members, pos):
            self.joined.append(self.coming.pop(0))
            k = self._give_slots(self.joined[-1], k, members, slots)
        for g in self.coming:
            members[g].sort(key=lambda c: (float(length(pos[c] - self.head)), c))
            k = self._give_slots(g, k, members, slots)
        return slots, done

    def _give_slots(self, g: int, k: int, members: dict[int, list[int]], slots: dict[int, Array]) -> int:
        """Writes the places of a group's members from index k on; returns the next free index."""
        for column in members[g]:
            slots[column] = self.slot(k)
            k += 1
        return k

    def _has_reached(self, g: int, k: int, members: dict[int, list[int]], pos: Array) -> bool:
        return bool(np.min(length(pos[members[g]] - self.slot(k))) < JOIN_RADIUS)

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
