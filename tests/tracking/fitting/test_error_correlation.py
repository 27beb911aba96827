from __future__ import annotations

import numpy as np
import pytest
from scipy.special import ndtr
from scipy.stats import multivariate_normal

from scenarios.schema.sensor import Memory
from sim.detector.draws import correlated_normals
from sim.types import Truth
from tracking.fitting.error_correlation import (
    Correlations,
    bivariate_normal_cdf,
    correlations,
    fit_memory,
    miss_correlations,
)


def people(count: int = 30, frames: int = 300) -> Truth:
    frame = np.repeat(np.arange(1, frames + 1), count)
    id = np.tile(np.arange(1, count + 1), frames)
    n = len(frame)
    return Truth("x", 10.0, frames, 40.0, frame, id, np.full(n, -1), None, None, np.ones((n, 4)), np.ones(n))


def drawn(truth: Truth, parts: list[Memory]) -> np.ndarray:
    z = np.empty((len(truth.id), 1))
    for one in np.unique(truth.id):
        fresh = np.random.default_rng(int(one)).standard_normal((truth.length, 1))
        z[truth.id == one] = correlated_normals(fresh, parts, 1, truth.fps, 5, int(one), 0)
    return z


@pytest.mark.parametrize("rho", [-0.4, 0.0, 0.5, 0.99])
def test_two_normals_together(rho: float) -> None:
    a, b = np.array([-1.0, 0.3, 2.0, 0.0]), np.array([-0.5, 0.3, -1.0, 0.0])
    law = multivariate_normal([0.0, 0.0], [[1.0, rho], [rho, 1.0]])
    assert bivariate_normal_cdf(a, b, rho) == pytest.approx(law.cdf(np.stack([a, b], axis=1)), abs=2e-4)


PARTS = [Memory(share=0.4, time=0.3), Memory(share=0.4, time=4.0)]


def wanted(lag: np.ndarray) -> np.ndarray:
    return sum(m.share * np.exp(-lag / m.time) for m in PARTS)  # type: ignore[return-value]


def test_correlations_of_errors_and_of_what_is_behind_misses() -> None:
    truth = people(240)
    z = drawn(truth, PARTS)
    seen = correlations(truth, z, np.ones(len(z), bool))
    assert seen.lag[0] == pytest.approx(0.1)
    assert seen.rho == pytest.approx(wanted(seen.lag), abs=0.08)
    p_miss = np.where(truth.id % 2 == 0, 0.15, 0.4)  # the chance differs from person to person, the memory does not
    behind = miss_correlations(truth, ndtr(z[:, 0]) < p_miss, p_miss)
    assert behind.rho == pytest.approx(wanted(behind.lag), abs=0.12)


def test_only_rows_that_are_meant_count() -> None:
    truth = people(4, 60)
    keep = truth.frame % 2 == 0
    assert (np.round(correlations(truth, np.ones((len(keep), 1)), keep).lag * 10) % 2 == 0).all()


def test_exponentials_come_back() -> None:
    lag = np.geomspace(0.1, 10.0, 14)
    found = fit_memory([Correlations(lag, wanted(lag), np.full(14, 1000.0))])
    at = np.array([0.1, 0.5, 2.0, 8.0])
    assert sum(m.share * np.exp(-at / m.time) for m in found) == pytest.approx(wanted(at), abs=0.01)
    assert sum(m.share for m in found) <= 1.0


def test_shares_stay_below_one_and_noise_has_no_memory() -> None:
    lag = np.geomspace(0.1, 10.0, 14)
    found = fit_memory([Correlations(lag, np.full(14, 1.2), np.full(14, 1000.0))])
    assert sum(m.share for m in found) == pytest.approx(1.0, abs=1e-6)
    noise = np.random.default_rng(0).normal(0, 0.01, 14)
    assert sum(m.share for m in fit_memory([Correlations(lag, noise, np.full(14, 1000.0))])) < 0.05
    assert fit_memory([]) == ()
    assert fit_memory([Correlations(np.zeros(0), np.zeros(0), np.zeros(0))]) == ()


def test_a_short_recording_says_nothing_of_long_times() -> None:
    lag = np.array([0.1, 0.2, 0.4])
    assert all(m.time <= 0.8 for m in fit_memory([Correlations(lag, np.full(3, 0.9), np.full(3, 100.0))]))
