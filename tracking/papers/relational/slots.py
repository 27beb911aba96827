"""What `relational` knows of people beside the particles: ids, time since the last measurement, sizes of boxes."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from sim.types import Array, Bools, Ints
from tracking.detect.point_detections import followed_sizes
from tracking.filters.person_streams import Keys


@dataclass
class Slots:
    """The people of a sequence, one row for each of K slots of the particles (all ours).

    id (K,): the track's id, -1 until the person is first reported. missed (K,): time without a measurement in which the
    person could have been seen, s, 0 if measured in this frame. size (K, 2): width and height of the box, px, nan if
    none was measured. next_id: the next new id.
    """

    id: Ints = field(default_factory=lambda: np.zeros(0, np.int64))
    missed: Array = field(default_factory=lambda: np.zeros(0))
    size: Array = field(default_factory=lambda: np.zeros((0, 2)))
    key: Keys = field(default_factory=lambda: np.zeros(0, np.uint64))
    next_id: int = 1

    def add(self, size: Array, key: Keys) -> None:
        """Add people who are measured in this frame; size (M, 2): width, height of the boxes, px, nan without; key
        (M,)."""
        self.id = np.append(self.id, np.full(len(size), -1))
        self.missed = np.append(self.missed, np.zeros(len(size)))
        self.size, self.key = np.concatenate([self.size, size]), np.concatenate([self.key, key])

    def keep(self, rows: Bools) -> None:
        """Remove all people but those where `rows` (K,) is True."""
        self.id, self.missed, self.size = self.id[rows], self.missed[rows], self.size[rows]
        self.key = self.key[rows]

    def measure(self, seen: Array, pairs: Array, sizes: Array | None, dt: Array) -> None:
        """Note who was measured in a frame: those with seen (K,) above 1/2; dt (K,): s by which others count as
        missed."""
        self.missed = np.where(seen > 0.5, 0.0, self.missed + dt)
        if sizes is None or not pairs.size:
            return
        best = pairs.argmax(axis=1)
        sure = pairs[np.arange(len(best)), best] > 0.5
        self.size[sure] = followed_sizes(self.size[sure], sizes[best[sure]], dt[sure, None])

    def name(self, rows: Bools) -> None:
        """Give new ids to the people where `rows` (K,) is True who have none."""
        new = np.flatnonzero(rows & (self.id < 0))
        self.id[new] = self.next_id + np.arange(len(new))
        self.next_id += len(new)
