"""The particles of `relational`: weights, places, velocities, existence, relations, as arrays over people's slots.

Slots are divided into clusters. Each cluster has weights of its own and is resampled by itself, so that the weights of
many people do not become those of one particle; the posterior is taken for a product over clusters (ours). The paper's
filter is that of one cluster.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sim.types import Array, Bools, Ints
from tracking.filters.particles import effective_number, residual_resample, systematic_resample
from tracking.papers.relational import transition_kernels


@dataclass
class ParticleSet:
    """P particles over K slots; a slot is one person in all particles (ours), so that means over particles exist.

    count: P. weights (P, K): of the particles, sum 1 for each slot; slots of a cluster have equal columns. cluster
    (K,): the least slot of each slot's cluster. pos (P, K, 2): m. vel (P, K, 2): m/s. exist (P, K): probability that
    the person exists, given the particle's path (ours: it is computed, not drawn). related (P, K, K) bool, symmetric:
    which pairs walk together. ancestor (P, K): the particle from which each slot's state descends, since `ancestor` was
    last set to the particles' own numbers.
    """

    count: int
    weights: Array
    cluster: Ints
    pos: Array
    vel: Array
    exist: Array
    related: Bools
    ancestor: Ints

    @classmethod
    def empty(cls, count: int) -> ParticleSet:
        """Return `count` particles without people."""
        flat, two = np.zeros((count, 0)), np.zeros((count, 0, 2))
        none = np.zeros((count, 0), np.int64)
        related = np.zeros((count, 0, 0), bool)
        return cls(count, flat, np.zeros(0, np.int64), two, two.copy(), flat.copy(), related, none)

    @property
    def people(self) -> int:
        """Number of slots K."""
        return int(self.pos.shape[1])

    @property
    def existence(self) -> Array:
        """The probability (K,) that each person exists."""
        return np.asarray((self.weights * self.exist).sum(axis=0))

    @property
    def heads(self) -> Ints:
        """The least slot of each cluster, ascending."""
        return np.unique(self.cluster)

    def estimates(self) -> tuple[Array, Array, Array]:
        """Return means (K, 4) and covariances (K, 4, 4) of x, y, m, vx, vy, m/s, and the existence (K,).

        They are moments over the particles, each weighted by its weight and the person's existence in it.
        """
        mean, cov, exist = np.zeros((self.people, 4)), np.zeros((self.people, 4, 4)), np.zeros(self.people)
        transition_kernels.moments(self.pos, self.vel, self.exist, self.weights, mean, cov, exist)
        return mean, cov, exist

    def labels(self) -> Ints:
        """Return the group of each person in each particle, (P, K): the least slot in it."""
        label = np.empty(self.exist.shape, np.int64)
        transition_kernels.group_labels(self.related, label)
        return label

    def regroup(self, linked: Bools) -> None:
        """Make clusters anew: the connected components of linked (K, K) slots and of old clusters with unequal weights.

        Clusters that join have the product of their weights. A cluster divides only while its particles have equal
        weights, as after resampling; its parts then have equal weights, too, and no weight counts twice.
        """
        uneven = np.ptp(self.weights, axis=0) > 1e-12 / self.count
        together = linked | ((self.cluster[:, None] == self.cluster) & uneven)
        new = np.empty((1, self.people), np.int64)
        transition_kernels.group_labels(together[None], new)
        joined = new[0]
        for head in np.unique(joined).tolist():
            parts = np.unique(self.cluster[joined == head])
            if len(parts) > 1:
                weights = self.weights[:, parts].prod(axis=1)
                self.weights[:, joined == head] = (weights / weights.sum())[:, None]
        self.cluster = joined

    def weigh(self, log_likelihood: Array) -> None:
        """Multiply the weights by likelihoods.

        log_likelihood (P, K): natural logs, in the column of each cluster's least slot.
        """
        for head in self.heads.tolist():
            logs = log_likelihood[:, head]
            weights = self.weights[:, head] * np.exp(logs - logs.max())
            self.weights[:, self.cluster == head] = (weights / weights.sum())[:, None]

    def effective(self) -> Array:
        """Return the effective number of particles of each slot, (K,)."""
        return np.array([effective_number(self.weights[:, head]) for head in self.cluster.tolist()])

    def resample(self, share: float, scheme: str, width: float, draws: np.random.Generator) -> None:
        """Resample each cluster whose effective number is at most this share of the particles (sec. 2.1).

        scheme: "residual" or "systematic". draws: of one cluster after the other. width: of the kernel from which equal
        particles are drawn apart, in units of the optimal width; 0: none (the paper).
        """
        for head in self.heads.tolist():
            weights, members = self.weights[:, head], np.flatnonzero(self.cluster == head)
            if effective_number(weights) > share * self.count * (1 + 1e-9):
                continue
            if scheme == "residual":
                chosen = residual_resample(weights, draws.random(self.count))
            else:
                chosen = systematic_resample(weights, float(draws.random()))
            for values in (self.pos, self.vel, self.exist, self.related, self.ancestor):
                values[:, members] = values[chosen[:, None], members]
            self.related[:, :, members] = self.related[:, members].transpose(0, 2, 1)
            self.weights[:, members] = 1 / self.count
            if width > 0:
                self._spread(members, width, draws)

    def _spread(self, members: Ints, width: float, draws: np.random.Generator) -> None:
        """Draw the states of slots `members`, of equal weights, from kernels about the particles (regularised particle
        filter, Musso et al. 2001; ours).

        The kernel is normal with h^2 times the covariance of the person's state, of dimension d = 4, and h = width (4 /
        (P (d + 2)))^(1 / (d + 4)). States are drawn towards their mean before, so that the covariance stays (West
        1993).
        """
        h = min(width * (4 / (self.count * 6)) ** (1 / 8), 1.0)
        state = np.concatenate([self.pos[:, members], self.vel[:, members]], axis=2)
        apart = state - state.mean(axis=0)
        values, vectors = np.linalg.eigh(np.einsum("pkd,pke->kde", apart, apart) / self.count)
        root = vectors * np.sqrt(np.maximum(values, 0.0))[:, None]
        noise = np.einsum("kde,pke->pkd", root, draws.standard_normal(state.shape))
        state += (np.sqrt(1 - h * h) - 1) * apart + h * noise
        self.pos[:, members], self.vel[:, members] = state[..., :2], state[..., 2:]

    def keep(self, slots: Bools) -> None:
        """Remove all slots but those where `slots` (K,) is True."""
        kept = self.cluster[slots]
        self.cluster = np.array([int(np.flatnonzero(kept == head)[0]) for head in kept.tolist()], np.int64)
        self.weights, self.exist = self.weights[:, slots], self.exist[:, slots]
        self.pos, self.vel = self.pos[:, slots], self.vel[:, slots]
        self.related = self.related[:, slots][:, :, slots]
        self.ancestor = self.ancestor[:, slots]

    def add(self, pos: Array, vel: Array, exist: float, related: Bools) -> None:
        """Add a slot with places pos (P, 2) and velocities vel (P, 2), the same existence in each particle, and
        relations (P, K) to the slots so far; it is a cluster of its own with equal weights."""
        count, k = self.count, self.people
        self.weights = np.concatenate([self.weights, np.full((count, 1), 1 / count)], axis=1)
        self.cluster = np.append(self.cluster, k)
        self.pos = np.concatenate([self.pos, pos[:, None]], axis=1)
        self.vel = np.concatenate([self.vel, vel[:, None]], axis=1)
        self.exist = np.concatenate([self.exist, np.full((count, 1), exist)], axis=1)
        grown = np.zeros((count, k + 1, k + 1), bool)
        grown[:, :k, :k] = self.related
        grown[:, k, :k] = grown[:, :k, k] = related
        self.related = grown
        self.ancestor = np.concatenate([self.ancestor, np.arange(count)[:, None]], axis=1)
