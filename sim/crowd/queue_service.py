"""Moves queues on: who stands where, which group joins at the tail, which group is served and leaves.

Groups join at the tail in the order in which they reach it; the members of a group stay together and are served as one.
Queues are recognised in measured motion by sim.truth.queue_detection, which knows nothing of this module.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from sim.types import Array

JOIN_RADIUS = 0.5  # m from the first free place: a group has joined
SERVED_RADIUS = 0.35  # m from the head's place: service can begin


@dataclass
class ServiceQueue:
    """One queue at a service point.

    Fixed: head (2,): the head's place, m; along (2,): unit vector from the head to the tail; spacing: m; service: s for
    each group. State: joined: groups in the queue, head first; coming: groups on their way to it; busy_until: when the
    group at the head is done, s, None while it is not being served.
    """

    head: Array
    along: Array
    spacing: float
    service: dict[int, float]
    joined: list[int] = field(default_factory=list)
    coming: list[int] = field(default_factory=list)
    busy_until: float | None = None

    def slot(self, k: int) -> Array:
        """Returns the k-th place (2,), m; 0 is the head's."""
        return self.head + k * self.spacing * self.along

    def advance(self, t: float, members: dict[int, list[int]], pos: Array) -> tuple[dict[int, Array], list[int]]:
        """Moves the queue on to time t (s).

        Returns the place (2,) in m of each person by column, of groups that are coming, too; and the groups that are
        done, at most one. members: columns of each group's people; of a group that is coming they are sorted by their
        distance from the head, in place. pos (P, 2): m, by column.
        """
        done = self._serve(t, members, pos)
        tail = sum(len(members[g]) for g in self.joined)
        self.coming.sort(key=lambda g: (float(np.min(np.linalg.norm(pos[members[g]] - self.slot(tail), axis=1))), g))
        slots: dict[int, Array] = {}
        k = 0
        for g in self.joined:
            k = self._give_slots(g, k, members, slots)
        while self.coming and self._has_reached(self.coming[0], k, members, pos):
            self.joined.append(self.coming.pop(0))
            k = self._give_slots(self.joined[-1], k, members, slots)
        for g in self.coming:
            members[g].sort(key=lambda c: (float(np.linalg.norm(pos[c] - self.head)), c))
            k = self._give_slots(g, k, members, slots)
        return slots, done

    def _give_slots(self, g: int, k: int, members: dict[int, list[int]], slots: dict[int, Array]) -> int:
        """Gives the members of group g the places from k on; returns the next free one."""
        for column in members[g]:
            slots[column] = self.slot(k)
            k += 1
        return k

    def _has_reached(self, g: int, k: int, members: dict[int, list[int]], pos: Array) -> bool:
        return bool(np.min(np.linalg.norm(pos[members[g]] - self.slot(k), axis=1)) < JOIN_RADIUS)

    def _serve(self, t: float, members: dict[int, list[int]], pos: Array) -> list[int]:
        """Starts the service of the first group when its first member is at the head; returns it when it is done."""
        if not self.joined:
            return []
        first = self.joined[0]
        if self.busy_until is None:
            if np.linalg.norm(pos[members[first][0]] - self.head) < SERVED_RADIUS:
                self.busy_until = t + self.service[first]
            return []
        if t < self.busy_until:
            return []
        self.busy_until = None
        return [self.joined.pop(0)]
