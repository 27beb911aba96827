"""The fit of the event classifier: known weights are found again, rows are right, the command writes a file."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from benchmarks.relational.observed import LABELS, fit_observed
from scenarios.errors import InputError
from scenarios.loading.resolve import load
from sim.sequence import simulate
from tracking.fitting import joint_events
from tracking.fitting.relational import fit_relational
from tracking.papers.relational.config import RelationalConfig


def state(pos):
    pos = np.asarray(pos, float)
    return np.concatenate([pos, np.zeros_like(pos)], axis=1)


def test_rows_say_what_happened_to_each_group():
    pos = state([[0, 0], [0.7, 0], [2, 0], [9, 0], [9.7, 0]])

    def found(before, after):
        return joint_events.partition_rows(pos, pos, np.array(before), np.array(after)).event.tolist()

    assert found([1, 1, -1, 2, 2], [1, 1, -1, 2, 2]) == [joint_events.NONE, joint_events.NONE, joint_events.NONE]
    assert found([1, 1, -1, 2, 2], [1, 1, 1, 2, 2]) == [joint_events.MERGE, joint_events.MERGE, joint_events.NONE]
    assert found([1, 1, -1, 2, 2], [1, 1, -1, -1, -1]) == [joint_events.NONE, joint_events.NONE, joint_events.SPLIT]
    assert found([1, 1, -1, 2, 2], [1, -1, -1, 2, 2]) == [joint_events.SPLIT, joint_events.NONE, joint_events.NONE]
    rows = joint_events.partition_rows(pos, pos, np.array([1, 1, -1, 2, 2]), np.array([1, 1, -1, 2, 2]))
    assert rows.possible.tolist() == [[True, True, True], [True, False, True], [True, True, True]]
    assert joint_events.partition_rows(pos[:1], pos[:1], np.array([-1]), np.array([-1])).possible.tolist() == [
        [False, False, True]
    ]


def test_the_fit_finds_its_weights():
    rng = np.random.default_rng(0)
    features = rng.normal(1, 0.7, (150_000, 6))
    true = {"merge_weights": [-1, 0.5, 0, -1, 1, 0, 0.5], "split_weights": [0.5, 0, -1, 0, 0.5, 1, -1]}
    possible = np.ones((150_000, 3), bool)
    possible[:50_000, joint_events.SPLIT] = False
    rows = joint_events.EventRows(features, np.zeros(150_000, np.int64), possible)
    p = np.exp(joint_events.log_probabilities(rows, true))
    event = (rng.random((150_000, 1)) > np.cumsum(p, axis=1)).sum(axis=1)
    fitted = joint_events.fit_events(dataclasses.replace(rows, event=event))
    assert list(fitted) == list(true)
    np.testing.assert_allclose(list(fitted.values()), list(true.values()), atol=0.08)
    scores = joint_events.event_scores(dataclasses.replace(rows, event=event), fitted)
    assert scores["log_loss"] < scores["prior_log_loss"]


def test_without_events_nothing_is_fitted():
    with pytest.raises(InputError, match="0 merges, 0 splits"):
        joint_events.fit_events(joint_events.EventRows.joined([]))


ENDS = RelationalConfig().speed_ends


def test_a_table_learned_from_observations_has_their_errors():
    """Errors of variance r^2 add 6 (r / dt)^2 to the variance of the velocity's change in a frame."""
    scene = load("party", ["camera.fps=10", *LABELS, "sensor.points=own", "sensor.noise_m=0.3"])
    clean = load("party", ["camera.fps=10", *LABELS, "sensor.points=own", "sensor.noise_m=0.03"])
    rough, exact = (fit_observed([simulate(s, 30_000, 0, ())], (1e6, 2e6, 3e6, 4e6)) for s in (scene, clean))
    assert rough["point_noise"] == pytest.approx(0.3, rel=0.05)
    assert exact["point_noise"] == pytest.approx(0.03, rel=0.05)
    assert rough["diffusion"][0] * 0.1**0.5 == pytest.approx(6**0.5 * 0.3 / 0.1, rel=0.05)


def test_without_scenes_nothing_is_fitted():
    with pytest.raises(InputError, match="0 changes of velocity"):
        fit_relational([], ENDS)
