"""Algorithm 1: the decentralised particle filter of a state (X, Z), for any four distributions.

N_x particles of X, and under each of them N_z particles of Z: p(Z, X | y) = p(Z | X, y) p(X | y) (eq. 2). A frame
runs steps 4 to 7 and then 1 to 3, as the proposal of X uses the new frame. p_{N_z} are sums over the nested particles:

    p_{N_z}(y | X)  = 1/N_z sum_j p(y | X, Z_j)
    p_{N_z}(X' | X) = sum_j qbar_j p(X' | X, Z_j),   which is the normaliser of step 5

X consists of K components (people). What a component alone adds to the weight of step 1 is kept apart, so that
components can be resampled one by one (ours).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from sim.types import Array, Bools, Ints
from tracking.filters.resampling import systematic_resample_rows
from tracking.papers.joint.partition_labels_kernels import relabel


class Distributions(Protocol):
    """The four distributions of Table 1. p_0 is any reference dynamics of the components."""

    def individuals(self, x: Array, z: Ints) -> tuple[Array, Array]:
        """Step 4: returns X' (N_x, K, D) drawn from pi(X' | X, y), and the log (N_x, K) of p(y | x'_k) p_0(x'_k | x_k)
        / pi(x'_k | x_k, y); z (N_x, ...): the likeliest Z under each X."""

    def dynamics(self, new: Array, x: Array, z: Ints) -> Array:
        """Returns the log (N_x, N_z) of p(X' | X, Z) / p_0(X' | X)."""

    def groups(self, new: Array, x: Array, z: Ints) -> Ints:
        """Step 7: returns Z' (N_x, N_z, ...) drawn from pi(Z' | X', X, Z, y)."""

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

    def kept(self, rows: Bools) -> Nested:
        """Returns the particles without the components where `rows` (K,) is False; parts of Z are numbered anew."""
        z = np.ascontiguousarray(self.z[..., rows])
        relabel(z)
        x = np.ascontiguousarray(self.x[:, rows])
        return Nested(x, z, self.log_q, self.log_w[:, rows], self.log_rest)

    def joined(self, x: Array) -> Nested:
        """Returns the particles with new components x (N_x, M, D), of label 0 in Z."""
        z = np.concatenate([self.z, np.zeros((*self.z.shape[:2], x.shape[1]), np.int64)], axis=2)
        log_w = np.concatenate([self.log_w, np.zeros(x.shape[:2])], axis=1)
        return Nested(np.concatenate([self.x, x], axis=1), z, self.log_q, log_w, self.log_rest)

    def weights(self, one_by_one: bool = False) -> Array:
        """Returns the weights w of step 1, (N_x,), sum 1; one_by_one: only of what X as a whole adds."""
        return normalised(self.log_rest if one_by_one else self.log_w.sum(axis=1) + self.log_rest)

    def component_weights(self, one_by_one: bool = False) -> Array:
        """Returns the weights of each component, (N_x, K), sum 1 for each: w, or one_by_one those of it alone."""
        if one_by_one:
            return normalised(self.log_w.T).T
        return np.repeat(self.weights()[:, None], self.log_w.shape[1], axis=1)

    def resampled(self, uniforms: Array, one_by_one: bool = False) -> Nested:
        """Returns the particles after step 2, of weight 1; uniforms (K + 1,).

        one_by_one: in two stages (ours), each component by its own weights, then X as a whole by the rest.
        """
        components = np.arange(self.log_w.shape[1])
        chosen = systematic_resample_rows(self.weights(one_by_one)[None], uniforms[-1:])[0]
        own = np.repeat(chosen[:, None], len(components), axis=1)
        if one_by_one:
            own = systematic_resample_rows(self.component_weights(True).T, uniforms[:-1]).T[chosen]
        zero = np.zeros_like(self.log_w), np.zeros_like(self.log_rest)
        return Nested(self.x[own, components], self.z[chosen], self.log_q[chosen], *zero)


def advance(old: Nested, model: Distributions, uniforms: Array) -> Nested:
    """Returns the particles of the next frame: steps 4 to 7, then 1 and 3. `old` is as after step 2."""
    likeliest = old.z[np.arange(len(old.z)), old.log_q.argmax(axis=1)]
    new, log_w = model.individuals(old.x, likeliest)  # step 4
    log_q = old.log_q + model.dynamics(new, old.x, old.z)  # step 5
    log_dynamics = log_sum(log_q)  # p_{N_z}(X' | X) / p_0(X' | X)
    chosen = systematic_resample_rows(np.exp(log_q - log_dynamics[:, None]), uniforms)  # step 6
    z = model.groups(new, old.x, old.z[np.arange(len(chosen))[:, None], chosen])  # step 7
    log_y = model.energy(new, z)
    log_group = log_sum(log_y)
    log_rest = log_dynamics + log_group - np.log(log_y.shape[1])  # step 1
    return Nested(new, z, log_y - log_group[:, None], log_w, log_rest)  # step 3


def log_sum(values: Array) -> Array:
    """Returns log(sum(exp(values))) over the last axis; -inf where all are."""
    top = values.max(axis=-1, keepdims=True)
    top = np.where(np.isfinite(top), top, 0.0)
    with np.errstate(divide="ignore"):
        return np.asarray(np.log(np.exp(values - top).sum(axis=-1)) + top[..., 0])


def normalised(log_weights: Array) -> Array:
    """Returns the weights exp(log_weights), normalised to sum 1 over the last axis."""
    weights = np.exp(log_weights - log_weights.max(axis=-1, keepdims=True))
    return np.asarray(weights / weights.sum(axis=-1, keepdims=True))
