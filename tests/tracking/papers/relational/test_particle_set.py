"""Weights of each person and one weight of a particle: that no weight counts twice, and what the detections say."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from sim.types import Context
from tests.point_frames import stepped
from tests.reference_relational import drawn, relate
from tracking.papers.relational import particle_set_kernels, sensor, sensor_kernels
from tracking.papers.relational.association_sums_kernels import exact_sum
from tracking.papers.relational.config import ParticleConfig, RelationalConfig
from tracking.papers.relational.particle_set import ParticleSet
from tracking.papers.relational.tracker import Particle, Relational


def sight(detect, missed=None, cut=None, eye=(np.nan, np.nan)):
    detect = np.asarray(detect, float)
    none = np.zeros(len(detect))
    seen, uncut = none > 0, none
    return detect, seen if missed is None else np.array(missed), uncut if cut is None else np.array(cut), np.array(eye)


def three(count=400, seed=0):
    """Three people in particles that differ, with equal weights."""
    rng, made = np.random.default_rng(seed), ParticleSet.empty(count)
    for x in (0.0, 0.4, 8.0):
        pos = rng.normal([x, 0.0], 0.1, (count, 2))
        made.add(pos[:, None], rng.normal(0, 1, (count, 1, 2)), 0.9)
    return made


def weighed(particles, seed):
    """The particles with the log-likelihoods of each person, (P, K)."""
    logs = np.random.default_rng(seed).normal(0, 1, particles.exist.shape)
    particles.weigh(logs)
    return logs


def test_one_weight_is_the_product_of_the_peoples():
    particles = three()
    logs = weighed(particles, 1)
    np.testing.assert_allclose(particles.weights, np.exp(logs) / np.exp(logs).sum(axis=0), rtol=1e-12)
    particles.share_weights(True)
    product = np.exp(logs.sum(axis=1))
    np.testing.assert_allclose(particles.weights, np.repeat((product / product.sum())[:, None], 3, axis=1), rtol=1e-12)
    particles.weigh(logs[:, :1])
    product *= np.exp(logs[:, 0])
    np.testing.assert_allclose(particles.weights[:, 2], product / product.sum(), rtol=1e-12)


def test_people_get_weights_of_their_own_only_after_resampling():
    particles = three()
    particles.share_weights(True)
    particles.weigh(np.random.default_rng(2).normal(0, 1, (400, 1)))
    before = particles.weights.copy()
    particles.share_weights(False)
    assert particles.one_weight
    assert np.array_equal(particles.weights, before)
    particles.resample(1.0, drawn(particles, np.random.default_rng(0)))
    particles.share_weights(False)
    assert not particles.one_weight


def test_a_person_is_resampled_alone_and_takes_the_own_relations():
    """The others stay in their particles, and the relations stay symmetric."""
    particles, few = three(), np.arange(400) < 40
    relate(particles, 0, 1, few)
    relate(particles, 1, 2, ~few)
    particles.weights[:, 0] = few / 40
    old = {tuple(x) for x in particles.pos[few, 0]}
    others = particles.pos[:, 1:].copy()
    draws = drawn(particles, np.random.default_rng(0))
    assert not len(particles.resample(0.09, draws)), "a tenth of the particles is effective"
    assert particles.resample(0.9, draws).tolist() == [0]
    assert {tuple(x) for x in particles.pos[:, 0]} <= old
    assert np.array_equal(particles.pos[:, 1:], others)
    assert particles.pairs.tolist() == [[0, 1], [1, 2]]
    assert particles.related[0].all()
    assert np.array_equal(particles.related[1], ~few)


def test_weights_of_a_person_are_those_of_the_joint_filter_with_the_others_averaged():
    """The sum over mappings is linear in each person's weights: so it is exact if people are independent before."""
    points, count = np.array([[0.02, 0.05], [0.45, -0.02]]), 60
    rng = np.random.default_rng(3)
    x, y = rng.normal([0.0, 0.0], 0.1, (count, 2)), rng.normal([0.4, 0.0], 0.1, (count, 2))
    pos = np.stack([np.repeat(x, count, axis=0), np.tile(y, (count, 1))], axis=1)
    alone, config = ParticleSet.empty(count), ParticleConfig()
    for places in (x, y):
        alone.add(places[:, None], np.zeros((count, 1, 2)), 0.9)
    sensor.weigh(alone, points, *sight([0.9] * 2), 0.08, config)
    near, wide, share = np.square(pos[:, :, None] - points).sum(axis=3), config.outlier_noise, config.outlier_share
    density = (1 - share) * np.exp(-near / 2 / 0.08**2) / 0.08**2 + share * np.exp(-near / 2 / wide**2) / wide**2
    W = 0.9 * 0.9 * density / (2 * np.pi) / config.clutter_density
    joint = np.exp([reference_sum(w, np.full(2, 1 - 0.9 * 0.9))[0] for w in W]).reshape(count, count)
    joint /= joint.sum()
    np.testing.assert_allclose(alone.weights[:, 0], joint.sum(axis=1), rtol=1e-6, atol=1e-9)
    np.testing.assert_allclose(alone.weights[:, 1], joint.sum(axis=0), rtol=1e-6, atol=1e-9)


