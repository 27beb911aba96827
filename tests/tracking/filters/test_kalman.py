"""Kalman filters beside filterpy, the Riccati solver and chi2; pairing beside all pairings."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import linear_sum_assignment
from scipy.special import chdtri

from tests.reference_tracking import best_pairing, filterpy_bank, riccati_innovation
from tracking.filters import assignment, kalman
from tracking.filters.kalman_kernels import distances


def make(r, n=5, d=4):
    dt = r.uniform(0.03, 0.5)
    sigma, noise = r.uniform(0.1, 5, d), r.uniform(0.01, 2, d)
    var, rate_var = r.uniform(0.1, 3, d), r.uniform(0.1, 3, d)
    place = r.normal(0, 10, (n, d))
    return dt, sigma, noise, var, rate_var, place


@pytest.mark.parametrize("seed", range(5))
def test_bank_equals_filterpy_over_random_misses(seed):
    r = np.random.default_rng(seed)
    dt, sigma, noise, var, rate_var, place = make(r)
    bank, q = kalman.born(place, var, rate_var), kalman.white_acceleration(dt, sigma)
    filters = filterpy_bank(place, var, rate_var, dt, sigma, noise)
    for _ in range(60):
        kalman.predict(bank, dt, q)
        rows = np.flatnonzero(r.random(len(place)) < 0.6)
        z = r.normal(0, 10, (len(rows), 4))
        own_noise = noise * r.uniform(0.5, 2, (len(rows), 1))
        s = bank[kalman.VAR, rows] + own_noise
        d2 = distances(bank[kalman.PLACE, rows], s, z, np.ones(len(rows)))[0].diagonal()
        terms = kalman.update(bank, rows, z, own_noise)
        for f in filters:
            f.predict()
        for k, row in enumerate(rows):
            filters[row].update(z[k][:, None], R=np.diag(own_noise[k]))
            assert d2[k] == pytest.approx(filters[row].mahalanobis ** 2, rel=1e-9)
            assert terms[k].sum() == pytest.approx(d2[k], rel=1e-12)
        x = np.array([f.x[:, 0] for f in filters])
        assert np.allclose(bank[kalman.PLACE], x[:, ::2], rtol=1e-9, atol=1e-9)
        assert np.allclose(bank[kalman.RATE], x[:, 1::2], rtol=1e-9, atol=1e-9)
        for i, f in enumerate(filters):
            blocks = np.array([f.P[2 * d : 2 * d + 2, 2 * d : 2 * d + 2] for d in range(4)])
            expected = blocks[:, [0, 0, 1], [0, 1, 1]].T
            assert np.allclose(bank[kalman.VAR :, i], expected, rtol=1e-9, atol=1e-9)


def test_fading_rates_is_the_transition_of_a_decaying_rate():
    r = np.random.default_rng(0)
    dt, sigma, noise, var, rate_var, place = make(r)
    bank = kalman.born(place, var, rate_var)
    kalman.predict(bank, dt, kalman.white_acceleration(dt, sigma))
    kalman.update(bank, np.arange(len(place)), r.normal(0, 10, place.shape), noise)
    x, rate, *p = bank.copy()
    bank *= kalman.fading(np.full(4, 0.6))
    fade = np.diag([1.0, 0.6])
    expected = np.einsum("ij,jkab,kl->ilab", fade, np.array([[p[0], p[1]], [p[1], p[2]]]), fade)
    assert np.allclose(bank, [x, 0.6 * rate, expected[0, 0], expected[0, 1], expected[1, 1]], rtol=1e-12)


@pytest.mark.parametrize("index", [0.01, 0.1, 1.0, 5.0])
def test_asymptote_is_the_riccati_solution_and_the_limit_of_updates(index):
    dt, noise = 0.2, 0.7
    sigma = index * np.sqrt(noise) / dt**2
    closed = float(kalman.asymptote(dt, sigma, noise))
    assert closed == pytest.approx(riccati_innovation(dt, sigma, noise), rel=1e-9)
    bank, q = kalman.born(np.zeros((1, 1)), noise, 3.0), kalman.white_acceleration(dt, np.array([sigma]))
    for _ in range(500):
        kalman.predict(bank, dt, q)
        s = bank[kalman.VAR, 0, 0] + noise
        kalman.update(bank, np.array([0]), np.zeros((1, 1)), np.array([noise]))
    assert s == pytest.approx(closed, rel=1e-9)


@pytest.mark.parametrize("p", [0.9, 0.99, 0.999])
def test_gate_holds_its_share(p):
    r = np.random.default_rng(1)
    bank = kalman.born(r.normal(0, 5, (1, 4)), r.uniform(0.1, 2, 4), 1.0)
    noise, n = r.uniform(0.1, 2, 4), 100_000
    z = bank[kalman.PLACE] + r.normal(size=(n, 4)) * np.sqrt(bank[kalman.VAR] + noise)
    d2, log_det = distances(bank[kalman.PLACE], bank[kalman.VAR] + noise, z, np.ones(1))
    share = np.mean(d2 <= chdtri(4, 1 - p))
    assert log_det == pytest.approx(np.linalg.slogdet(2 * np.pi * np.diag(bank[kalman.VAR, 0] + noise))[1])
    assert abs(share - p) < 3 * np.sqrt(p * (1 - p) / n)


@pytest.mark.parametrize("flip", [0.0, np.pi])
def test_angle_follows_an_ellipse_round(flip):
    sigma, noise = np.radians(10.0), np.radians(2.0) ** 2
    angle, plain = np.array([[0.0], [noise]]), np.array([[0.0], [noise]])
    one = np.array([0])
    for k in range(1, 55):
        true = np.radians(10.0) * k
        for state, z in ((plain, true % np.pi), (angle, true % np.pi + flip)):
            state[1] += sigma**2
            innovation = kalman.angle_innovation(np.array([z]), state[0])
            assert abs(innovation[0]) < np.radians(20)
            kalman.angle_update(state, one, np.array([z]), np.array([noise]))
        assert abs(kalman.angle_innovation(angle[0], np.array([true]))[0]) < np.radians(2)
    assert np.allclose(angle, plain, rtol=0, atol=1e-12)


def test_nearest_takes_each_measurement_to_its_deepest_gate():
    rows, columns = np.array([0, 0, 1, 1, 1]), np.array([0, 1, 0, 1, 3])
    best = assignment.cheapest(columns, np.array([1.0, 4.0, 2.0, 3.0, 0.5]), rows)
    assert rows[best].tolist() == [0, 1, 1]
    assert columns[best].tolist() == [0, 1, 3]


def test_of_equal_costs_the_first_wins():
    of, ties = np.array([3, 3, 3, 7]), np.array([2, 0, 1, 5])
    assert assignment.cheapest(of, np.ones(4), ties).tolist() == [1, 3]


@pytest.mark.parametrize("seed", range(12))
def test_optimal_is_the_best_of_all_pairings(seed):
    r = np.random.default_rng(seed)
    cost = r.uniform(0, 14, (r.integers(1, 5), r.integers(1, 5)))
    cost[r.random(cost.shape) < 0.5] = np.inf
    rows, columns = assignment.optimal(cost, 10.0)
    assert len(set(rows)) == len(rows)
    assert len(set(columns)) == len(columns)
    assert (cost[rows, columns] < 10).all()
    total = cost[rows, columns].sum() + 10 * (len(cost) - len(rows))
    assert total == pytest.approx(best_pairing(np.minimum(cost, 1e6), 10.0))


@pytest.mark.parametrize("seed", range(5))
def test_pairs_that_nobody_contests_change_no_assignment(seed):
    """Beside the search over the whole table."""
    r = np.random.default_rng(seed)
    cost = np.where(r.random((40, 50)) < 0.03, r.uniform(-5, 0, (40, 50)), 0.0)
    rows, columns = cost.nonzero()
    best = assignment.one_to_one(rows, columns, cost[rows, columns])
    assert 10 < len(best) < len(rows)
    every = linear_sum_assignment(cost)
    assert set(zip(rows[best], columns[best], strict=True)) == {pair for pair in zip(*every, strict=True) if cost[pair]}


@pytest.mark.parametrize("shape", [(0, 3), (3, 0), (0, 0), (2, 2)])
def test_nothing_in_any_gate(shape):
    rows, columns = assignment.optimal(np.full(shape, np.inf), 5.0)
    assert len(rows) == len(columns) == len(assignment.cheapest(rows, np.zeros(0), columns)) == 0
