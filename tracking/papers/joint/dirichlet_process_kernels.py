"""Kernels of an online Dirichlet process mixture as dynamics of partitions, pi(Z' | X', Z) (ours, after Bazzani 2015).

Each person's label is drawn anew from its conditional given the labels of all others: one step of a collapsed Gibbs
sampler (Neal 2000, algorithm 3), whose stationary distribution is p(Z | X) of cluster_evidence_kernels. A component
also remembers its past: sums (7,) of the states of its people, moved on with their mean velocity and forgotten. Every
member carries the memory of the component, so that components need no names.
"""

from __future__ import annotations

import math

import numpy as np

from sim.compiler import njit
from sim.types import Array, Ints
from tracking.papers.joint.cluster_evidence_kernels import (
    LOG_NEW,
    PLACE_SQUARES,
    SUMS,
    VX,
    WEIGHT,
    X,
    add_person,
    log_predictive,
)
from tracking.papers.joint.partition_kernels import clusters

TIME, KEPT, GAIN = range(3)
"""Slots of `ageing` (3,): time step, s; share of the memory that is kept; what a person adds to it in this step."""
REDRAWN, CHOICE = range(2)
"""Slots of a person's uniforms: whether the label is drawn anew; which component."""


@njit(cache=True)
def move_on(sums: Array, dt: float) -> None:
    """Move the people of the sums (7,) on with their mean velocity for dt s, in place."""
    n = sums[WEIGHT]
    if n > 0:
        for d in range(2):
            old = sums[X + d]
            sums[X + d] += dt * sums[VX + d]
            sums[PLACE_SQUARES] += (sums[X + d] ** 2 - old**2) / n


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
            log_p[g] = math.log(sums[g, WEIGHT]) + log_predictive(sums[g], person, mixture)
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
def propose(
    state: Array, label: Ints, memory: Array, chance: Array, uniforms: Array, mixture: Array, ageing: Array
) -> None:
    """Draw Z_{t+1} for all particles, person by person, and bring the memory of components up to date.

    state (N_x, K, 4): X_{t+1}; label (N_x, N_z, K): Z_t, changed in place; memory (N_x, N_z, K, 7): of each person's
    component, changed in place, or (N_x, N_z, K, 0) for none; chance (K,): probability that a person's label is drawn
    anew; uniforms (N_x, N_z, K, 2); mixture: as cluster_evidence_kernels.LOG_NEW and the following; ageing: as TIME,
    KEPT, GAIN. What a component remembers counts as people in it. A component without members is gone, and so is its
    memory.
    """
    particles, partitions, n = label.shape
    columns = memory.shape[3]
    cluster, head, size = np.empty(n, np.int64), np.empty(n, np.int64), np.empty(n, np.int64)
    past, sums, log_p = np.empty((n, SUMS)), np.empty((n, SUMS)), np.empty(n)
    for i in range(particles):
        for j in range(partitions):
            count = clusters(label[i, j], cluster, head)
            past[:], sums[:], size[:] = 0.0, 0.0, 0
            for g in range(count):
                for d in range(columns):
                    past[g, d] = ageing[KEPT] * memory[i, j, head[g], d]
                move_on(past[g], ageing[TIME])
                for d in range(columns):
                    sums[g, d] = past[g, d]
            for k in range(n):
                size[cluster[k]] += 1
                add_person(sums[cluster[k]], state[i, k], 1.0)
            for k in range(n):
                if uniforms[i, j, k, REDRAWN] >= chance[k]:
                    continue
                g = cluster[k]
                size[g] -= 1
                if size[g] == 0:
                    sums[g], past[g] = 0.0, 0.0
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
                for d in range(columns):
                    memory[i, j, k, d] = past[g, d] + ageing[GAIN] * (sums[g, d] - past[g, d])
