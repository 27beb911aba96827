"""The fit of the event classifier: known weights are found again, rows are right, the command writes a file."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from scenarios.errors import InputError
from scenarios.loading.resolve import resolve
from sim.sequence import simulate
from tests.short_scene import SCENE
from tracking.app.cli import run
from tracking.fitting.joint_events import (
    MERGE,
    NONE,
    SPLIT,
    EventRows,
    event_rows,
    event_scores,
    fit_events,
    log_probabilities,
    partition_rows,
)
from tracking.papers.joint.config import FITTED, JointConfig


def state(pos):
    pos = np.asarray(pos, float)
    return np.concatenate([pos, np.zeros_like(pos)], axis=1)


def test_rows_say_what_happened_to_each_group():
    pos = state([[0, 0], [0.7, 0], [2, 0], [9, 0], [9.7, 0]])

    def found(before, after):
        return partition_rows(pos, pos, np.array(before), np.array(after)).event.tolist()

    assert found([1, 1, -1, 2, 2], [1, 1, -1, 2, 2]) == [NONE, NONE, NONE]
    assert found([1, 1, -1, 2, 2], [1, 1, 1, 2, 2]) == [MERGE, MERGE, NONE]
    assert found([1, 1, -1, 2, 2], [1, 1, -1, -1, -1]) == [NONE, NONE, SPLIT]
    assert found([1, 1, -1, 2, 2], [1, -1, -1, 2, 2]) == [SPLIT, NONE, NONE]
    rows = partition_rows(pos, pos, np.array([1, 1, -1, 2, 2]), np.array([1, 1, -1, 2, 2]))
    assert rows.possible.tolist() == [[True, True, True], [True, False, True], [True, True, True]]
    assert partition_rows(pos[:1], pos[:1], np.array([-1]), np.array([-1])).possible.tolist() == [[False, False, True]]


def test_the_fit_finds_its_weights():
    rng = np.random.default_rng(0)
    features = rng.normal(1, 0.7, (150_000, 6))
    true = {"merge_weights": [-1, 0.5, 0, -1, 1, 0, 0.5], "split_weights": [0.5, 0, -1, 0, 0.5, 1, -1]}
    possible = np.ones((150_000, 3), bool)
    possible[:50_000, SPLIT] = False
    rows = EventRows(features, np.zeros(150_000, np.int64), possible, 0.0)
    p = np.exp(log_probabilities(rows, true))
    event = (rng.random((150_000, 1)) > np.cumsum(p, axis=1)).sum(axis=1)
    fitted = fit_events(dataclasses.replace(rows, event=event))
    assert list(fitted) == list(true)
    np.testing.assert_allclose(list(fitted.values()), list(true.values()), atol=0.08)
    scores = event_scores(dataclasses.replace(rows, event=event), fitted)
    assert scores["log_loss"] < scores["prior_log_loss"]
    assert scores["merge_expected_over_true"] == pytest.approx(1, abs=0.01)


def test_without_events_nothing_is_fitted():
    with pytest.raises(InputError, match="0 merges, 0 splits"):
        fit_events(EventRows.joined([]))


@pytest.mark.slow
def test_the_classifier_beats_the_frequencies_on_unseen_scenes():
    """E8: log loss on seeds that nothing was fitted to, on true partitions and with wrong copies."""
    entries = [e for e in resolve("suite:friends-meet") if e.repeat == 2 and "queue" not in e.name]
    truths = [(simulate(e.scenario, 30_200, e.repeat, ()).truth, 30_200) for e in entries]
    true, both = (
        event_scores(EventRows.joined(event_rows(t, JointConfig().lag, s, wrong=wrong) for t, s in truths), FITTED)
        for wrong in (False, True)
    )
    assert true["merges"] > 10
    assert true["log_loss"] < 0.8 * true["prior_log_loss"]
    assert both["log_loss"] < both["prior_log_loss"]


def test_the_command_writes_weights(tmp_path, capsys):
    script = """
[[event]]
id = "m"
type = "merge"
groups = ["a", "b"]
into = "ab"
goal = [8, 6]
when = { time = 0.5 }

[[event]]
id = "p"
type = "split"
group = "ab"
when = { after = "m", delay = 3.0 }
parts = [{ id = "c", size = 2, goal = [3, 10] }, { id = "d", goal = [13, 10] }]
"""
    people = (
        '{ id = "a", size = 2, start = [5, 5], goal = [12, 4] }, { id = "b", size = 1, start = [9, 5], goal = [4, 6] }'
    )
    crowd = SCENE.replace("duration = 2.0", "duration = 16.0")
    scene, out = tmp_path / "scene.toml", tmp_path / "fitted.toml"
    scene.write_text(crowd[: crowd.index("\ngroup")] + f"\ngroup = [{people}]\n{script}")
    line = ["fit", "joint", str(scene), "--seeds", "30000:30014", "--check", "30020:30022"]
    assert run([*line, "--out", str(out)]) == 0
    fitted = JointConfig.from_toml(out)
    assert fitted.merge_weights != JointConfig().merge_weights
    assert out.read_text().startswith("# flockscope fit joint")
    assert "checked, seeds 30020:30022" in out.read_text()
    assert "--params" in capsys.readouterr().out
