"""Clusters of people with weights of their own: what joins and divides, and that no weight counts twice."""

from __future__ import annotations

import numpy as np
import pytest

from tracking.papers.relational import sensor
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
