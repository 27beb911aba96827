"""The four distributions of Table 1 for a frame: individuals, dynamics, group proposal, observation (sec. 4).

A state is x, y in m and vx, vy in m/s.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cache

import numpy as np

from sim.types import Array, Ints
from tracking.filters.person_streams import NOBODY, Keys, PersonStreams
from tracking.papers.joint import group_proposal_kernels, partition_labels_kernels
from tracking.papers.joint.config import ALPHA, SCALES, VALIDITY_RATE, JointConfig
from tracking.papers.joint.group_proposal_kernels import group_dynamics
from tracking.papers.joint.individuals import Proposal, log_density, moved, precision_of, process_noise

STATE = 4  # Columns of a state: x, y, m, and vx, vy, m/s.
MOTION, CHOICES, PARTITIONS, EVENTS, RESAMPLING, BIRTHS, PLACING = range(7)  # What random numbers are drawn for.


@dataclass(frozen=True)
class FrameModel:
    """The distributions of a frame; Distributions of decentralised_filter.

    X is (N_x, K, 4). Z is (N_x, N_z, K), labels as partition_labels_kernels has them.

    config; dt: s; noise: standard deviation of a measured place, m; z (K, 2): measured places, m, nan for a person who
    was not measured; belief (K, K): log-odds that each pair belongs together; streams: the random numbers; key
    (K,): of each person's streams.
    """

    config: JointConfig
    dt: float
    noise: float
    z: Array
    belief: Array
    streams: PersonStreams
    key: Keys

    @property
    def sigma(self) -> Array:
        """Sigma of one axis, (3,)."""
        return process_noise(self.config.place_noise, self.config.velocity_noise, self.dt)

    def individuals(self, x: Array, z: Ints) -> tuple[Array, Array]:
        """Step 4: returns states drawn from pi(X_{t+1} | X_{0:t}, y) and logs, as `Distributions.individuals`."""
        c, shape = self.config, x.shape[:2]
        normals = self.streams.normals(MOTION, self.key, shape[0], STATE)
        uniforms = self.streams.uniforms(CHOICES, self.key, shape[0], 1)[..., 0]
        proposal = Proposal(self.sigma, self.noise, self.dt, ALPHA, c.own_weights)
        if c.individuals == "measured":
            place = np.where(np.isfinite(self.z), self.z, moved(x, self.dt)[..., :2])
            return np.concatenate([place, (place - x[..., :2]) / self.dt], axis=-1), np.zeros(shape)
        if c.variant == "missed":
            x = self._moved_by_groups(x, z)
        return proposal.draw(x, self.z, normals, uniforms)

    def _moved_by_groups(self, x: Array, z: Ints) -> Array:
        """Returns x with B (g - x) added for missed people, so that eq. 3 makes of it what eq. 5 makes of x."""
        out = x.copy()
        for k in np.flatnonzero(np.isnan(self.z[:, 0])):
            mates = (z == z[:, k : k + 1]) & (z > 0)
            difference = np.einsum("ik,ikd->id", mates, x[..., 2:] - x[:, k : k + 1, 2:])
            out[:, k, :2] += self.dt * difference / np.maximum(mates.sum(axis=1), 1)[:, None]
        return out

    def dynamics(self, new: Array, x: Array, z: Ints) -> Array:
        """Returns log p(X_{t+1} | X_t, Z_t) / p_0, (N_x, N_z), with eq. 3 as p_0: eq. 5 in variant "full", else 0."""
        out = np.zeros(z.shape[:2])
        if self.config.variant != "full":
            return out
        group_dynamics(new, x, z, *precision_of(self.sigma), self.dt, out)
        return np.asarray(out - log_density(new, moved(x, self.dt), self.sigma).sum(axis=1)[:, None])

    def groups(self, new: Array, x: Array, z: Ints) -> Ints:
        """Step 7: returns Z' drawn from pi(Z_{t+1} | X_{0:t+1}, Z_t, y), eqs 6 and 7; in VAR2 and VAR3 from all
        partitions uniformly."""
        c, shape = self.config, z.shape
        out = z.copy()
        if c.variant in ("VAR2", "VAR3"):
            partition_labels_kernels.uniform_partitions(
                stam_cumulated(shape[2]), self._of_partitions(shape, np.append(self.key, NOBODY), 1)[..., 0], out
            )  # fmt: skip
            return out
        uniforms = self._of_partitions(shape, self.key, 3)
        group_proposal_kernels.propose(x, new, out, uniforms, c.classifier, c.rules(self.dt), SCALES)
        return out

    def _of_partitions(self, shape: tuple[int, ...], key: Keys, columns: int) -> Array:
        drawn = self.streams.uniforms(EVENTS, key, shape[0] * shape[1], columns)
        return drawn.reshape(shape[0], shape[1], len(key), columns)

    def energy(self, new: Array, z: Ints) -> Array:
        """Returns log p(Z_t | X_t) of eq. 4, (N_x, N_z), times dt: the sum of the beliefs of pairs in one group (ours),
        or if belief_rate is 0 -lambda_cl d_cl(Z_t, X_t); 0 in VAR3."""
        c = self.config
        out = np.zeros(z.shape[:2])
        if c.variant == "VAR3":
            return out
        if c.belief_rate > 0:
            partition_labels_kernels.pair_sums(self.belief, z, out)
            return np.asarray(c.belief_rate * self.dt * out)
        partition_labels_kernels.validities(new, z, SCALES, out)
        return np.asarray(-VALIDITY_RATE * self.dt * out)


@cache
def stam_cumulated(people: int) -> Array:
    """Returns the cumulated probabilities of m = 1, 2, ... boxes in Stam's sampler of partitions: m^K / m!, sum 1."""
    m = np.arange(1, 4 * people + 40)
    log_p = people * np.log(m) - np.array([math.lgamma(k + 1) for k in m.tolist()])
    p = np.exp(log_p - log_p.max())
    return np.asarray(np.cumsum(p) / p.sum())
