"""Episodes: the objective of `evaluate` to the last bit, whole or of a beginning, whatever is in the cache."""

from __future__ import annotations

import pytest

from scenarios.errors import InputError
from scenarios.loading.resolve import load
from sim.sequence import simulate
from tracking.environment.episodes import play, sources

SHORT = ["camera.fps=5", "duration=8"]


def test_no_labels_no_episode():
    sequence = simulate(load("cross", SHORT), 3, 0, ())
    bare = sources(type(sequence)(**{**sequence.__dict__, "load_truth": None, "has_detections": True}))[0]
    with pytest.raises(InputError, match="nothing to score by"):
        play("blob", bare)
