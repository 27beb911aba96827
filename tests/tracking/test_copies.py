"""Copies of a tracker or of the environment in the middle of a sequence go on as the original does."""

from __future__ import annotations

import copy
import pickle
from dataclasses import replace
from itertools import islice

import numpy as np
import pytest

from scenarios.loading.resolve import load
from sim.sequence import simulate
from tracking.environment.env import TuningEnv
from tracking.running.prepare import prepare
from tracking.running.tracker_registry import find, names

PICTURES = [
    "camera.fps=5", "duration=3", "camera.image=[240,180]", "camera.focal_px=200", "camera.height=6",
    "camera.crop=true", "camera.baseline=0.3",
]  # fmt: skip


def sequence(mode):
    if mode == "file":
        return simulate(load("mixed", ["camera.fps=5"]), 40_001, 0, ())
    return simulate(load("cross", PICTURES), 4, 0, ("left", "right", "background"))


def content(t):
    return [a.tobytes() for a in (t.id, t.group, t.pos, t.vel, t.cov, t.score)] + [repr(t.events)]


@pytest.mark.parametrize("mode", ["file", "image"])
@pytest.mark.parametrize("name", names())
def test_a_copied_tracker_goes_on_as_the_original(name, mode):
    if mode == "image" and not {"pixels", "stereo", "boxes"} & set(find(name).needs):
        pytest.skip("takes no pictures")
    made = sequence(mode)
    frames = tuple(islice(made, 30))
    ready = prepare(name, replace(made, frames=lambda: iter(frames), bare=None, length=len(frames)), detections=mode)
    ready.reset(0)
    given = list(ready.frames())
    half = len(given) // 2
    seen = sum(len(ready.step(f).id) for f in given[:half])
    copies = [copy.deepcopy(ready.tracker), pickle.loads(pickle.dumps(ready.tracker))]
    on = [content(ready.step(f)) for f in given[half:]]
    assert seen > 0
    for other in copies:
        assert [content(other.step(f, f.detections)) for f in given[half:]] == on


@pytest.mark.parametrize("detections", ["file", "image"])
@pytest.mark.parametrize("name", ["blob", "relational"])
def test_a_copied_environment_goes_on_as_the_original(name, detections):
    settings = ["camera.fps=5", "duration=4", "camera.image=[320,240]"]
    env = TuningEnv(name, "cross", seeds=[3], set=settings, detections=detections, decision_every=4)
    env.reset(seed=0)
    middle = np.zeros(env.action_space.shape)
    for _ in range(2):
        env.step(middle)
    other = copy.deepcopy(env)
    on = [env.step(middle) for _ in range(3)]
    for (seen, reward, ended, _, info), (seen2, reward2, ended2, _, info2) in zip(
        on, [other.step(middle) for _ in range(3)], strict=True
    ):
        assert np.array_equal(seen, seen2)
        assert (reward, ended, info["frame"]) == (reward2, ended2, info2["frame"])
    assert on[-1][-1]["frame"] == 20
