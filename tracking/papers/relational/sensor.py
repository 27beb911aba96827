"""The weights of `relational` (secs. 2.1, 3.3): how well each particle explains a frame's detections.

The paper sums, over every mapping of detections to people, the product of the probabilities of the pairs. This sum is
p(z_t | s^a_t) of eqs 6 and 12. Ours, without effect on the paper's sensor: missed people and false alarms; displaced
detections; the probability that each person exists, which is computed for each particle and not drawn; a sum for each
person, all others averaged; factors of the partners of missed people.
"""

from __future__ import annotations

import numpy as np

from sim.types import Array, Bools, Ints
from tracking.papers.relational import sensor_kernels
from tracking.papers.relational.association_sums_kernels import sparse_sum
from tracking.papers.relational.config import ParticleConfig
from tracking.papers.relational.particle_set import ParticleSet
from tracking.papers.relational.particle_set_kernels import column_sums, reached

# Distance, in standard deviations of a point and of a displaced point, above both of which a person and a detection are
# no pair (ours).
REACH, WIDE_REACH = 6.0, 3.0
# A person and a detection are no pair if it is, among all detections and none, the person's with less than this
# probability (ours).
UNLIKELY = 1e-3
ALMOST = 1 - 1e-9  # Largest probability of a detection (ours).
LEAST_MISS = 1e-6  # Least weight of a person without detection in the average over others, which divides by it.


def weigh(
    particles: ParticleSet, points: Array, detect: Array, missed: Bools, cut: Array, eye: Array, noise: float,
    config: ParticleConfig,
) -> tuple[Array, Array, Array]:  # fmt: skip
    """Multiplies the weights of the particles by p(z_t | s^a_t), updates existence, and returns three probabilities.

    detect (K,): probability that each person is measured if existing; missed (K,): True for people who were not
    measured in the last frame with a measurement; cut (K,): probability that the feet are hidden behind another person;
    eye (2,): place of the camera on the ground, m, nan if unknown.

    Returned are the probabilities that person and detection belong together, (K, M), weighted over particles; that each
    person, if existing, is measured, (K,); and that each detection is no known person's, (M,).
    """
    people, count, certain = particles.people, len(points), config.certain_sensor
    if not people:
        return np.zeros((0, count)), np.zeros(0), np.ones(count)
    particles.share_weights(certain)
    if certain:
        pairs, logs, marginals = _complete(particles, points, noise)
    else:
        detect = np.minimum(detect, ALMOST)
        pairs, density, mean = _pairs(particles, points, detect, cut, eye, noise, config)
        free = free_detections(mean, np.maximum(1 - particles.existence * detect, LEAST_MISS))
        logs, measured = np.empty((2, *particles.exist.shape))
        marginals = np.empty(density.shape)
        sensor_kernels.person_sums(
            density, pairs, particles.exist, detect, config.clutter_density, free, logs, marginals, measured
        )
        add_partner_factors(particles, missed, logs)
        unseen = particles.exist * (1 - detect) / np.maximum(1 - particles.exist * detect, np.finfo(float).tiny)
        particles.exist = np.minimum(measured + (1 - measured) * unseen, 1.0)
    particles.weigh(logs)
    found = np.zeros((people, count))
    found[pairs[:, 0], pairs[:, 1]] = column_sums(particles.weights.take(pairs[:, 0], 1), marginals)
    exist = particles.existence
    seen = np.divide(found.sum(axis=1), exist, out=np.zeros(people), where=exist > 0)
    return found, seen, 1.0 - found.sum(axis=0)


def _complete(particles: ParticleSet, points: Array, noise: float) -> tuple[Ints, Array, Array]:
    most = (REACH * noise) ** 2
    k, j = reached(particles.pos, points, most).T
    near = np.zeros((particles.people, len(points)), bool)
    near[k, j] = (np.square(points[j] - particles.pos[:, k]).sum(axis=2) <= most).any(axis=0)
    person, point = sensor_kernels.components(near)
    pairs = np.ascontiguousarray(np.argwhere(person[:, None] == point))
    logs, marginals = np.zeros((particles.count, 1)), np.empty((particles.count, len(pairs)))
    sensor_kernels.complete_sums(particles.pos, points, noise, person, point, logs, marginals)
    return pairs, logs, marginals


def _pairs(
    particles: ParticleSet, points: Array, detect: Array, cut: Array, eye: Array, noise: float, config: ParticleConfig
) -> tuple[Ints, Array, Array]:
    wide = max(config.outlier_noise, noise)
    normal = config.outlier_share == 0
    share = np.zeros(particles.people) if normal else config.outlier_share + (1 - config.outlier_share) * cut
    displaced = WIDE_REACH * wide if config.outlier_share > 0 else 0.0
    reach = max(REACH * noise, displaced) ** 2
    pairs = reached(particles.pos, points, reach)
    density = sensor_kernels.densities(particles.pos, points, pairs, noise, wide, share, eye, reach)
    person, weights = pairs[:, 0], particles.weights * particles.exist
    odds = column_sums(weights.take(person, 1), density) * detect[person] / config.clutter_density
    total = 1 - particles.existence * detect + np.bincount(person, odds, particles.people)
    likely = odds > UNLIKELY * total[person]
    mean = np.zeros((particles.people, len(points)))
    mean[person[likely], pairs[likely, 1]] = odds[likely]
    return pairs[likely], np.compress(likely, density, 1), mean


CANCELLED = 1e-9  # Least share of the weight without detection: below it 1 minus the marginals is rounding.


def free_detections(W: Array, miss: Array) -> Array:
    """Returns the probability that nobody else has a detection, (K, M), for each person: that of the sum over all
    mappings of the other people.

    W (K, M): mean weight of each person and detection; miss (K,), above 0: mean weight of the person without detection;
    both over the particles; spare weights are 1. It is 1 for pairs without weight.

    With m the marginals of the sum over all mappings of all people, it is m[k, j] / W[k, j] over the share of the
    mappings in which k has no detection, by its weight `miss`: all three are sums over mappings of the others.
    """
    miss = np.maximum(miss, CANCELLED * W.max(axis=1, initial=0.0))
    m = np.empty(W.shape)
    sparse_sum(W, miss, np.ones(W.shape[1]), m)
    alone = np.maximum(1 - m.sum(axis=1), np.finfo(float).tiny) / miss
    free = np.divide(m, W * alone[:, None], out=np.ones(W.shape), where=W > 0)
    return np.asarray(np.minimum(free, 1.0))


def add_partner_factors(particles: ParticleSet, missed: Bools, logs: Array) -> None:
    """Adds the partners' log-likelihoods to those of each missed person, in place: what is seen of partners tells where
    the person is.

    particles: with the weights before the frame; missed (K,); logs (P, K): log-likelihoods of each person; changed.

    The factor of a partner is l(p) / mean l in the particles in which the two walk together, 1 in all others. So the
    person has the posterior of the joint filter if the partner's is independent of it.
    """
    rows, side = np.nonzero(missed[particles.pairs])
    partners, at = np.unique(particles.pairs[rows, 1 - side], return_inverse=True)
    own, weights = logs.T[partners], particles.weights.T[partners]
    top = own.max(axis=1, keepdims=True, initial=-np.inf)
    with np.errstate(invalid="ignore"):
        mean = (weights * np.exp(own - top)).sum(axis=1, keepdims=True)
        factor = own - (top + np.log(np.maximum(mean, np.finfo(float).tiny)))
    for row, person, k in zip(rows, particles.pairs[rows, side], at, strict=True):
        if top[k] > -np.inf:
            logs[:, person] += np.where(particles.related[row], factor[k], 0.0)
