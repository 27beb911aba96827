"""Algorithm 1: the decentralised particle filter of a state (X, Z), for any four distributions.

N_x particles of X, and under each of them N_z particles of Z: p(Z, X | y) = p(Z | X, y) p(X | y) (eq. 2). A frame
runs steps 4 to 7 and then 1 to 3, as the proposal of X uses the new frame. p_{N_z} are sums over the nested particles:

    p_{N_z}(y | X)  = 1/N_z sum_j p(y | X, Z_j)
    p_{N_z}(X' | X) = sum_j qbar_j p(X' | X, Z_j),   which is the normaliser of step 5

X consists of K components (people). What a component alone adds to the weight of step 1 is kept apart, so that
components can be resampled one by one (ours).

How many particles the weights of `joint` are worth: effective numbers and distinct ancestors.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from sim.types import Array, Bools, Ints
from tracking.filters.particles import effective_number, systematic_resample_rows


class Distributions(Protocol):
    """The four distributions of Table 1. p_0 is any reference dynamics of the components."""

    def individuals(self, x: Array) -> tuple[Array, Array]:
        """Step 4: return X' (N_x, K, D) drawn from pi(X' | X, y), and the log (N_x, K) of p(y | x'_k) p_0(x'_k | x_k) /
        pi(x'_k | x_k, y)."""

    def dynamics(self, new: Array, x: Array, z: Ints) -> Array:
        """Returns the log (N_x, N_z) of p(X' | X, Z) / p_0(X' | X)."""

    def groups(self, new: Array, x: Array, z: Ints) -> Ints:
        """Step 7: return Z' (N_x, N_z, ...) drawn from pi(Z' | X', X, Z, y)."""

    def energy(self, new: Array, z: Ints) -> Array:
        """Returns the log (N_x, N_z) of p(Z' | X'), the part of p(y | X', Z') of eq. 4 that depends on Z'."""


@dataclass
class Nested:
    """The particles after steps 1 and 3 of a frame, before step 2.

    x (N_x, K, D): X. z (N_x, N_z, ...): Z. log_q (N_x, N_z): log of qbar (step 3), normalised over j. log_w (N_x, K):
    what the components add to log w (step 1). log_rest (N_x,): what X as a whole adds.
    """

    x: Array
    z: Ints
    log_q: Array
    log_w: Array
    log_rest: Array

    @classmethod
    def empty(cls, shape: tuple[int, int], size: int) -> Nested:
        """Returns particles of no component; shape: N_x, N_z; size: D."""
        log_q = np.full(shape, -np.log(shape[1]))
        x, z, log_w = np.zeros((shape[0], 0, size)), np.zeros((*shape, 0), np.int64), np.zeros((shape[0], 0))
        return cls(x, z, log_q, log_w, np.zeros(shape[0]))

    def weights(self) -> Array:
        """Returns the weights w of step 1, (N_x,), sum 1."""
        return normalised(self.log_w.sum(axis=1) + self.log_rest)

    def rest_weights(self) -> Array:
        """Returns the weights of what X as a whole adds, (N_x,), sum 1."""
        return normalised(self.log_rest)

    def component_weights(self) -> Array:
        """Returns the weights of each component alone, (N_x, K), sum 1 for each component."""
        return normalised(self.log_w.T).T


def advance(old: Nested, model: Distributions, uniforms: Array) -> Nested:
    """Returns the particles of the next frame: steps 4 to 7, then 1 and 3. `old` is as after step 2."""
    new, log_w = model.individuals(old.x)  # step 4
    log_q = old.log_q + model.dynamics(new, old.x, old.z)  # step 5
    log_dynamics = log_sum(log_q)  # p_{N_z}(X' | X) / p_0(X' | X)
    chosen = systematic_resample_rows(np.exp(log_q - log_dynamics[:, None]), uniforms)  # step 6
    z = model.groups(new, old.x, old.z[np.arange(len(chosen))[:, None], chosen])  # step 7
    log_y = model.energy(new, z)
    log_group = log_sum(log_y)
    log_rest = log_dynamics + log_group - np.log(log_y.shape[1])  # step 1
    return Nested(new, z, log_y - log_group[:, None], log_w, log_rest)  # step 3


def joint_indices(nested: Nested, uniform: float) -> Ints:
    """Returns the indices (N_x,) of step 2 by the weights of step 1."""
    return np.asarray(systematic_resample_rows(nested.weights()[None], np.array([uniform]))[0])


def component_indices(nested: Nested, uniforms: Array) -> tuple[Ints, Ints]:
    """Returns the indices of step 2 in two stages (ours): (N_x, K) of each component alone, then (N_x,) of the rest."""
    single = systematic_resample_rows(nested.component_weights().T, uniforms[:-1]).T
    rest = systematic_resample_rows(nested.rest_weights()[None], uniforms[-1:])[0]
    return single, rest


def effective_share(weights: Array) -> float:
    """Returns the effective number of particles as a share of them; weights (N,), sum 1."""
    return effective_number(weights) / len(weights)


def log_sum(values: Array) -> Array:
    """Returns log(sum(exp(values))) over the last axis; -inf where all are."""
    top = values.max(axis=-1, keepdims=True)
    top = np.where(np.isfinite(top), top, 0.0)
    with np.errstate(divide="ignore"):
        return np.asarray(np.log(np.exp(values - top).sum(axis=-1)) + top[..., 0])


def normalised(log_weights: Array) -> Array:
    """Returns weights that sum to 1 over the last axis."""
    weights = np.exp(log_weights - log_weights.max(axis=-1, keepdims=True))
    return np.asarray(weights / weights.sum(axis=-1, keepdims=True))


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
