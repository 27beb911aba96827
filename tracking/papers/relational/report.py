"""The output of `relational` and `particle`: means over particles as tracks, and groups of who walks together."""

from __future__ import annotations

import numpy as np

from sim.truth.identity import Identities
from sim.types import Array, Groups, Ints
from tracking.papers.relational.particle_set import ParticleSet


def estimates(particles: ParticleSet) -> tuple[Array, Array, Array, Array]:
    """Return places (K, 2) m, velocities (K, 2) m/s, covariances (K, 4, 4) of x, y, vx, vy and existence (K,).

    They are moments over the particles, each weighted by its weight and the person's existence in it. A person who
    exists in no particle has the moments of the weights alone.
    """
    weights = particles.weights
    shares = weights[:, None] * particles.exist
    exist = shares.sum(axis=0)
    shares = np.where(exist > 0, shares, weights[:, None])
    shares /= shares.sum(axis=0)
    state = np.concatenate([particles.pos, particles.vel], axis=2)
    mean = np.einsum("pk,pki->ki", shares, state)
    apart = state - mean
    cov = np.einsum("pki,pkj->kij", apart * shares[:, :, None], apart)
    return mean[:, :2], mean[:, 2:], (cov + cov.transpose(0, 2, 1)) / 2, exist


def linked_groups(together: Array, least: float) -> list[Ints]:
    """Return the groups of two or more people as arrays of rows, by connected components of pairs.

    together (N, N): probability that each pair walks together; least: pairs below it are not linked.
    """
    linked = together >= least
    left, found = set(range(len(together))), []
    while left:
        part, waiting = set[int](), [min(left)]
        while waiting:
            row = waiting.pop()
            if row in left:
                left.remove(row)
                part.add(row)
                waiting += np.flatnonzero(linked[row]).tolist()
        found += [np.array(sorted(part))] if len(part) > 1 else []
    return found


def group_ids(identities: Identities, frame: int, ids: Ints, groups: list[Ints]) -> Ints:
    """Return the id of each person's group, (N,), -1 for a person alone; `identities` goes on to this frame.

    frame: number, ascending from call to call. ids (N,): of the reported people; groups: rows of the members of each
    group. The ids follow the identity rule of the truth (sim.truth.identity).
    """
    parts = [frozenset(ids[rows].tolist()) for rows in groups]
    identities.step(frame, frozenset(ids.tolist()), parts)
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
