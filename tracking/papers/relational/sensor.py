"""The weights of `relational` (secs. 2.1, 3.3): how well each particle explains a frame's detections.

The paper sums, over every mapping of detections to people, the product of the probabilities of the pairs. This sum is
p(z_t | s^a_t) of eq. 6. Ours: missed people and false alarms, so that particles with different numbers of people can be
compared, and the probability that each person exists, which is computed for each particle and not drawn.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sim.types import Array, Bools, Ints
from tracking.papers.relational import particle_set_kernels, sensor_kernels
from tracking.papers.relational.config import ParticleConfig
from tracking.papers.relational.particle_set import ParticleSet

# Distance, in standard deviations of a point and of a displaced point, above both of which a person and a detection are
# no pair (ours).
REACH, WIDE_REACH = 6.0, 3.0
# A person and a detection are no pair if it is, among all detections and none, the person's with less than this
# probability (ours).
UNLIKELY = 1e-3
ALMOST = 1 - 1e-9  # Largest probability of a detection (ours).


@dataclass(frozen=True)
class Weighing:
    """What a frame's detections say, over P particles, K people and M detections.

    pairs (K, M): probability that person and detection belong together, weighted over particles. seen (K,): probability
    that the person, if existing, is measured. nobody (M,): probability that the detection is no known person's.
    """

    pairs: Array
    seen: Array
    nobody: Array


@dataclass(frozen=True)
class Sight:
    """What is known of K people before a frame's detections.

    detect (K,): probability that each person is measured if existing; missed (K,): True for people who were not
    measured in the last frame; cut (K,): probability that the feet are hidden behind another person; eye (2,):
    place of the camera on the ground, m, nan if unknown.
    """

    detect: Array
    missed: Bools
    cut: Array
    eye: Array


def weigh(particles: ParticleSet, points: Array, sight: Sight, noise: float, config: ParticleConfig) -> Weighing:
    """Multiply the weights of the particles by p(z_t | s^a_t), update existence, and return what the detections say."""
    people, count, certain = particles.people, len(points), config.certain_sensor
    if not people:
        return Weighing(np.zeros((0, count)), np.zeros(0), np.ones(count))
    particles.share_weights(certain)
    if certain:
        pairs, logs, marginals = _complete(particles, points, noise)
    else:
        pairs, density = _pairs(particles, points, sight, noise, config)
        logs, marginals = np.empty(particles.exist.shape), np.empty(density.shape)
        detect = np.minimum(sight.detect, ALMOST)
        free = _free(particles, pairs, density, count, detect, config)
        sensor_kernels.person_sums(
            density, pairs, particles.exist, detect, config.clutter_density, free, logs, marginals
        )
        sensor_kernels.partner_factors(particles.pairs, particles.related, particles.weights, sight.missed, logs)
    particles.weigh(logs)
    measured = sensor_kernels.measured(marginals, pairs, people)
    if not certain:
        unseen = particles.exist * (1 - detect) / np.maximum(1 - particles.exist * detect, np.finfo(float).tiny)
        particles.exist = np.minimum(measured + (1 - measured) * unseen, 1.0)
    found = np.zeros((people, count))
    found[pairs[:, 0], pairs[:, 1]] = particle_set_kernels.pair_sums(
        particles.weights, np.ones_like(particles.exist), pairs, marginals
    )
    exist, seen = particles.existence, particle_set_kernels.column_sums(particles.weights, measured)
    seen = np.divide(seen, exist, out=np.zeros(people), where=exist > 0)
    return Weighing(found, seen, 1.0 - found.sum(axis=0))


def _complete(particles: ParticleSet, points: Array, noise: float) -> tuple[Ints, Array, Array]:
    near = sensor_kernels.near_detections(particles.pos, points, (REACH * noise) ** 2)
    person, point = sensor_kernels.components(near)
    pairs = _places_of(person[:, None] == point)
    logs, marginals = np.zeros((particles.count, 1)), np.empty((particles.count, len(pairs)))
    sensor_kernels.complete_sums(particles.pos, points, noise, person, point, logs, marginals)
    return pairs, logs, marginals


def _pairs(
    particles: ParticleSet, points: Array, sight: Sight, noise: float, config: ParticleConfig
) -> tuple[Ints, Array]:
    wide = max(config.outlier_noise, noise)
    normal = config.outlier_share == 0
    share = np.zeros(particles.people) if normal else config.outlier_share + (1 - config.outlier_share) * sight.cut
    displaced = WIDE_REACH * wide if config.outlier_share > 0 else 0.0
    reach = max(REACH * noise, displaced) ** 2
    pairs = _places_of(sensor_kernels.near_detections(particles.pos, points, reach))
    density = sensor_kernels.densities(particles.pos, points, pairs, noise, wide, share, sight.eye, reach)
    person = pairs[:, 0]
    mean = particle_set_kernels.pair_sums(particles.weights, particles.exist, pairs, density)
    odds = mean * sight.detect[person] / config.clutter_density
    total = 1 - particles.existence * sight.detect + np.bincount(person, odds, particles.people)
    likely = odds > UNLIKELY * total[person]
    return pairs[likely], np.compress(likely, density, 1)


def _places_of(flags: Bools) -> Ints:
    return np.ascontiguousarray(np.argwhere(flags))


def _free(
    particles: ParticleSet, pairs: Ints, density: Array, count: int, detect: Array, config: ParticleConfig
) -> Array:
    person = pairs[:, 0]
    mean = np.zeros((particles.people, count))
    found = particle_set_kernels.pair_sums(particles.weights, particles.exist, pairs, density)
    mean[person, pairs[:, 1]] = found * detect[person] / config.clutter_density
    return sensor_kernels.free_detections(mean, np.maximum(1 - particles.existence * detect, 0.0))
