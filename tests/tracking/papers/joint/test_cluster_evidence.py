"""The Dirichlet process mixture as cluster validity: closed forms against products, integrals and enumeration."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.stats import chi2

from tests.reference_joint import all_partitions, label_of, log_component, log_evidence
from tracking.filters.person_streams import PersonStreams
from tracking.papers.joint.cluster_evidence_kernels import (
    SUMS,
    add_person,
    log_conditionals,
    log_evidences,
    log_marginal,
    log_predictive,
)
from tracking.papers.joint.config import JointConfig
from tracking.papers.joint.distributions import FrameModel

C, NU, S, S_V = 0.02, 5.0, 0.5, 0.4
MIXTURE = np.array([np.log(C), NU, S, S_V])


def states(count, seed=0, spread=1.0):
    return np.random.default_rng(seed).normal(0, spread, (count, 4)) + np.array([40, -7, 1, 0])


def sums_of(state):
    sums = np.zeros(SUMS)
    for person in state:
        add_person(sums, person, 1.0)
    return sums


def evidences(state, parts):
    label = np.array([[label_of(p) for p in parts]])
    out = np.empty(label.shape[:2])
    log_evidences(np.asarray(state, float)[None], label, MIXTURE, out)
    return out[0]


@pytest.mark.parametrize("count", [2, 3, 7])
def test_the_marginal_likelihood_is_the_product_of_predictives(count):
    state = states(count)
    product = sum(log_predictive(sums_of(state[:k]), state[k], MIXTURE) for k in range(1, count))
    assert log_marginal(sums_of(state), MIXTURE) == pytest.approx(product, abs=1e-9)
    assert product == pytest.approx(log_component(state, NU, S, S_V), abs=1e-9)


def test_the_marginal_likelihood_is_the_integral_over_means_and_variance():
    """Of places: the integral over the variance; that over the mean is normal, 2 pi variance / n."""
    state = states(4, 1)
    n, scatter = len(state), ((state[:, :2] - state[:, :2].mean(axis=0)) ** 2).sum()
    prior = chi2(NU)

    def at(x):  # variance = NU S^2 / x with x chi-squared
        variance = NU * S**2 / x
        return prior.pdf(x) * (2 * np.pi * variance) ** (1 - n) / n * np.exp(-scatter / (2 * variance))

    velocities = ((state[:, 2:] - state[:, 2:].mean(axis=0)) ** 2).sum()
    expected = np.log(quad(at, 0, np.inf, epsabs=0)[0])
    expected += (1 - n) * np.log(2 * np.pi * S_V**2) - np.log(n) - velocities / (2 * S_V**2)
    assert log_marginal(sums_of(state), MIXTURE) == pytest.approx(expected, abs=1e-6)


def test_the_predictive_is_a_density():
    """It integrates to 1 over places and velocities: over both radii, as it is round."""
    sums = sums_of(states(3, 2))
    mean = sums[1:5] / 3

    def density(place, velocity):
        return np.exp(log_predictive(sums, mean + np.array([place, 0, 0, velocity]), MIXTURE))

    at_rest = quad(lambda r: 2 * np.pi * r * density(r, 0.0), 0, np.inf)[0]
    in_place = quad(lambda r: 2 * np.pi * r * density(0.0, r), 0, 20)[0]
    assert at_rest * in_place / density(0.0, 0.0) == pytest.approx(1, abs=1e-6)


def test_the_order_of_people_does_not_matter():
    state = states(6)
    order = np.random.default_rng(1).permutation(6)
    parts = [[0, 1, 4], [2, 5], [3]]
    where = np.argsort(order)
    moved = [sorted(where[part].tolist()) for part in parts]
    assert evidences(state[order], [moved])[0] == pytest.approx(evidences(state, [parts])[0], abs=1e-9)


def test_moving_and_turning_the_scene_changes_nothing():
    state, parts = states(5), list(all_partitions(5))
    turn = np.array([[np.cos(1.0), -np.sin(1.0)], [np.sin(1.0), np.cos(1.0)]])
    turned = state @ np.kron(np.eye(2), turn).T + [30, 80, 0, 0]
    np.testing.assert_allclose(evidences(turned, parts), evidences(state, parts), atol=1e-8)


def test_evidences_are_those_of_the_definition():
    state, parts = states(5), list(all_partitions(5))
    expected = [log_evidence(state, p, C, NU, S, S_V) for p in parts]
    np.testing.assert_allclose(evidences(state, parts), expected, atol=1e-9)


def test_conditionals_are_those_of_the_posterior_over_all_partitions():
    """p(z_k | z_others, X) = p(Z, X) over the sum of p over all partitions that differ in k alone."""
    state, parts = states(4, spread=0.6), list(all_partitions(4))
    log_p = dict(zip([tuple(label_of(p)) for p in parts], evidences(state, parts), strict=True))
    out = np.empty(4)
    for p in parts:
        log_conditionals(state, label_of(p), MIXTURE, out)
        for k in range(4):
            rest = {frozenset(part) - {k} for part in p} - {frozenset()}
            alike = [q for q in parts if {frozenset(part) - {k} for part in q} - {frozenset()} == rest]
            total = sum(np.exp(log_p[tuple(label_of(q))]) for q in alike)
            assert out[k] == pytest.approx(log_p[tuple(label_of(p))] - np.log(total), abs=1e-9)


def test_the_true_partition_of_two_pairs_is_the_most_probable_of_all_15():
    state = np.array([[0, 0, 1, 0], [0.7, 0, 1, 0], [10, 0, -1, 0], [10.7, 0, -1, 0]])
    parts = list(all_partitions(4))
    config = JointConfig()
    label, out = np.array([[label_of(p) for p in parts]]), np.empty((1, 15))
    log_evidences(state[None], label, config.mixture, out)
    posterior = np.exp(out[0] - out.max()) / np.exp(out[0] - out.max()).sum()
    best = int(posterior.argmax())
    assert sorted(map(sorted, parts[best])) == [[0, 1], [2, 3]]
    assert posterior[best] > 0.5
    assert np.sort(posterior)[-2] < 0.3


@pytest.mark.parametrize("dt", [0.1, 0.02])
def test_the_option_has_the_evidence_as_p_of_z_given_x(dt):
    """Eq. 4 with log p(Z, X), weighted per second, so that a second counts the same at any frame rate."""
    config = JointConfig(validity="bayesian", evidence_rate=3.0, belief_rate=0.0)
    model = FrameModel(
        config, dt, 0.1, np.full((5, 2), np.nan), np.zeros((5, 5)), PersonStreams(0), np.zeros(5, np.uint64)
    )
    state, parts = states(5), list(all_partitions(5))
    label, out = np.array([[label_of(p) for p in parts]]), np.empty((1, len(parts)))
    log_evidences(state[None], label, config.mixture, out)
    np.testing.assert_allclose(model.energy(state[None], label), 3.0 * dt * out)


def test_two_people_who_stand_are_together_near_and_apart_far():
    for distance, together in ((0.6, True), (4.0, False)):
        alone, pair = evidences([[0, 0, 0, 0], [distance, 0, 0, 0]], [[[0], [1]], [[0, 1]]])
        assert (pair > alone) == together
