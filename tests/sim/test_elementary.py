"""Elementary functions: as accurate as the C library's, and the same bits inside and outside of kernels."""

from __future__ import annotations

import math
from statistics import NormalDist

import numpy as np
import pytest

from sim import elementary, elementary_kernels
from sim.rng import autoregression, poisson_quantiles

R = np.random.default_rng(1)
CASES = {
    "exp": (np.exp, R.uniform(-600, 600, 3000)),
    "log": (np.log, np.exp(R.uniform(-300, 300, 3000))),
    "sin": (np.sin, R.uniform(-30, 30, 3000)),
    "cos": (np.cos, R.uniform(-30, 30, 3000)),
}


@pytest.mark.parametrize("name", CASES)
def test_within_some_units_in_the_last_place(name: str) -> None:
    expected, x = CASES[name]
    error = np.abs(getattr(elementary, name)(x) - expected(x))
    assert (error <= 4 * np.spacing(np.maximum(np.abs(expected(x)), 0.1 if name in ("sin", "cos") else 0.0))).all()


def test_angles_of_vectors() -> None:
    y, x = R.normal(size=(2, 3000))
    np.testing.assert_allclose(elementary.atan2(y, x), np.arctan2(y, x), rtol=1e-15, atol=1e-15)
    axes = [(0.0, 1.0, 0.0), (1.0, 0.0, np.pi / 2), (0.0, -1.0, np.pi), (-1.0, 0.0, -np.pi / 2), (0.0, 0.0, 0.0)]
    assert [float(elementary.atan2(y, x)) for y, x, _ in axes] == [angle for *_, angle in axes]


def test_kernels_compute_the_same_bits() -> None:
    for name in ("exp", "sin", "cos"):
        x = CASES[name][1][:200]
        kernel = getattr(elementary_kernels, name)
        assert [kernel(v) for v in x] == getattr(elementary, name)(x).tolist()
    y, x = R.normal(size=(2, 200))
    assert [elementary_kernels.atan2(*v) for v in zip(y, x, strict=True)] == elementary.atan2(y, x).tolist()


def test_limits() -> None:
    assert elementary.exp(-2000.0) < 1e-300
    assert elementary.exp(0.0) == 1.0
    assert elementary.log(1.0) == 0.0
    assert np.isnan(elementary.sin(np.nan))
    assert elementary.power(np.array([0.0, 4.0, 0.0]), 0.5).tolist() == pytest.approx([0.0, 2.0, 0.0])
    assert elementary.power(np.array([0.0, 4.0]), 0.0).tolist() == [1.0, 1.0]


def test_normal_quantiles() -> None:
    u = np.concatenate([R.random(500), [2.0**-54, 1e-12, 1e-5, 0.5, 1 - 2.0**-53]])
    expected = [NormalDist().inv_cdf(v) for v in u]
    np.testing.assert_allclose(elementary.normal_quantile(u), expected, rtol=1e-13, atol=1e-15)


def test_matrices() -> None:
    a, b = R.normal(size=(7, 3, 3)), R.normal(size=(7, 3, 3))
    np.testing.assert_allclose(elementary.product(a, b), a @ b, atol=1e-14)
    np.testing.assert_allclose(elementary.turned(a[0], b[:, 0]), b[:, 0] @ a[0].T, atol=1e-14)
    np.testing.assert_allclose(
        elementary.product(elementary.inverse_3x3(a), a), np.tile(np.eye(3), (7, 1, 1)), atol=1e-10
    )
    np.testing.assert_allclose(elementary.length(a), np.linalg.norm(a, axis=-1), rtol=1e-15)


def test_poisson_quantiles_are_the_smallest_numbers_that_reach_the_probability() -> None:
    u = R.random(300)
    for mean in (0.0, 0.3, 5.0, 200.0):
        share = np.cumsum([math.exp(-mean + k * math.log(mean or 1) - math.lgamma(k + 1)) for k in range(600)])
        expected = np.searchsorted(share, u) if mean else np.zeros(300)
        np.testing.assert_array_equal(poisson_quantiles(mean, u), expected)
    assert poisson_quantiles(1.0, np.array([1.0]))[0] <= 33


def test_autoregression_is_the_recursion_and_ignores_later_rows() -> None:
    e = R.normal(size=(100, 2))
    keep = np.array([0.9, 0.0])
    x = e.copy()
    for k in range(1, 100):
        x[k] = keep * x[k - 1] + np.sqrt(1 - keep**2) * e[k]
    np.testing.assert_allclose(autoregression(e, keep), x, atol=1e-13)
    np.testing.assert_array_equal(autoregression(e[:40], keep), autoregression(e, keep)[:40])