def test_a_missed_person_has_the_weights_of_the_partners():
    """Where the two walk together in a particle, what is seen of the one tells of the other."""
    particles = three()
    relate(particles, 0, 2, np.arange(particles.count) < 200)
    points, missed = particles.pos[:1, 0], np.array([False, False, True])
    sensor.weigh(particles, points, *sight([0.9, 0.9, 0.0], missed), 0.08, RelationalConfig())
    own, other = particles.weights[:200, 0], particles.weights[:200, 2]
    np.testing.assert_allclose(other / other.sum(), own / own.sum(), rtol=1e-9)
    np.testing.assert_allclose(particles.weights[200:, 2], particles.weights[200, 2], rtol=1e-9)


def test_the_kernel_keeps_the_moments_and_draws_equal_particles_apart():
    particles = three(20_000)
    particles.pos[:] = particles.pos[np.random.default_rng(5).integers(0, 20, 20_000)]
    before = [np.cov(particles.pos[:, 0].T), particles.pos[:, 0].mean(axis=0)]
    rng = np.random.default_rng(6)
    few = particles.resample(1.0, drawn(particles, rng))
    particles.spread(few, rng.standard_normal((len(few), 4, particles.count)))
    assert len(np.unique(particles.pos[:, 0, 0])) == 20_000
    np.testing.assert_allclose(particles.pos[:, 0].mean(axis=0), before[1], atol=0.003)
    np.testing.assert_allclose(np.cov(particles.pos[:, 0].T), before[0], rtol=0.05, atol=3e-4)


def test_hidden_feet_displace_a_point_away_from_the_camera():
    pos, pairs = np.zeros((1, 1, 2)), np.array([[0, 0], [0, 1], [0, 2]])
    points, eye = np.array([[0.0, 0.8], [0.0, -0.8], [0.8, 0.0]]), np.array([0.0, -10.0])
    behind, before, beside = sensor_kernels.densities(pos, points, pairs, 0.08, 0.4, np.ones(1), eye, np.inf)[0]
    assert behind > 0.1
    assert before == 0.0
    assert beside < 1e-15
    grid = np.stack(np.meshgrid(np.arange(-2.99, 3, 0.02), np.arange(-2.99, 3, 0.02)), axis=-1).reshape(-1, 2)
    every = np.stack([np.zeros(len(grid), int), np.arange(len(grid))], axis=1)
    for share in (0.0, 0.3):
        density = sensor_kernels.densities(pos, grid, every, 0.08, 0.4, np.array([share]), eye, np.inf)
        assert density.sum() * 0.02**2 == pytest.approx(1.0, abs=0.01)


def test_existence_by_bayes():
    """A person who is missed exists with e (1 - P) / (1 - e P); one who is certainly measured exists."""
    particles = three()
    far = np.array([[0.0, 0.0]])
    particles.pos[:, 0], particles.pos[:, 1] = far[0], [5.0, 0.0]
    sensor.weigh(particles, far, *sight([0.8] * 3), 0.08, ParticleConfig(clutter_density=1e-9))
    np.testing.assert_allclose(particles.exist[:, 2], 0.9 * 0.2 / (1 - 0.9 * 0.8), rtol=1e-12)
    np.testing.assert_allclose(particles.exist[:, 0], 1.0, atol=1e-6)


def candidates(seed):
    """Densities of 9 pairs of 6 people and 5 points in 20 particles, existence and detection; people 0 to 2 and 3 to 5
    share points."""
    rng = np.random.default_rng(seed)
    pos, points = rng.normal(0, 2, (20, 6, 2)), rng.normal(0, 2, (5, 2))
    exist, detect = rng.uniform(0.2, 1, (20, 6)), rng.uniform(0.5, 1, 6)
    pairs = np.array([[0, 0], [0, 1], [1, 1], [1, 2], [2, 2], [3, 3], [3, 4], [4, 4], [5, 4]])
    density = sensor_kernels.densities(pos, points, pairs, 0.5, 1.0, np.full(6, 0.1), np.full(2, np.nan), np.inf)
    return density, pairs, exist, detect


def weights_of(density, pairs, exist, detect, clutter, p):
    """W (K, M) of a particle."""
    W = np.zeros((6, 5))
    W[pairs[:, 0], pairs[:, 1]] = (exist[p] * detect)[pairs[:, 0]] * density[p] / clutter
    return W


