"""Kernels of a Dirichlet process mixture of people: evidence of partitions, and predictive density of a person (ours).

Each group, and each person alone, is a component. The states of its people are independent given the component. Both
axes of a place are normal about the component's mean place, with a variance of the component; both axes of a velocity
about its mean velocity, with a known variance s_v^2. The means have a uniform prior, the variance of places a scaled
inverse chi-squared one with nu degrees of freedom and scale s^2 (the conjugate normal-inverse-gamma model, Gelman et
al., Bayesian Data Analysis, sec. 3.3). The partition has the Chinese restaurant process as prior. With n people in a
component, squared distances d^2 and e^2 of the next person's place and velocity to their means, the sum Q of squared
distances of their places to the mean, nu' = nu + 2 (n - 1) and s'^2 = (nu s^2 + Q) / nu' (1 + 1 / n):

    p(place | the n)    = (1 + d^2 / (nu' s'^2))^-(nu' / 2 + 1) / (2 pi s'^2)          Student's t in two dimensions
    p(velocity | the n) = exp(-e^2 / (2 v)) / (2 pi v),  v = s_v^2 (1 + 1 / n)
    p(the person joins the component | all others)  ~ n p(place | the n) p(velocity | the n)
    p(the person is a new component | all others)   ~ c

c is the process's concentration times the density of the uniform prior, per m^2 and (m/s)^2. States are (K, 4): x, y in
m, vx, vy in m/s. Sums are (7,): as WEIGHT and the following.
"""

from __future__ import annotations

import math

import numpy as np

from sim.compiler import njit
from sim.types import Array, Ints
from tracking.papers.joint.partition_kernels import clusters, same_row

LOG_NEW, DEGREES, PLACE_SPREAD, VELOCITY_SPREAD = range(4)
"""Slots of `mixture` (4,): log c; nu; s, m; s_v, m/s."""
WEIGHT, X, Y, VX, VY, PLACE_SQUARES, VELOCITY_SQUARES = range(7)
"""Slots of the sums (7,) of a component: of people, x, y, vx, vy, x^2 + y^2, vx^2 + vy^2."""
SUMS = 7


@njit(cache=True)
def add_person(sums: Array, person: Array, weight: float) -> None:
    """Add a state (4,) to the sums (7,) of a component, `weight` times; -1 takes it out."""
    sums[WEIGHT] += weight
    for d in range(4):
        sums[X + d] += weight * person[d]
    sums[PLACE_SQUARES] += weight * (person[0] ** 2 + person[1] ** 2)
    sums[VELOCITY_SQUARES] += weight * (person[2] ** 2 + person[3] ** 2)


@njit(cache=True)
def log_predictive(sums: Array, person: Array, mixture: Array) -> float:
    """Return log p(place | the people of a component) p(velocity | them); sums (7,), person (4,)."""
    n = sums[WEIGHT]
    after = mixture[DEGREES] + 2 * (n - 1)
    scatter = max(sums[PLACE_SQUARES] - (sums[X] ** 2 + sums[Y] ** 2) / n, 0.0)
    scale = (mixture[DEGREES] * mixture[PLACE_SPREAD] ** 2 + scatter) * (1 + 1 / n)
    place = (person[0] - sums[X] / n) ** 2 + (person[1] - sums[Y] / n) ** 2
    variance = mixture[VELOCITY_SPREAD] ** 2 * (1 + 1 / n)
    velocity = (person[2] - sums[VX] / n) ** 2 + (person[3] - sums[VY] / n) ** 2
    area = 4 * math.pi**2 * variance * scale / after
    return float(-math.log(area) - (after / 2 + 1) * math.log1p(place / scale) - velocity / (2 * variance))


@njit(cache=True)
def log_marginal(sums: Array, mixture: Array) -> float:
    """Return log p(states of the people of a component), relative to the density of the first one; sums (7,)."""
    n, half, variance = sums[WEIGHT], mixture[DEGREES] / 2, mixture[VELOCITY_SPREAD] ** 2
    prior = mixture[DEGREES] * mixture[PLACE_SPREAD] ** 2
    places = max(sums[PLACE_SQUARES] - (sums[X] ** 2 + sums[Y] ** 2) / n, 0.0)
    velocities = max(sums[VELOCITY_SQUARES] - (sums[VX] ** 2 + sums[VY] ** 2) / n, 0.0)
    gammas = math.lgamma(half + n - 1) - math.lgamma(half)
    own = gammas - (half + n - 1) * math.log1p(places / prior) - velocities / (2 * variance)
    return float(own - 2 * math.log(n) - (n - 1) * math.log(2 * math.pi**2 * variance * prior))


@njit(cache=True)
def log_evidences(state: Array, label: Ints, mixture: Array, out: Array) -> None:
    """Write log p(Z, X) of each partition, (N_x, N_z), but for a constant: CRP prior times marginal likelihoods.

    state (N_x, K, 4); label (N_x, N_z, K); mixture: as LOG_NEW and the following. log p = sum over components of
    log c + log (n - 1)! + log_marginal.
    """
    particles, partitions, n = label.shape
    cluster, head, sums = np.empty(n, np.int64), np.empty(n, np.int64), np.empty((n, SUMS))
    for i in range(particles):
        for j in range(partitions):
            if j > 0 and same_row(label[i, j], label[i, j - 1]):
                out[i, j] = out[i, j - 1]
                continue
            count = clusters(label[i, j], cluster, head)
            sums[:count] = 0.0
            for k in range(n):
                add_person(sums[cluster[k]], state[i, k], 1.0)
            total = count * mixture[LOG_NEW]
            for g in range(count):
                if sums[g, WEIGHT] > 1:
                    total += math.lgamma(sums[g, WEIGHT]) + log_marginal(sums[g], mixture)
            out[i, j] = total


@njit(cache=True)
def log_conditionals(state: Array, label: Ints, mixture: Array, out: Array) -> None:
    """Write log p(z_k | all other labels, X) of each person's label, (K,); state (K, 4), label (K,).

    Their sum is the log pseudo-likelihood of the partition.
    """
    n = len(label)
    cluster, head, sums = np.empty(n, np.int64), np.empty(n, np.int64), np.zeros((n, SUMS))
    count = clusters(label, cluster, head)
    for k in range(n):
        add_person(sums[cluster[k]], state[k], 1.0)
    for k in range(n):
        own = sums[cluster[k]].copy()
        add_person(sums[cluster[k]], state[k], -1.0)
        total, present = mixture[LOG_NEW], mixture[LOG_NEW]
        for g in range(count):
            if sums[g, WEIGHT] > 0.5:
                joined = math.log(sums[g, WEIGHT]) + log_predictive(sums[g], state[k], mixture)
                total = max(total, joined) + math.log1p(math.exp(-abs(total - joined)))
                if g == cluster[k]:
                    present = joined
        out[k] = present - total
        sums[cluster[k]] = own
