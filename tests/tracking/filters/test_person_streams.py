"""Random numbers of people: what they depend on and their distributions; resampling beside filterpy."""

from __future__ import annotations

import copy

import filterpy.monte_carlo
import numpy as np
import pytest
from filterpy.monte_carlo import resampling
from scipy import stats

from tracking.filters.person_streams import NOBODY, PersonStreams, birth_keys
from tracking.filters.resampling import residual_resample, systematic_resample_rows

PLACES = np.random.default_rng(0).uniform(-50, 50, (400, 2))


def test_the_numbers_of_a_person_do_not_depend_on_the_others():
    streams, keys = PersonStreams(7), birth_keys(PLACES, 3)
    for draw in (streams.normals, streams.uniforms):
        every, some = draw(1, keys, 30, 2), draw(1, keys[[200, 5]], 30, 2)
        assert np.array_equal(every[:, [200, 5]], some)
        assert np.array_equal(every[:10], draw(1, keys, 10, 2))


def test_numbers_differ_by_seed_role_frame_person_and_index():
    first, later, keys = PersonStreams(7), PersonStreams(7), birth_keys(PLACES[:9], 3)
    later.frame = 1
    drawn = [
        first.uniforms(1, keys, 20, 2), first.uniforms(2, keys, 20, 2), later.uniforms(1, keys, 20, 2),
        PersonStreams(8).uniforms(1, keys, 20, 2), PersonStreams(2**64 + 7).uniforms(1, keys, 20, 2),
        first.uniforms(1, birth_keys(PLACES[:9], 4), 20, 2), first.uniforms(1, NOBODY, 20, 2),
    ]  # fmt: skip
    numbers = np.concatenate([x.ravel() for x in drawn])
    assert len(np.unique(numbers)) == len(numbers)
    assert np.array_equal(copy.deepcopy(later).normals(0, keys, 5, 1), later.normals(0, keys, 5, 1))


@pytest.mark.parametrize("of", ["people", "rows", "frames", "roles"])
def test_the_distributions_and_no_correlation(of):
    """Along each way in which numbers are counted."""
    streams, keys, n = PersonStreams(2), birth_keys(PLACES, 1), 20_000
    if of in ("people", "rows"):
        z = streams.normals(0, keys, 100, 1)[..., 0]
        z = z if of == "people" else z.T
    else:
        drawn = []
        for k in range(400):
            streams.frame = k if of == "frames" else 0
            drawn.append(streams.normals(k if of == "roles" else 0, keys[:1], 100, 1).ravel())
        z = np.array(drawn).T
    z = z.ravel()[:n]
    assert stats.kstest(z, "norm").pvalue > 1e-3
    for lag in (1, 2, 3):
        assert abs(np.corrcoef(z[:-lag], z[lag:])[0, 1]) < 4 / n**0.5
        assert abs(np.corrcoef(z[:-lag] ** 2, z[lag:] ** 2)[0, 1]) < 4 / n**0.5


def random_weights(seed, count=40):
    weights = np.random.default_rng(seed).exponential(size=count) ** 3
    return weights / weights.sum()


@pytest.mark.parametrize("seed", range(6))
def test_systematic_is_filterpy(seed, monkeypatch):
    weights, u = random_weights(seed), np.random.default_rng(seed).random()
    monkeypatch.setattr(resampling, "random", lambda *_: u)
    (chosen,) = systematic_resample_rows(weights[None], np.array([u]))
    assert chosen.tolist() == filterpy.monte_carlo.systematic_resample(weights).tolist()


@pytest.mark.parametrize("seed", range(6))
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
