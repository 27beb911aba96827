"""What run.json tells of the particles, and the probabilities of pairs that the tracker returns."""

from __future__ import annotations

import numpy as np
import pytest

from sim.types import Context, Detections, Frame
from tests.reference_relational import drawn
from tracking.filters.particles import ParticleHealth
from tracking.papers.relational.particle_set import ParticleSet
from tracking.papers.relational.tracker import Relational


def two(count):
    """Two people far from each other."""
    made = ParticleSet.empty(count)
    for x in (0.0, 50.0):
        made.add(np.full((count, 1, 2), x), np.zeros((count, 1, 2)), 1.0)
    return made


def test_shares_of_effective_particles_and_of_ancestors():
    """Person 1 has a tenth of the particles left, person 2 all of them."""
    particles, found = two(100), ParticleHealth(2.0)
    particles.weights[:, 0] = np.repeat([0.1, 0.0], [10, 90])
    assert particles.effective().min() / 100 == pytest.approx(0.1)
    particles.resample(0.5, 0.0, drawn(particles, np.random.default_rng(0)))
    found.resampled(particles.ancestor)
    assert found.summary() == {"distinct_ancestors": None}
    found.resampled(particles.ancestor)
    assert found.summary()["distinct_ancestors"] == pytest.approx((0.1 + 1.0) / 2)
    assert np.array_equal(particles.ancestor, np.arange(100)[:, None] * [1, 1])


def test_ancestors_of_people_who_come_and_go():
    particles = two(50)
    particles.weights[:, 1] = np.arange(50) == 7
    particles.resample(0.5, 0.0, drawn(particles, np.random.default_rng(0)))
    particles.keep(np.array([False, True]))
    particles.add(np.zeros((50, 1, 2)), np.zeros((50, 1, 2)), 1.0)
    assert (particles.ancestor[:, 0] == 7).all()
    assert particles.ancestor[:, 1].tolist() == list(range(50))


def test_nobody_has_no_diversity():
    found = ParticleHealth(1.0)
    found.resampled(ParticleSet.empty(10).ancestor)
    assert set(found.summary().values()) == {None}


def test_probabilities_of_pairs_are_those_of_the_reported_people():
    """Two people side by side, and a third far away; the matrix is symmetric with ones on the diagonal."""
    tracker = Relational()
    tracker.reset(Context(10.0, float("nan")), 0)
    assert tracker.walking_together()[1].shape == (0, 0)
    for k in range(40):
        pos = np.array([[0.12 * k, 0.0], [0.12 * k, 0.6], [0.12 * k, 9.0]])
        tracks = tracker.step(Frame(k + 1, k / 10), Detections(k + 1, k / 10, "ground", pos, score=np.ones(3)))
    id, together = tracker.walking_together()
    assert id.tolist() == tracks.id.tolist()
    assert np.array_equal(together, together.T)
    order = np.argsort(tracks.pos[:, 1])
    together = together[np.ix_(order, order)]
    assert together[0, 1] > 0.5
    assert together[0, 2] == together[1, 2] == 0.0
    assert together.diagonal().tolist() == [1, 1, 1]
