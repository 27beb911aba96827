"""Kernels of an online Dirichlet process mixture as dynamics of partitions, pi(Z' | X', Z) (ours, after Bazzani 2015).

Each person's label is drawn anew from its conditional given the labels of all others: one step of a collapsed Gibbs
sampler (Neal 2000, algorithm 3), whose stationary distribution is p(Z | X) of cluster_evidence_kernels.
"""

from __future__ import annotations

import math

import numpy as np

from sim.compiler import njit
from sim.types import Array, Ints
from tracking.papers.joint.cluster_evidence_kernels import LOG_NEW, SUMS, add_person, log_predictive
from tracking.papers.joint.partition_kernels import clusters

REDRAWN, CHOICE = range(2)
"""Slots of a person's uniforms: whether the label is drawn anew; which component."""


@njit(cache=True)
def draw_component(sums: Array, size: Ints, person: Array, uniform: float, mixture: Array, log_p: Array) -> int:
    """Return the component of a person drawn given all others: a row of sums (K, 7), or an empty row for a new one.

    size (K,): people of each row, without the person; one row at least is empty. person (4,): state; log_p (K,): work
    space.
    """
    n, empty = len(size), -1
    top = mixture[LOG_NEW]
    for g in range(n):
        if size[g] == 0:
            empty = g
        else:
            log_p[g] = math.log(size[g]) + log_predictive(sums[g], person, mixture)
            top = max(top, log_p[g])
    total = math.exp(mixture[LOG_NEW] - top)
    for g in range(n):
        if size[g] > 0:
            log_p[g] = math.exp(log_p[g] - top)
            total += log_p[g]
    reached, chosen = 0.0, empty
    for g in range(n):
        if size[g] > 0:
            reached += log_p[g]
            if uniform * total < reached:
                chosen = g
                break
    return chosen


@njit(cache=True)
def propose(state: Array, label: Ints, chance: Array, uniforms: Array, mixture: Array) -> None:
    """Draw Z_{t+1} for all particles, person by person.

    state (N_x, K, 4): X_{t+1}; label (N_x, N_z, K): Z_t, changed in place; chance (K,): probability that a person's
    label is drawn anew; uniforms (N_x, N_z, K, 2): of each person, as REDRAWN, CHOICE; mixture: as
    cluster_evidence_kernels.LOG_NEW and the following.
    """
    particles, partitions, n = label.shape
    cluster, head, size = np.empty(n, np.int64), np.empty(n, np.int64), np.empty(n, np.int64)
    sums, log_p = np.empty((n, SUMS)), np.empty(n)
    for i in range(particles):
        for j in range(partitions):
            clusters(label[i, j], cluster, head)
            sums[:], size[:] = 0.0, 0
            for k in range(n):
                size[cluster[k]] += 1
                add_person(sums[cluster[k]], state[i, k], 1.0)
            for k in range(n):
                if uniforms[i, j, k, REDRAWN] >= chance[k]:
                    continue
                g = cluster[k]
                size[g] -= 1
                if size[g] == 0:
                    sums[g] = 0.0
                else:
                    add_person(sums[g], state[i, k], -1.0)
                g = draw_component(sums, size, state[i, k], uniforms[i, j, k, CHOICE], mixture, log_p)
                cluster[k] = g
                size[g] += 1
                add_person(sums[g], state[i, k], 1.0)
            head[:] = -1
            for k in range(n):
                g = cluster[k]
                if head[g] < 0:
                    head[g] = k
                label[i, j, k] = 0 if size[g] == 1 else 1 + head[g]
