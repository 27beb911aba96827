"""Queues: who stands where, who is served, who walks on.

People join at the tail in the order in which they reach it, the members of a group together; a group is served as one.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from sim.types import Array

JOIN_RADIUS = 0.5  # m from one's slot: has joined
SERVED_RADIUS = 0.35  # m from the head's place: service can begin


@dataclass
class Line:
    """One queue. State: groups in line (joined, first = head), groups on their way, and when the head is done."""

    head: Array
    along: Array
    spacing: float
    service: dict[int, float]
    joined: list[int] = field(default_factory=list)
    coming: list[int] = field(default_factory=list)
    busy_until: float | None = None

    def slot(self, k: int) -> Array:
        """The k-th place, 0 being the head's."""
        return self.head + k * self.spacing * self.along

    def advance(self, t: float, members: dict[int, list[int]], pos: Array) -> tuple[dict[int, Array], list[int]]:
        """Slots of all people by column, and the groups that are done at time t.

        members: columns of each group's people, in the order in which they stand; pos (P, 2) by column.
        """
        done = self._serve(t, members, pos)
        tail = sum(len(members[g]) for g in self.joined)
        self.coming.sort(key=lambda g: (float(np.min(np.linalg.norm(pos[members[g]] - self.slot(tail), axis=1))), g))
        slots: dict[int, Array] = {}
        k = 0
        for g in self.joined:
            k = self._stand(g, k, members, slots)
        while self.coming and self._has_reached(self.coming[0], k, members, pos):
            self.joined.append(self.coming.pop(0))
            k = self._stand(self.joined[-1], k, members, slots)
        for g in self.coming:
            members[g].sort(key=lambda c: (float(np.linalg.norm(pos[c] - self.head)), c))
            k = self._stand(g, k, members, slots)
        return slots, done

    def _stand(self, g: int, k: int, members: dict[int, list[int]], slots: dict[int, Array]) -> int:
        for column in members[g]:
            slots[column] = self.slot(k)
            k += 1
        return k

    def _has_reached(self, g: int, k: int, members: dict[int, list[int]], pos: Array) -> bool:
        return bool(np.min(np.linalg.norm(pos[members[g]] - self.slot(k), axis=1)) < JOIN_RADIUS)

    def _serve(self, t: float, members: dict[int, list[int]], pos: Array) -> list[int]:
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
