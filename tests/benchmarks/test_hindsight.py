"""The benchmark of hindsight: constants of each part are chosen by its windows, and one told in all parts is itself."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.adaptation import Bench, Scene, scenes
from benchmarks.hindsight import best_of_parts, told
from tracking.tuning.adaptive import EVERY, Played


def test_the_best_of_each_part() -> None:
    (scene, *_) = scenes("drift", range(20_000, 20_001))
    first, second = scene.changes
    windows = np.arange(40) * EVERY + EVERY / 2
    part = (windows >= first).astype(int) + (windows >= second)
    empty = np.zeros((0, 0))
    scores = [np.where(part == k, 1.0, 0.2 * k) for k in (2, 0, 1)]
    assert best_of_parts(scene, [Played(empty, empty, one, 0.0) for one in scores]).tolist() == [1, 2, 0]


def test_one_constant_in_all_parts_is_that_constant() -> None:
    bench = Bench("blob")
    scene = Scene(scenes("quick", range(1))[0].source, (2.0, 4.0))
    residuals = np.random.default_rng(0).uniform(-0.3, 0.3, (2, len(bench.space)))
    one, other = (bench.play(scene, bench.still, each).objective for each in residuals)
    assert told(bench, scene, residuals[[0, 0, 0]]) == one
    assert told(bench, scene, residuals[[0, 1, 1]]) not in (one, other)
    assert one != pytest.approx(other)
