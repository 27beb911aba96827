"""The particles of `relational`: weights, places, velocities, existence, relations, as arrays over people's slots."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sim.types import Array, Bools, Ints
from tracking.papers.relational import transition_kernels


@dataclass
class ParticleSet:
    """P particles over K slots; a slot is one person in all particles (ours), so that means over particles exist.

    log_weights (P,): natural logs, normalised. pos (P, K, 2): m. vel (P, K, 2): m/s. exist (P, K): probability that the
    person exists, given the particle's path (ours: it is computed, not drawn). related (P, K, K) bool, symmetric: which
    pairs walk together.
    """

    log_weights: Array
    pos: Array
    vel: Array
    exist: Array
    related: Bools

    @classmethod
    def empty(cls, particles: int) -> ParticleSet:
        """Return `particles` equally weighted particles without people."""
        two = np.zeros((particles, 0, 2))
        related = np.zeros((particles, 0, 0), bool)
        return cls(np.full(particles, -np.log(particles)), two, two.copy(), np.zeros((particles, 0)), related)

    @property
    def count(self) -> int:
        """Number of particles P."""
        return len(self.log_weights)

    @property
    def people(self) -> int:
        """Number of slots K."""
        return int(self.pos.shape[1])

    @property
    def weights(self) -> Array:
        """The normalised weights (P,)."""
        weights = np.exp(self.log_weights)
        return np.asarray(weights / weights.sum())

    def labels(self) -> Ints:
        """Return the group of each person in each particle, (P, K): the least slot in it."""
        label = np.empty(self.exist.shape, np.int64)
        transition_kernels.group_labels(self.related, label)
        return label

    def take(self, indices: Ints) -> None:
        """Replace the particles by those at `indices` (P,), with equal weights (resampling)."""
        self.log_weights = np.full(self.count, -np.log(self.count))
        self.pos, self.vel = self.pos[indices], self.vel[indices]
        self.exist, self.related = self.exist[indices], self.related[indices]

    def keep(self, slots: Bools) -> None:
        """Remove all slots but those where `slots` (K,) is True."""
        self.pos, self.vel = self.pos[:, slots], self.vel[:, slots]
        self.exist, self.related = self.exist[:, slots], self.related[:, slots][:, :, slots]

    def add(self, pos: Array, vel: Array, exist: float, related: Bools) -> None:
        """Add a slot with places pos (P, 2) and velocities vel (P, 2), the same existence in each particle, and
        relations (P, K) to the slots so far."""
        count, k = self.count, self.people
        self.pos = np.concatenate([self.pos, pos[:, None]], axis=1)
        self.vel = np.concatenate([self.vel, vel[:, None]], axis=1)
        self.exist = np.concatenate([self.exist, np.full((count, 1), exist)], axis=1)
        grown = np.zeros((count, k + 1, k + 1), bool)
        grown[:, :k, :k] = self.related
        grown[:, k, :k] = grown[:, :k, k] = related
        self.related = grown
