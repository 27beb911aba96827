"""The weights of `relational` (secs. 2.1, 3.3): how well each particle explains a frame's detections.

The paper sums, over every mapping of detections to people, the product of the probabilities of the pairs. This sum is
p(z_t | s^a_t) of eq. 6. Ours: missed people and false alarms, so that particles with different numbers of people can be
compared, and the probability that each person exists, which is computed for each particle and not drawn.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sim.types import Array
from tracking.papers.relational import association_sums_kernels
from tracking.papers.relational.config import ParticleConfig
from tracking.papers.relational.particle_set import ParticleSet

REACH = 50.0
"""Squared distance, in squared standard deviations, above which a person and a detection are no pair (ours)."""
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


def weigh(particles: ParticleSet, points: Array, detect: Array, config: ParticleConfig) -> Weighing:
    """Multiply the weights of the particles by p(z_t | s^a_t), update existence, and return what the detections say.

    points (M, 2): m; detect (K,): probability that each person is measured if existing. `log_weights` and `exist` are
    changed. If all weights vanish, which only the paper's sensor can bring about, nothing is changed.
    """
    count, people = particles.exist.shape
    log_sums, marginals = np.empty(count), np.empty((count, people, len(points)))
    reach = np.inf if config.certain_sensor else REACH
    association_sums_kernels.particle_sums(
        particles.pos, particles.exist, detect, points, config.point_noise, config.clutter_density, reach, log_sums,
        marginals,
    )  # fmt: skip
    if config.certain_sensor and log_sums.max(initial=-np.inf) < LEAST_LOG:
        return Weighing(True, np.zeros((people, len(points))), np.zeros(people), np.ones(len(points)))
    log_weights = particles.log_weights + log_sums
    log_weights -= log_weights.max()
    particles.log_weights = log_weights - np.log(np.exp(log_weights).sum())
    measured = marginals.sum(axis=2)
    if not config.certain_sensor:
        unseen = particles.exist * (1 - detect) / np.maximum(1 - particles.exist * detect, np.finfo(float).tiny)
        particles.exist = np.minimum(measured + (1 - measured) * unseen, 1.0)
    weights = particles.weights
    pairs = np.einsum("p,pkm->km", weights, marginals)
    exist = weights @ particles.exist
    seen = np.divide(weights @ measured, exist, out=np.zeros(people), where=exist > 0)
    return Weighing(False, pairs, seen, 1.0 - pairs.sum(axis=0))
