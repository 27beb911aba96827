"""Clusters of people with weights of their own: what joins and divides, and that no weight counts twice."""

from __future__ import annotations

import numpy as np
import pytest

from tracking.papers.relational import sensor, sensor_kernels
from tracking.papers.relational.association_sums_kernels import sparse_sum
from tracking.papers.relational.config import ParticleConfig, RelationalConfig
from tracking.papers.relational.particle_set import ParticleSet
from tracking.papers.relational.report import estimates


def three(count=400, seed=0):
    """Three people in particles that differ, each a cluster with equal weights."""
    rng, made = np.random.default_rng(seed), ParticleSet.empty(count)
    for x in (0.0, 0.4, 8.0):
        pos = rng.normal([x, 0.0], 0.1, (count, 2))
        made.add(pos, rng.normal(0, 1, (count, 2)), 0.9, np.zeros(made.exist.shape, bool))
    return made


def pairs(*linked):
    out = np.eye(3, dtype=bool)
    for a, b in linked:
        out[a, b] = out[b, a] = True
    return out


def weighed(particles, seed):
    """The particles with the log-likelihoods of each cluster, (P, K)."""
    logs = np.random.default_rng(seed).normal(0, 1, particles.exist.shape)
    particles.weigh(logs)
    return logs


def test_clusters_that_join_have_the_product_of_their_weights():
    particles = three()
    logs = weighed(particles, 1)
    particles.regroup(pairs((0, 1)))
    assert particles.cluster.tolist() == [0, 0, 2]
    product = np.exp(logs[:, 0] + logs[:, 1])
    np.testing.assert_allclose(particles.weights[:, 0], product / product.sum(), rtol=1e-12)
    assert np.array_equal(particles.weights[:, 0], particles.weights[:, 1])
    alone = np.exp(logs[:, 2])
    np.testing.assert_allclose(particles.weights[:, 2], alone / alone.sum(), rtol=1e-12)


def test_a_cluster_divides_only_after_resampling():
    particles = three()
    particles.regroup(pairs((0, 1)))
    weighed(particles, 2)
    before = particles.weights.copy()
    particles.regroup(pairs())
    assert particles.cluster.tolist() == [0, 0, 2]
    assert np.array_equal(particles.weights, before)
    particles.resample(1.0, "residual", np.random.default_rng(0))
    particles.regroup(pairs())
    assert particles.cluster.tolist() == [0, 1, 2]


def test_a_cluster_is_resampled_as_a_whole_and_others_are_left():
    particles = three()
    particles.regroup(pairs((0, 1)))
    particles.related[:, 0, 1] = particles.related[:, 1, 0] = np.random.default_rng(3).random(400) < 0.5
    weighed(particles, 4)
    particles.weights[:, 2] = 1 / 400
    old = {tuple(row) for row in particles.pos[:, :2].reshape(400, 4)}
    third = particles.pos[:, 2].copy()
    particles.resample(0.9, "systematic", np.random.default_rng(0))
    assert {tuple(row) for row in particles.pos[:, :2].reshape(400, 4)} < old
    assert np.array_equal(particles.pos[:, 2], third)
    assert np.array_equal(particles.related, particles.related.transpose(0, 2, 1))


@pytest.mark.parametrize("removed", range(3))
def test_removing_a_person_keeps_the_others_together(removed):
    particles = three()
    particles.regroup(pairs((0, 1), (1, 2)))
    particles.keep(np.arange(3) != removed)
    assert particles.cluster.tolist() == [0, 0]


def test_weights_of_clusters_multiply_to_the_joint_weight():
    """Far from each other, the joint likelihood is the product of the clusters' likelihoods."""
    points = np.array([[0.02, 0.05], [0.45, -0.02], [8.1, 0.0]])
    joint, apart = three(), three()
    sensor.weigh(joint, points, np.full(3, 0.9), np.zeros(3, bool), 0.08, ParticleConfig(weights="joint"))
    sensor.weigh(apart, points, np.full(3, 0.9), np.zeros(3, bool), 0.08, ParticleConfig())
    assert joint.cluster.tolist() == [0, 0, 0]
    assert apart.cluster.tolist() == [0, 0, 2]
    product = apart.weights[:, 0] * apart.weights[:, 2]
    np.testing.assert_allclose(joint.weights[:, 0], product / product.sum(), rtol=1e-9)
    np.testing.assert_allclose(joint.exist, apart.exist, rtol=1e-12)


