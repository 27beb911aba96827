"""The output of `relational` and `particle`: means over particles as tracks."""

from __future__ import annotations

import numpy as np

from sim.types import Array
from tracking.papers.relational import transition_kernels
from tracking.papers.relational.particle_set import ParticleSet


def estimates(particles: ParticleSet) -> tuple[Array, Array, Array, Array]:
    """Return places (K, 2) m, velocities (K, 2) m/s, covariances (K, 4, 4) of x, y, vx, vy and existence (K,).

    They are moments over the particles, each weighted by its weight and the person's existence in it.
    """
    count = particles.people
    mean, cov, exist = np.zeros((count, 4)), np.zeros((count, 4, 4)), np.zeros(count)
    transition_kernels.moments(particles.pos, particles.vel, particles.exist, particles.weights, mean, cov, exist)
    return mean[:, :2], mean[:, 2:], cov, exist
