"""Episodes: the objective of `evaluate` to the last bit, whole or of a beginning, whatever is in the cache."""

from __future__ import annotations

import math

import pytest

import tracking
from scenarios.errors import InputError
from scenarios.loading.resolve import load
from sim.sequence import simulate
from tracking.environment.episodes import play, sources, streams_for
from tracking.running.tracker_registry import names

SHORT = ["camera.fps=5", "duration=8"]


@pytest.mark.parametrize("mode", ["file", "truth", "image"])
@pytest.mark.parametrize("name", names())
def test_the_objective_is_that_of_evaluate(name, mode):
    source = sources("cross", [3], ["camera.fps=5", "duration=3", "camera.image=[160,120]"])[0]
    sequence = source.open(streams_for(name, mode))
    expected = tracking.evaluate(sequence.truth, tracking.track(name, sequence, detections=mode))
    found = play(name, source, detections=mode, every_score=True)
    assert found.objective == expected["objective"]
    assert found.scores == {key: value for key, value in expected.items() if not math.isnan(value)}
    assert (found.name, found.seed, found.frames) == ("cross", 3, 15)


def test_no_labels_no_episode():
    sequence = simulate(load("cross", SHORT), 3, 0, ())
    bare = sources(type(sequence)(**{**sequence.__dict__, "load_truth": None, "has_detections": True}))[0]
    with pytest.raises(InputError, match="nothing to score by"):
        play("blob", bare)
