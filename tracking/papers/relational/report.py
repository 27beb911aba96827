"""The output of `relational` and `particle`: means over particles as tracks, and groups of who walks together."""

from __future__ import annotations

import numpy as np

from sim.types import Array, Ints
from tracking.grouping.belief_partition import partition
from tracking.papers.relational import transition_kernels
from tracking.papers.relational.particle_set import ParticleSet

SURE = 0.01
"""Probabilities of pairs are taken at least so far from 0 and 1, as particles are few (ours)."""


def estimates(particles: ParticleSet) -> tuple[Array, Array, Array, Array]:
    """Return places (K, 2) m, velocities (K, 2) m/s, covariances (K, 4, 4) of x, y, vx, vy and existence (K,).

    They are moments over the particles, each weighted by its weight and the person's existence in it.
    """
    count = particles.people
    mean, cov, exist = np.zeros((count, 4)), np.zeros((count, 4, 4)), np.zeros(count)
    transition_kernels.moments(particles.pos, particles.vel, particles.exist, particles.weights, mean, cov, exist)
    return mean[:, :2], mean[:, 2:], cov, exist


def groups_of_pairs(together: Array, group: Ints, least: float, inertia: float) -> list[Ints]:
    """Return the groups of two or more people as arrays of rows: the consistent partition of tracking.grouping.

    together (N, N): probability that each pair walks together; group (N,): of each person in the last frame, -1 for
    alone. Groups are joined while the mean over their pairs of the log odds of `together`, less those of `least`, is
    above 0; `inertia` is added for pairs of one group and subtracted for all others.
    """
    a, b = np.triu_indices(len(together), 1)
    odds = np.clip(together[a, b], SURE, 1 - SURE)
    log_odds = np.log(odds / (1 - odds)) - np.log(least / (1 - least))
    log_odds += np.where((group[a] >= 0) & (group[a] == group[b]), inertia, -inertia)
    _, person, group = partition(np.zeros_like(a), a, b, log_odds, -1.0)
    return [person[group == g] for g in np.unique(group)]
