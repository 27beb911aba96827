"""The weights of `relational` (secs. 2.1, 3.3): how well each particle explains a frame's detections.

The paper sums, over every mapping of detections to people, the product of the probabilities of the pairs. This sum is
p(z_t | s^a_t) of eq. 6. Ours: missed people and false alarms, so that particles with different numbers of people can be
compared, and the probability that each person exists, which is computed for each particle and not drawn.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sim.types import Array, Bools
from tracking.papers.relational import sensor_kernels
from tracking.papers.relational.config import ParticleConfig
from tracking.papers.relational.particle_set import ParticleSet

REACH = 36.0
"""Squared distance, in squared standard deviations, above which a person and a detection are no pair (ours)."""
COUPLED = 0.02
"""Share of particles in which a pair walks together above which it is in one cluster (ours)."""
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


def weigh(particles: ParticleSet, points: Array, detect: Array, noise: float, config: ParticleConfig) -> Weighing:
    """Multiply the weights of the particles by p(z_t | s^a_t), update existence, and return what the detections say.

    points (M, 2): m; detect (K,): probability that each person is measured if existing; noise: standard deviation of a
    point per axis, m. Clusters, weights and existence of the particles are changed. If all weights vanish, which only
    the paper's sensor can bring about, they are not.
    """
    people, certain = particles.people, config.certain_sensor
    if not people:
        return Weighing(False, np.zeros((0, len(points))), np.zeros(0), np.ones(len(points)))
    reach = np.inf if certain else REACH
    near = sensor_kernels.near_detections(particles.pos, points, reach * noise**2)
    particles.regroup(_linked(particles, near, config))
    log_sums, marginals = np.empty(particles.exist.shape), np.empty((*particles.exist.shape, len(points)))
    sensor_kernels.particle_sums(
        particles.pos, particles.exist, detect, points, noise, config.clutter_density, reach, near,
        particles.cluster, log_sums, marginals,
    )  # fmt: skip
    if certain and log_sums[:, particles.heads].max(axis=0).min() < LEAST_LOG:
        return Weighing(True, np.zeros((people, len(points))), np.zeros(people), np.ones(len(points)))
    particles.weigh(log_sums)
    measured = marginals.sum(axis=2)
    if not certain:
        unseen = particles.exist * (1 - detect) / np.maximum(1 - particles.exist * detect, np.finfo(float).tiny)
        particles.exist = np.minimum(measured + (1 - measured) * unseen, 1.0)
    pairs = np.einsum("pk,pkm->km", particles.weights, marginals)
    exist = particles.existence
    seen = np.divide((particles.weights * measured).sum(axis=0), exist, out=np.zeros(people), where=exist > 0)
    return Weighing(False, pairs, seen, 1.0 - pairs.sum(axis=0))


def _linked(particles: ParticleSet, near: Bools, config: ParticleConfig) -> Bools:
    """Returns which people (K, K) must be in one cluster: all in joint mode and with the paper's sensor; else those who
    may have a detection in common, or walk together in more than a share COUPLED of the particles.

    near (K, M): which people and detections are within reach in some particle.
    """
    if config.weights == "joint" or config.certain_sensor:
        return np.ones((particles.people, particles.people), bool)
    shared = near.astype(float) @ near.T > 0
    return np.asarray(shared | (particles.related.mean(axis=0) > COUPLED))
