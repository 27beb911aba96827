"""One scene, played by trackers and the oracle: scores, failures with their tracebacks, one process per tracker."""

from __future__ import annotations

from pathlib import Path

import pytest

import tracking
from scenarios.errors import InputError
from tests.processes import FAKE
from tests.tuning_toys import TOY, write_scenes
from tracking.episodes.parallel_episodes import EpisodeTask
from tracking.episodes.sources import sources
from tracking.stress.scene_player import ORACLE, OracleTask, contender, play_scene, scene_player

RAISING = """
import os

class Raising:
    needs = ("points",)

    def reset(self, context, seed):
        pass

    def step(self, frame, detections):
        return self.guess()

    def guess(self):
        raise ValueError(f"process {os.getpid()}")
"""


def scene(folder: Path, seed: int = 1):
    return sources(write_scenes(folder)[0], (seed,), ("sensor.detect_prob=0.8",))[0]


def task(name: str, source, step_timeout: float | None = None) -> EpisodeTask:
    return EpisodeTask(contender(name, step_timeout), source, {}, "file", every_score=True)


def test_scores_are_those_of_compare(tmp_path: Path) -> None:
    """A tracker without parameters, one with, and the oracle."""
    source = scene(tmp_path)
    own, toy, best = play_scene((task(FAKE, source), task(TOY, source), OracleTask(contender(FAKE), source, "file")))
    sequence = source.open(())
    runs = {n: [tracking.track(n, sequence, detections="file", seed=source.seed)] for n in (FAKE, TOY)}
    compared = tracking.compare([sequence], runs)
    for outcome, expected in ((own, compared.scores[FAKE]), (toy, compared.scores[TOY])):
        assert outcome.scores["HOTA"] == expected[0]["HOTA"]
    (oracle,) = compared.oracles.values()
    assert best.scores["HOTA"] == oracle[0]["HOTA"]
    assert best.scores["group_F1"] == oracle[0]["group_F1"]
    assert 0.5 < best.scores["HOTA"] < 1


@pytest.mark.parametrize("step_timeout", [None, pytest.param(60.0, id="in a process")])
def test_a_failure_has_its_traceback_and_a_tracker_one_process(step_timeout, tmp_path: Path) -> None:
    (tmp_path / "raising.py").write_text(RAISING)
    name = f"{tmp_path / 'raising.py'}:Raising"
    scenes = [(task(name, scene(tmp_path, seed), step_timeout),) for seed in (1, 2)]
    with scene_player() as play:
        (first,), (second,) = play(scenes)
    assert first.scores == {}
    assert "ValueError: process" in first.failed
    assert "\n" not in first.failed
    *_, place, code, error = first.traceback.splitlines()
    assert "raising.py" in place
    assert "in guess" in place
    assert code.strip().startswith("raise ValueError") or set(code.strip()) <= {"^", "~"}
    assert error.startswith("ValueError: process ")
    assert second.traceback.splitlines()[-1] == error


def test_a_scene_that_cannot_be_made_is_nobodys_failure(tmp_path: Path) -> None:
    text = Path(write_scenes(tmp_path)[0]).read_text()
    order = '{ id = "m", type = "merge", groups = ["a", "b"], into = "ab", goal = [8, 5], when = { time = 1 } }'
    (tmp_path / "late.toml").write_text(text.replace("group = [", f"event = [{order}]\ngroup = ["))
    (source,) = sources(tmp_path / "late.toml", (1,))
    for outcome in play_scene((task(FAKE, source), OracleTask(contender(FAKE), source, "file"))):
        assert "merge" in outcome.left_out
        assert not outcome.failed


def test_the_oracle_is_no_tracker() -> None:
    for name in (ORACLE, "grouping"):
        with pytest.raises(InputError, match="expected one of blob"):
            contender(name)
