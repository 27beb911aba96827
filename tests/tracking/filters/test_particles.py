"""Resampling: filterpy's schemes with given uniforms."""

from __future__ import annotations

import filterpy.monte_carlo
import numpy as np
import pytest
from filterpy.monte_carlo import resampling

from tracking.filters.particles import effective_number, residual_resample, systematic_resample_rows


def random_weights(seed, count=40):
    weights = np.random.default_rng(seed).exponential(size=count) ** 3
    return weights / weights.sum()


@pytest.mark.parametrize("seed", range(20))
def test_systematic_is_filterpy(seed, monkeypatch):
    weights, u = random_weights(seed), np.random.default_rng(seed).random()
    monkeypatch.setattr(resampling, "random", lambda *_: u)
    (chosen,) = systematic_resample_rows(weights[None], np.array([u]))
    assert chosen.tolist() == filterpy.monte_carlo.systematic_resample(weights).tolist()


@pytest.mark.parametrize("seed", range(20))
def test_residual_takes_filterpys_copies_and_draws_the_rest_by_its_multinomial_scheme(seed, monkeypatch):
    """filterpy's own remainders are negative, so the rest is compared with its multinomial scheme."""
    weights, u = random_weights(seed), np.random.default_rng(seed).random(40)
    copies = np.floor(40 * weights).astype(int)
    rest = 40 * weights - copies
    missing = 40 - copies.sum()
    monkeypatch.setattr(resampling, "random", lambda *_: u[:missing])
    drawn = filterpy.monte_carlo.multinomial_resample(rest / rest.sum())
    certain = np.repeat(np.arange(40), copies)
    assert residual_resample(weights, u).tolist() == sorted([*certain, *drawn])


def test_equal_weights_keep_every_particle():
    weights = np.full(7, 1 / 7)
    assert residual_resample(weights, np.zeros(7)).tolist() == list(range(7))
    assert systematic_resample_rows(weights[None], np.array([0.5])).tolist() == [list(range(7))]


@pytest.mark.parametrize("u", [0.0, np.nextafter(1, 0)])
def test_particles_without_weight_are_never_taken(u):
    weights = np.array([0.0, 0.45, 0.0, 0.55, 0.0])
    assert set(residual_resample(weights, np.full(5, u)).tolist()) <= {1, 3}
    assert set(systematic_resample_rows(weights[None], np.array([u]))[0].tolist()) <= {1, 3}


def test_effective_number():
    assert effective_number(np.full(8, 1 / 8)) == pytest.approx(8)
    assert effective_number(np.array([0.0, 1.0])) == 1