def test_people_who_walk_together_share_a_cluster_without_a_common_detection():
    """A hidden partner in another cluster would lose its help."""
    particles = three()
    particles.related[:, 0, 2] = particles.related[:, 2, 0] = True
    sensor.weigh(particles, np.zeros((0, 2)), np.full(3, 0.9), np.zeros(3, bool), 0.08, RelationalConfig())
    assert particles.cluster.tolist() == [0, 1, 2], "everybody was measured"
    missed = np.array([False, False, True])
    sensor.weigh(particles, np.zeros((0, 2)), np.full(3, 0.9), missed, 0.08, RelationalConfig())
    assert particles.cluster.tolist() == [0, 1, 0]


def test_existence_by_bayes():
    """A person who is missed exists with e (1 - P) / (1 - e P); one who is certainly measured exists."""
    particles = three()
    far = np.array([[0.0, 0.0]])
    particles.pos[:, 0], particles.pos[:, 1] = far[0], [5.0, 0.0]
    sensor.weigh(particles, far, np.full(3, 0.8), np.zeros(3, bool), 0.08, ParticleConfig(clutter_density=1e-9))
    np.testing.assert_allclose(particles.exist[:, 2], 0.9 * 0.2 / (1 - 0.9 * 0.8), rtol=1e-12)
    np.testing.assert_allclose(particles.exist[:, 0], 1.0, atol=1e-6)


def test_moments_are_weighted_by_existence():
    particles = three()
    particles.exist[:200, 0] = 0.0
    pos, vel, cov, exist = estimates(particles)
    kept = np.concatenate([particles.pos[200:, 0], particles.vel[200:, 0]], axis=1)
    np.testing.assert_allclose(np.concatenate([pos[0], vel[0]]), kept.mean(axis=0), rtol=1e-9)
    np.testing.assert_allclose(cov[0], np.cov(kept.T, bias=True), rtol=1e-9)
    assert exist[0] == pytest.approx(0.45)


def test_sums_of_people_alone_are_those_of_all_mappings():
    """People who share no detection are summed by themselves: the same as the sums over all mappings."""
    rng = np.random.default_rng(4)
    pos, points = rng.normal(0, 2, (20, 6, 2)), rng.normal(0, 2, (5, 2))
    exist, detect = rng.uniform(0.2, 1, (20, 6)), rng.uniform(0.5, 1, 6)
    pairs = np.array([[0, 0], [1, 1], [1, 2], [2, 2], [3, 3], [3, 4]])
    density = sensor_kernels.densities(pos, points, pairs, np.array([0.5, 1.0, 0.1]), np.inf)
    cluster, logs, found = np.array([0, 1, 1, 3, 4, 0]), np.empty((20, 6)), np.empty((20, 6, 5))
    sensor_kernels.particle_sums(density, pairs, exist, detect, 0.01, cluster, logs, found)
    for p in range(20):
        seen, W = exist[p] * detect, np.zeros((6, 5))
        W[pairs[:, 0], pairs[:, 1]] = seen[pairs[:, 0]] * density[p] / 0.01
        log, marginals = np.empty(6), np.empty((6, 5))
        sparse_sum(W, 1 - seen, np.ones(5), cluster, log, marginals)
        np.testing.assert_allclose(logs[p, [0, 1, 3, 4]], log[[0, 1, 3, 4]], rtol=1e-12, atol=1e-12)
        np.testing.assert_allclose(found[p], marginals, rtol=1e-12, atol=1e-15)


def test_a_displaced_point_is_the_persons_only_if_points_may_be_displaced():
    displaced, found = np.array([[0.7, 0.0]]), []
    for share in (0.0, 0.1):
        particles = placed_alone(np.zeros(2))
        config = ParticleConfig(outlier_share=share, outlier_noise=0.4)
        said = sensor.weigh(particles, displaced, np.array([0.9]), np.zeros(1, bool), 0.08, config)
        found.append(float(said.nobody[0]))
    assert found[0] > 0.999
    assert found[1] < 0.5


def placed_alone(place):
    particles = ParticleSet.empty(200)
    particles.add(np.tile(place, (200, 1)), np.zeros((200, 2)), 1.0, np.zeros((200, 0), bool))
    return particles
