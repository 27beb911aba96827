"""How many particles the weights of `relational` are worth: effective numbers and distinct ancestors (ours)."""

from __future__ import annotations

import numpy as np

from tracking.papers.relational.particle_set import ParticleSet

SPAN = 1.0
"""Time over which ancestors are counted, s."""


class ParticleDiversity:
    """Sums over the frames of a sequence in which there are people.

    effective: sum of the effective shares of the particles of the least effective person, over `frames`. distinct: sum
    of the shares of particles that still have descendants after SPAN s, means over people, over `spans`. span: SPAN in
    frames; age: frames since the last span began.
    """

    def __init__(self, fps: float) -> None:
        self.span = max(1, round(SPAN * fps))
        self.effective = self.distinct = 0.0
        self.frames = self.spans = self.age = 0

    def weigh(self, particles: ParticleSet) -> None:
        """Add a frame in which the particles were weighed, before they are resampled."""
        if particles.people:
            self.effective += float(particles.effective().min()) / particles.count
            self.frames += 1

    def resample(self, particles: ParticleSet) -> None:
        """Note that a frame is over; at the end of a span the ancestors of the particles are counted and begin anew."""
        self.age += 1
        if self.age < self.span:
            return
        if particles.people:
            self.distinct += float(np.mean([len(np.unique(k)) for k in particles.ancestor.T])) / particles.count
            self.spans += 1
        particles.ancestor[:] = np.arange(particles.count)[:, None]
        self.age = 0

    def summary(self) -> dict[str, float | None]:
        """Return means: shares of effective particles of the least effective person, and of particles with descendants
        after SPAN s; None without people."""
        return {
            "effective_particles_of_a_person": self.effective / self.frames if self.frames else None,
            "distinct_ancestors": self.distinct / self.spans if self.spans else None,
        }
