"""The output of `relational` and `particle`: means over particles as tracks, and groups of who walks together."""

from __future__ import annotations

import numpy as np

from sim.truth.identity import Identities
from sim.types import Array, Groups, Ints
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


def group_ids(identities: Identities, frame: int, ids: Ints, groups: list[Ints]) -> Ints:
    """Return the id of each person's group, (N,), -1 for a person alone; `identities` goes on to this frame.

    frame: number, ascending from call to call. ids (N,): of the reported people; groups: rows of the members of each
    group. The ids follow the identity rule of the truth (sim.truth.identity).
    """
    parts = [frozenset(ids[rows].tolist()) for rows in groups]
    identities.step(frame, frozenset(ids.tolist()), parts)
    return known_groups(identities, ids)


def known_groups(identities: Identities, ids: Ints) -> Ints:
    """Return the id of each person's group, (N,), as `identities` has it, -1 for a person alone; ids (N,)."""
    group_of = {person: group for group, people in identities.groups.items() for person in people}
    return np.array([group_of.get(person, -1) for person in ids.tolist()], np.int64)


def no_groups(group: Ints) -> Groups | None:
    """Return empty Groups if nobody is in a group, which says so; else None: hulls are derived from the group ids."""
    return Groups.none() if (group < 0).all() else None


def boxes(pos: Array, size: Array) -> Array | None:
    """Return boxes (N, 4) left, top, width, height in px with the centres pos (N, 2) px; None if a size is unknown.

    size (N, 2): width, height, px, nan if unknown.
    """
    return np.concatenate([pos - size / 2, size], axis=1) if np.isfinite(size).all() else None
