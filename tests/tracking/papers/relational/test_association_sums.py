"""Sums over mappings (companion page E2, E3): against brute force, closed counts, and the Bethe value."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.optimize import linear_sum_assignment

from tests.reference_relational import sum_over_mappings
from tracking.papers.relational.association_sums_kernels import cheapest, exact_sum, propagated_sum, sparse_sum


def summed(kernel, W, miss, spare):
    found = np.full(W.shape, np.nan)
    return kernel(W, miss, spare, found), found


@pytest.mark.parametrize("seed", range(15))
def test_equals_brute_force(seed):
    """Also with zeros in the matrix, impossible misses and columns that must be used."""
    rng = np.random.default_rng(seed)
    n, m = rng.integers(1, 6, 2)
    W = rng.exponential(size=(n, m)) * (rng.random((n, m)) < 0.7) * 10.0 ** rng.integers(-3, 4)
    miss, spare = (rng.random(k) * (rng.random(k) < 0.8) for k in (n, m))
    true, shares = sum_over_mappings(W, miss, spare)
    for kernel in (exact_sum, sparse_sum):
        log_sum, found = summed(kernel, W, miss, spare)
        assert math.exp(log_sum) == pytest.approx(true, rel=1e-12)
        if true:
            np.testing.assert_allclose(found, shares, rtol=0, atol=1e-12)


def test_nobody_detected_ever():
    log_sum, found = summed(sparse_sum, np.zeros((3, 4)), np.ones(3), np.ones(4))
    assert log_sum == 0.0
    assert not found.any()


def test_tiny_and_huge_weights():
    """Rows are scaled: products far outside the range of a float are summed."""
    W = np.full((9, 9), 1e-200)
    log_sum, _ = summed(sparse_sum, W, np.zeros(9), np.ones(9))
    assert log_sum == pytest.approx(9 * math.log(1e-200) + math.lgamma(10), rel=1e-12)


def test_a_sum_of_which_a_part_underflows():
    """The only mapping has the weight 1e-263 after the first row is scaled, its parts are too small for a float."""
    W = np.array([[0.0, 1e-279], [1e-263, 1e-116]])
    log_sum, found = summed(exact_sum, W, np.zeros(2), np.ones(2))
    assert log_sum == pytest.approx(math.log(1e-279) + math.log(1e-263), rel=1e-12)
    assert np.isfinite(found).all()


def test_the_cheapest_mapping_has_reduced_costs_of_zero():
    for seed in range(50):
        rng = np.random.default_rng(seed)
        n = int(rng.integers(1, 7))
        m = n + int(rng.integers(0, 3))
        cost, u, v = rng.exponential(1000.0, (n, m)), np.empty(n), np.empty(m)
        cheapest(cost, u, v)
        rows, columns = linear_sum_assignment(cost)
        reduced = cost - u[:, None] - v
        assert reduced.min() > -1e-9
        np.testing.assert_allclose(reduced[rows, columns], 0.0, atol=1e-9)
        assert (v <= 0).all()
        assert not v[~np.isin(np.arange(m), columns)].any()


def test_bethe_value_is_a_lower_bound():
    """On 300 matrices; exact with one row or one column (E3)."""
    worst = 1.0
    for seed in range(300):
        rng = np.random.default_rng(seed)
        n, m = rng.integers(1, 6, 2)
        W, miss, spare = rng.exponential(size=(n, m)) * 10.0 ** rng.integers(-2, 3), rng.random(n) + 0.01, np.ones(m)
        true, _ = summed(exact_sum, W, miss, spare)
        bethe, _ = summed(propagated_sum, W, miss, spare)
        assert bethe <= true + 1e-9
        if min(n, m) == 1:
            assert bethe == pytest.approx(true, abs=1e-9)
        worst = min(worst, math.exp(bethe - true))
    assert 0.3 < worst < 0.9


def test_large_sums_are_propagated():
    rng = np.random.default_rng(2)
    W = rng.exponential(size=(14, 14))
    log_sum, found = summed(sparse_sum, W, np.full(14, 0.5), np.ones(14))
    assert log_sum == summed(propagated_sum, W, np.full(14, 0.5), np.ones(14))[0]
    assert (found.sum(0) < 1 + 1e-6).all()
