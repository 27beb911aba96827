"""How many particles the weights of `joint` are worth: effective numbers and distinct ancestors."""

from __future__ import annotations

import numpy as np

from sim.types import Bools, Ints
from tracking.papers.joint.decentralised_filter import Nested, effective_share

SPAN = 1.0  # Time over which ancestors are counted, s.


class ParticleHealth:
    """Sums over the frames of a sequence.

    effective: sum of the effective shares of the weights of whole particles; frames: their number. person: the same of
    the least effective person's own weights. distinct, spans: sum and number of the shares of distinct ancestors after
    SPAN s, means over people. ancestor (N_x, K): of each person in each particle since the span began.
    """

    def __init__(self, particles: int, fps: float) -> None:
        self.span = max(1, round(SPAN * fps))
        self.effective = self.person = self.distinct = 0.0
        self.frames = self.spans = self.age = 0
        self.ancestor: Ints = np.zeros((particles, 0), np.int64)

    def weigh(self, nested: Nested, joint: bool) -> None:
        """Add a frame; joint: each particle has one weight."""
        self.frames += 1
        self.effective += effective_share(nested.weights() if joint else nested.rest_weights())
        own = nested.component_weights()
        self.person += min(effective_share(own[:, k]) for k in range(own.shape[1]))

    def resample(self, own: Ints) -> None:
        """Note the indices (N_x, K) with which people are resampled."""
        self.ancestor = self.ancestor[own, np.arange(own.shape[1])]
        self.age += 1
        if self.age == self.span:
            count = len(self.ancestor)
            self.distinct += float(np.mean([len(np.unique(column)) / count for column in self.ancestor.T]))
            self.spans += 1
            self._restart(own.shape[1])

    def add(self, people: int) -> None:
        """Add people to the particles."""
        rows = np.repeat(np.arange(len(self.ancestor))[:, None], people, axis=1)
        self.ancestor = np.concatenate([self.ancestor, rows], axis=1)

    def keep(self, rows: Bools) -> None:
        """Remove all people but those where `rows` (K,) is True."""
        self.ancestor = self.ancestor[:, rows]

    def summary(self) -> dict[str, float | None]:
        """Returns means over frames: shares of effective particles and of distinct ancestors; None without frames."""
        frames = self.frames
        return {
            "effective_particles": self.effective / frames if frames else None,
            "effective_particles_of_a_person": self.person / frames if frames else None,
            "distinct_ancestors": self.distinct / self.spans if self.spans else None,
        }

    def _restart(self, people: int) -> None:
        self.age = 0
        self.ancestor = np.repeat(np.arange(len(self.ancestor))[:, None], people, axis=1)
