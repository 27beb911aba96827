"""The fits of parameters that papers learn: known weights of events are found again, a speed table has the errors."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.joint import events
from benchmarks.relational.table import LABELS, observed, speed_table
from scenarios.loading.resolve import load
from sim.sequence import simulate


def state(pos):
    pos = np.asarray(pos, float)
    return np.concatenate([pos, np.zeros_like(pos)], axis=1)


def test_rows_say_what_happened_to_each_group():
    pos = state([[0, 0], [0.7, 0], [2, 0], [9, 0], [9.7, 0]])

    def found(before, after):
        return events.partition_rows(pos, pos, np.array(before), np.array(after))[1].tolist()

    assert found([1, 1, -1, 2, 2], [1, 1, -1, 2, 2]) == [events.NONE, events.NONE, events.NONE]
    assert found([1, 1, -1, 2, 2], [1, 1, 1, 2, 2]) == [events.MERGE, events.MERGE, events.NONE]
    assert found([1, 1, -1, 2, 2], [1, 1, -1, -1, -1]) == [events.NONE, events.NONE, events.SPLIT]
    assert found([1, 1, -1, 2, 2], [1, -1, -1, 2, 2]) == [events.SPLIT, events.NONE, events.NONE]
    possible = events.partition_rows(pos, pos, np.array([1, 1, -1, 2, 2]), np.array([1, 1, -1, 2, 2]))[2]
    assert possible.tolist() == [[True, True, True], [True, False, True], [True, True, True]]
    alone = np.array([-1])
    assert events.partition_rows(pos[:1], pos[:1], alone, alone)[2].tolist() == [[False, False, True]]


def test_the_fit_finds_its_weights():
    rng = np.random.default_rng(0)
    features = rng.normal(1, 0.7, (150_000, 6))
    true = np.array([[-1, 0.5, 0, -1, 1, 0, 0.5], [0.5, 0, -1, 0, 0.5, 1, -1]])
    possible = np.ones((150_000, 3), bool)
    possible[:50_000, events.SPLIT] = False
    scores = np.column_stack([features @ true[:, :6].T + true[:, 6], np.zeros(150_000)])
    p = np.exp(scores) * possible
    p /= p.sum(axis=1, keepdims=True)
    event = (rng.random((150_000, 1)) > np.cumsum(p, axis=1)).sum(axis=1)
    weights, loss = events.fitted(features, event, possible)
    np.testing.assert_allclose(weights, true, atol=0.08)
    assert loss == pytest.approx(-np.log(p[np.arange(len(p)), event]).mean(), abs=1e-3)


def test_a_table_learned_from_observations_has_their_errors():
    """Errors of variance r^2 add 6 (r / dt)^2 to the variance of the velocity's change in a frame."""
    for noise in (0.03, 0.3):
        scene = load("party", ["camera.fps=10", *LABELS, "sensor.points=own", f"sensor.noise_m={noise}"])
        changes, errors = observed(simulate(scene, 30_000, 0, ()))
        assert np.sqrt(np.mean(errors**2)) == pytest.approx(noise, rel=0.05)
    changes[:, 0] = 0.0  # one row of the table
    assert speed_table(changes)[1][0] * 0.1**0.5 == pytest.approx(6**0.5 * 0.3 / 0.1, rel=0.05)
