"""The search for the worst scenes: what it finds, that it finds several, and goes on where it was stopped."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

from scenarios.errors import InputError
from tests.tracking.stress.test_sweep import sweep_of
from tracking.episodes.parallel_episodes import EpisodeTask
from tracking.stress.axes import parse_axes
from tracking.stress.scene_player import Outcome, Tasks
from tracking.stress.sweep import Sweep
from tracking.stress.worst_scenes import NEAR, RANDOM, SearchedScene, search, worst

HOLES = {"cross": (0.5, 4.0), "pass-by": (0.9, 1.0)}  # by scenario, detection and clutter where the tracker is worst


def score(scenario) -> float:
    """0.9 far from the hole of a scenario, 0.2 in its middle."""
    if scenario.name not in HOLES:
        return 0.9
    at = np.array([scenario.sensor.detect_prob, scenario.sensor.clutter_rate])
    apart = np.abs((at - HOLES[scenario.name]) / [0.6, 6.0]).max()
    return float(0.9 - 0.7 * max(0.0, 1 - apart / 0.4))


def sweep(tmp_path: Path, seen: list[EpisodeTask], **changes) -> Sweep:
    given = {
        "scenarios": ("crossing",), "axes": parse_axes(["detection", "clutter"]), "seeds": tuple(range(20)), "start": 2,
        "share": 0.8, "settings": ("duration=4",), **changes,
    }  # fmt: skip
    return sweep_of(lambda source: score(source.entry.scenario), tmp_path, seen, 0.9, **given)


def test_both_holes_are_found(tmp_path: Path) -> None:
    found = worst(search(sweep(tmp_path, []), 80))
    assert {failure.scenario for failure in found} == set(HOLES)
    for name, hole in HOLES.items():
        first = next(failure for failure in found if failure.scenario == name)
        assert first.shortfall > 0.35
        assert np.all(np.abs((np.array(first.scene.values) - hole) / [0.6, 6.0]) < 0.2)
    assert [failure.shortfall for failure in found] == sorted((f.shortfall for f in found), reverse=True)
    for k, one in enumerate(found):
        assert not any(one.nearness(other) for other in found[:k])


def test_after_random_scenes_some_of_four_are_sampled(tmp_path: Path) -> None:
    found = search(sweep(tmp_path, []), RANDOM + 32)
    assert not any(one.sampled for one in found[:RANDOM])
    assert 8 <= sum(one.sampled for one in found[RANDOM:]) <= 24


def test_failures_near_worse_ones_are_not_listed(tmp_path: Path) -> None:
    one = search(sweep(tmp_path, []), 1)[0]

    def failure(at: float, score: float, scenario: str = "cross") -> SearchedScene:
        return SearchedScene(0, one.scene, (at, 0.5), scenario, (), True, 0.9, score)

    found = [failure(0.5, 0.3), failure(0.5 + NEAR / 2, 0.2), failure(0.5 + 2 * NEAR, 0.6), failure(0.5, 0.8, "door")]
    assert worst(found) == [found[1], found[2], found[3]]
    assert worst(found, 2) == found[1:3]
    assert worst([failure(0.5, 0.9), failure(0.1, 1.0)]) == []


def test_a_search_that_was_killed_ends_with_the_same(tmp_path: Path) -> None:
    """Killed in a batch that TPE drew."""
    whole, first, rest = [], [], []
    complete = search(sweep(tmp_path / "whole", whole), 28)
    killed = sweep(tmp_path, first)
    play = killed.run_scenes

    def until_killed(scenes: Sequence[Tasks]):
        for outcomes in play(scenes):
            if len(first) == 20:
                raise KeyboardInterrupt
            yield outcomes

    killed.run_scenes = until_killed
    with pytest.raises(KeyboardInterrupt):
        search(killed, 28)
    resumed = sweep(tmp_path, rest)
    again = search(resumed, 28)
    seen = [[(f.scenario, f.scene.source.seed, f.place, f.score) for f in found] for found in (complete, again)]
    assert seen[0] == seen[1]
    assert len(rest) == len(whole) - 19
    assert len(resumed.rows()) == 2 * len(whole) == 2 * 28


def test_a_scene_without_a_score_is_no_failure(tmp_path: Path) -> None:
    made = sweep(tmp_path, [])
    made.run_scenes = lambda scenes: ([Outcome({}, left_out="no merge")] * len(tasks) for tasks in scenes)
    assert search(made, 10) == []


def test_no_axes(tmp_path: Path) -> None:
    found = search(sweep(tmp_path, [], axes=()), 20)
    assert {failure.scene.values for failure in found} == {()}
    assert {failure.scene.source.name for failure in found} == {"cross", "cross-same-speed", "pass-by", "side-by-side"}
    assert len({failure.scene.source.seed for failure in found}) > 5


def test_without_optuna(tmp_path: Path, monkeypatch) -> None:
    monkeypatch.setitem(sys.modules, "optuna", None)
    with pytest.raises(InputError, match=r'--search.*-e "\.\[tune\]"'):
        search(sweep(tmp_path, []), 8)
