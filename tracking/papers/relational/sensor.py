"""The weights of `relational` (secs. 2.1, 3.3): how well each particle explains a frame's detections.

The paper sums, over every mapping of detections to people, the product of the probabilities of the pairs. This sum is
p(z_t | s^a_t) of eq. 6. Ours: missed people and false alarms, so that particles with different numbers of people can be
compared, and the probability that each person exists, which is computed for each particle and not drawn.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sim.types import Array, Bools, Ints
from tracking.papers.relational import sensor_kernels
from tracking.papers.relational.config import ParticleConfig
from tracking.papers.relational.particle_set import ParticleSet

REACH, WIDE_REACH = 6.0, 3.0
"""Distance, in standard deviations of a point and of a displaced point, above both of which a person and a detection
are no pair (ours)."""
UNLIKELY = 1e-3
"""A person and a detection are no pair if it is, among all detections and none, the person's with less than this
probability (ours)."""
COUPLED = 0.02
"""Share of particles in which two people, one of them missed in the last frame, walk together above which they are in
one cluster (ours)."""
LEAST_LOG = -745.0
"""Log of the smallest float: the paper's weights are 0 below it."""


@dataclass(frozen=True)
class Weighing:
    """What a frame's detections say, over P particles, K people and M detections.

    vanished: all weights are 0; the particles were left as they were. pairs (K, M): probability that person and
    detection belong together, weighted over particles. seen (K,): probability that the person, if existing, is
    measured. nobody (M,): probability that the detection is no known person's.
    """

    vanished: bool
    pairs: Array
    seen: Array
    nobody: Array


def weigh(
    particles: ParticleSet, points: Array, detect: Array, missed: Bools, noise: float, config: ParticleConfig
) -> Weighing:
    """Multiply the weights of the particles by p(z_t | s^a_t), update existence, and return what the detections say.

    points (M, 2): m; detect (K,): probability that each person is measured if existing; missed (K,): True for people
    who were not measured in the last frame; noise: standard deviation of a point per axis, m. Clusters, weights and
    existence of the particles are changed. If all weights vanish, which only the paper's sensor can bring about, they
    are not.
    """
    people, certain = particles.people, config.certain_sensor
    if not people:
        return Weighing(False, np.zeros((0, len(points))), np.zeros(0), np.ones(len(points)))
    pairs, density = _pairs(particles, points, detect, noise, config)
    particles.regroup(_linked(particles, pairs, missed, config))
    log_sums, marginals = np.empty(particles.exist.shape), np.empty((*particles.exist.shape, len(points)))
    sensor_kernels.particle_sums(
        density, pairs, particles.exist, detect, config.clutter_density, particles.cluster, log_sums, marginals
    )
    if certain and log_sums[:, particles.heads].max(axis=0).min() < LEAST_LOG:
        return Weighing(True, np.zeros((people, len(points))), np.zeros(people), np.ones(len(points)))
    particles.weigh(log_sums)
    measured = marginals.sum(axis=2)
    if not certain:
        unseen = particles.exist * (1 - detect) / np.maximum(1 - particles.exist * detect, np.finfo(float).tiny)
        particles.exist = np.minimum(measured + (1 - measured) * unseen, 1.0)
    found = np.einsum("pk,pkm->km", particles.weights, marginals)
    exist = particles.existence
    seen = np.divide((particles.weights * measured).sum(axis=0), exist, out=np.zeros(people), where=exist > 0)
    return Weighing(False, found, seen, 1.0 - found.sum(axis=0))


def _pairs(
    particles: ParticleSet, points: Array, detect: Array, noise: float, config: ParticleConfig
) -> tuple[Ints, Array]:
    """Returns the pairs (N, 2) of a person and a detection that are possible, and their densities (P, N), 1/m^2.

    With the paper's sensor all pairs are possible.
    """
    wide = max(config.outlier_noise, noise)
    densities = np.array([noise, wide, config.outlier_share])
    if config.certain_sensor:
        pairs = np.argwhere(np.ones((particles.people, len(points)), bool))
        return pairs, sensor_kernels.densities(particles.pos, points, pairs, densities, np.inf)
    displaced = WIDE_REACH * wide if config.outlier_share > 0 else 0.0
    reach = max(REACH * noise, displaced) ** 2
    pairs = np.argwhere(sensor_kernels.near_detections(particles.pos, points, reach))
    density = sensor_kernels.densities(particles.pos, points, pairs, densities, reach)
    person = pairs[:, 0]
    mean = np.einsum("pn,pn->n", (particles.weights * particles.exist)[:, person], density)
    odds = mean * detect[person] / config.clutter_density
    total = 1 - particles.existence * detect + np.bincount(person, odds, particles.people)
    likely = odds > UNLIKELY * total[person]
    return pairs[likely], density[:, likely]


def _linked(particles: ParticleSet, pairs: Ints, missed: Bools, config: ParticleConfig) -> Bools:
    """Returns which people (K, K) must be in one cluster: all in joint mode and with the paper's sensor; else those who
    may have a detection in common, or walk together in more than a share COUPLED of the particles while one of them is
    missed, so that the other tells where.

    pairs (N, 2): a person and a detection that are possible; missed (K,).
    """
    people = particles.people
    if config.weights == "joint" or config.certain_sensor:
        return np.ones((people, people), bool)
    near = np.zeros((people, int(pairs[:, 1].max(initial=-1)) + 1))
    near[pairs[:, 0], pairs[:, 1]] = 1.0
    hidden = missed[:, None] | missed
    return np.asarray((near @ near.T > 0) | (hidden & (particles.related.mean(axis=0) > COUPLED)))