@pytest.mark.parametrize("people", [2, 3, 5])
@pytest.mark.parametrize("spread", [0.3, 30.0])
def test_complete_sums_are_those_of_all_mappings_of_the_smaller_side(people, spread):
    """3 detections, and one more with a person of its own; with a large spread the weights underflow as floats."""
    rng = np.random.default_rng(people)
    pos, points = rng.normal(0, spread, (20, people + 1, 2)), rng.normal(0, spread, (4, 2))
    person, point = np.array([0] * people + [people]), np.array([0, 0, 0, people])
    logs, found = np.zeros((20, 1)), np.empty((20, 3 * people + 1))
    sensor_kernels.complete_sums(pos, points, 0.5, person, point, logs, found)
    for p in range(20):
        L = -np.square(pos[p, :, None] - points).sum(axis=2) / 2 / 0.5**2
        if people <= 3:
            maps = [tuple(enumerate(c)) for c in itertools.permutations(range(3), people)]
        else:
            maps = [tuple((i, j) for j, i in enumerate(c)) for c in itertools.permutations(range(people), 3)]
        each = np.array([sum(L[i, j] for i, j in pairs) for pairs in maps])
        assert logs[p, 0] == pytest.approx(np.logaddexp.reduce(each) + L[-1, -1], rel=1e-12)
        share = np.exp(each - np.logaddexp.reduce(each))
        for i, j in itertools.product(range(people), range(3)):
            expected = sum(s for s, pairs in zip(share, maps, strict=True) if (i, j) in pairs)
            assert found[p, 3 * i + j] == pytest.approx(expected, abs=1e-9)
        assert found[p, -1] == 1.0


def test_sums_of_people_are_those_of_all_mappings_with_the_others_averaged():
    """All mappings of the person in the particle and of the others' mean weights, up to a factor of the others."""
    density, pairs, exist, detect = candidates(5)
    W = np.array([weights_of(density, pairs, exist, detect, 0.01, p) for p in range(20)])
    mean, miss = W.mean(axis=0), 1 - (exist * detect).mean(axis=0)
    free = sensor.free_detections(mean, miss)
    (logs, measured), found = np.empty((2, 20, 6)), np.empty(density.shape)
    sensor_kernels.person_sums(density, pairs, exist, detect, 0.01, free, logs, found, measured)
    for k in range(6):
        rest = np.delete(np.arange(6), k)
        others = reference_sum(mean[rest], miss[rest])[0]
        for p in range(20):
            mixed, missed = mean.copy(), miss.copy()
            mixed[k], missed[k] = W[p, k], 1 - exist[p, k] * detect[k]
            log, marginals = reference_sum(mixed, missed)
            assert logs[p, k] == pytest.approx(log - others, abs=1e-9)
            own = pairs[:, 0] == k
            np.testing.assert_allclose(found[p, own], marginals[k, pairs[own, 1]], rtol=1e-8, atol=1e-15)


def reference_sum(W, miss):
    found = np.empty(W.shape)
    return exact_sum(W, miss, np.ones(W.shape[1]), found), found


def test_a_miss_leaves_weights_if_everybody_who_exists_is_detected():
    particles = three()
    particles.exist[:] = 1.0
    config = ParticleConfig(detect_prob=1.0)
    for _ in range(2):
        sensor.weigh(particles, particles.pos[0, :2], *sight([1.0] * 3), 0.08, config)
        np.testing.assert_allclose(particles.weights.sum(axis=0), 1.0, rtol=1e-9)
    np.testing.assert_allclose(particles.existence, 1.0, rtol=1e-6)  # who certainly exists is hidden


def test_a_detection_that_is_certainly_nobodys_starts_a_person_at_the_largest_doubt(monkeypatch):
    monkeypatch.setattr("tracking.papers.relational.tracker.BIRTH_DOUBT", 1.0)
    tracker = Particle(ParticleConfig())
    assert len(stepped(tracker, [[(0, 0)]] * 5)[-1].id) == 1


def test_probabilities_of_pairs_are_those_of_the_reported_people():
    """Two people side by side, and a third far away; the matrix is symmetric with ones on the diagonal."""
    tracker = Relational()
    tracker.reset(Context(10.0, float("nan")), 0)
    assert tracker.walking_together()[1].shape == (0, 0)
    tracks = stepped(tracker, [[(0.12 * k, 0.0), (0.12 * k, 0.6), (0.12 * k, 9.0)] for k in range(40)])[-1]
    id, together = tracker.walking_together()
    assert id.tolist() == tracks.id.tolist()
    assert np.array_equal(together, together.T)
    order = np.argsort(tracks.pos[:, 1])
    together = together[np.ix_(order, order)]
    assert together[0, 1] > 0.5
    assert together[0, 2] == together[1, 2] == 0.0
    assert together.diagonal().tolist() == [1, 1, 1]


def test_reached_are_detections_near_the_box_of_the_particles():
    rng = np.random.default_rng(3)
    pos, points = rng.uniform(0, 9, (5, 12, 1)) + rng.normal(0, 0.3, (5, 12, 2)), rng.uniform(0, 9, (15, 2))
    low, high = pos.min(axis=0)[:, None], pos.max(axis=0)[:, None]
    apart = np.maximum(np.maximum(low - points, points - high), 0.0)
    expected = np.argwhere(np.square(apart).sum(axis=2) <= 1.5)
    assert len(expected)
    assert np.array_equal(particle_set_kernels.reached(pos, points, 1.5), expected)
