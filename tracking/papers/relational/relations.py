"""The tracker `relational`: the filter of `particle` with the relation "walking together" in its particles."""

from __future__ import annotations

import math
from typing import ClassVar

import numpy as np

from sim.types import Array, Bools, Context, Frame, Ints, Tracks
from tracking.grouping.belief import UNSEEN
from tracking.grouping.pair_belief import PairBelief
from tracking.papers.relational import particle_set_kernels, transition_kernels
from tracking.papers.relational.config import NEWCOMER_SHARE, ParticleConfig, RelationalConfig
from tracking.papers.relational.tracker import COUPLING, JOINING, RELATIONS, Particle
from tracking.papers.relational.transition_kernels import DISTANCE, VELOCITY

# Rules of transition_kernels by which every partner counts fully, as in the paper.
ALWAYS = np.array([0.0, np.inf, 0.0, 0.0])


class Relational(Particle):
    """The tracker `relational`: the particle filter of `particle` with the relation "walking together" in it.

    together (K, K): probability that each pair walks together, in the last frame, by slots; 1 on the diagonal. belief:
    that of tracking.grouping about the slots' tracks so far, kept only if relations come from it. The rest of the state
    is that of Particle.
    """

    config_class: ClassVar[type[ParticleConfig]] = RelationalConfig
    config: RelationalConfig

    def reset(self, context: Context, seed: int) -> None:
        """Forget everything and start a sequence, as `Particle.reset`."""
        super().reset(context, seed)
        self.together = np.zeros((0, 0))
        self.belief = PairBelief(context.fps) if self.config.relation_evidence == "belief" else None

    @property
    def _rules(self) -> Array:
        c = self.config
        new = -np.expm1(-c.relation_rate * self.dt)
        return np.array([new, c.relation_bias, c.relation_distance, c.relation_velocity])

    def _coupling(self) -> tuple[Array, Array, Array, Array]:
        p, time = self.particles, self.config.coupling_time
        follow = 1.0 if time == 0 else -math.expm1(-self.dt / time)
        coupling = np.array([follow, self.config.common_noise])
        shared = self.streams.normals(COUPLING, self.slots.key, p.count, 2)
        p.drop_strangers()
        if self.belief is None:
            return shared, coupling, ALWAYS, np.zeros(p.pairs.shape)
        return shared, coupling, self._rules, transition_kernels.pair_spread(p.pos, p.vel, p.pairs)

    def _relate(self) -> None:
        p, rules = self.particles, self._rules
        if p.people < 2:
            return
        if self.belief is None:
            p.hold(transition_kernels.near_pairs(p.pos, rules))
            odds = np.full(len(p.pairs), self.config.relation_bias)
        else:
            log_odds, seen = _log_odds(self.belief), self.belief.seen()
            p.hold(np.argwhere(np.triu(np.isfinite(log_odds), 1)))
            odds = np.where(seen[p.pairs].all(axis=1), log_odds[p.pairs[:, 0], p.pairs[:, 1]], np.nan)
            rules = np.where(np.isin(range(4), (DISTANCE, VELOCITY)), 0.0, rules)
        uniforms = self.streams.uniforms(RELATIONS, self.slots.key, p.count, 2)
        transition_kernels.relate(p.pos, p.vel, p.pairs, p.related, odds, uniforms, rules)

    def _follow(self, state: Array) -> None:
        if self.belief is not None:
            if len(state) > len(self.belief.count):
                self.belief.add(state)
            self.belief.see(state[:, :2])

    def _keep(self, rows: Bools) -> None:
        super()._keep(rows)
        if self.belief is not None:
            self.belief.keep(rows)

    def _relate_newcomers(self, points: Array) -> None:
        p, new = self.particles, len(points)
        label = np.empty(p.exist.shape, np.int64)
        particle_set_kernels.group_labels(p.pairs, p.related, label)
        uniforms = self.streams.uniforms(JOINING, self.slots.key[-new:], 1, p.count)[0]
        pairs, related = transition_kernels.join(p.pos, p.exist, label, points, NEWCOMER_SHARE, uniforms, self._rules)
        p.pairs, p.related = np.concatenate([p.pairs, pairs]), np.concatenate([p.related, related])

    def _report(self, frame: Frame) -> Tracks:
        tracks, p = super()._report(frame), self.particles
        if self.belief is None:
            self.together = particle_set_kernels.pairs_together(p.pairs, p.related, p.exist, p.weights, p.one_weight)
        else:
            self.together = 1 / (1 + np.exp(-_log_odds(self.belief)))
            np.fill_diagonal(self.together, 1.0)
        return tracks

    def walking_together(self) -> tuple[Ints, Array]:
        """Returns ids (R,) of the people reported last, and the probability (R, R) that two of them walk together.

        By their state it is the share of the weight of the particles in which the pair is related, given that both
        exist. The belief is the same in all particles, so that it is the probability itself; a share of particles would
        be the belief with errors of sampling, and weights would count the detections twice. 1 on the diagonal.
        """
        rows = np.zeros(0, np.int64) if self.shown is None else np.flatnonzero(np.isin(self.slots.id, self.shown.id))
        return self.slots.id[rows], self.together[np.ix_(rows, rows)]


def _log_odds(belief: PairBelief) -> Array:
    return np.where(belief.log_odds == UNSEEN, -np.inf, belief.log_odds)
