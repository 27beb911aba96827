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
from tests.processes import TOY, python
from tests.toy_tracker import BoxedToy
from tracking.environment.env import TuningEnv
from tracking.episodes.episode_cache import SourceCache
from tracking.episodes.sources import sources
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


def pickled(env):
    return pickle.loads(pickle.dumps(env))


def environment(tracker, **options):
    settings = ["camera.fps=5", "duration=3", "camera.image=[160,120]"]
    return TuningEnv(
        tracker, ("cross", "pass-by"), **{"seeds": range(2), "set": settings, "decision_every": 4, **options}
    )


ENVIRONMENTS = [
    *((name, {}) for name in names()), (TOY, {}), (BoxedToy, {"reward": "prefix"}), ("blob", {"decision_every": None}),
    *((name, {"detections": "image"}) for name in ("blob", "group-pda", "relational")),
    ("blob", {"actions": "presets", "presets": [{"coast_time": 0.7}, {}]}),
]  # fmt: skip


@pytest.mark.parametrize("copied", [copy.deepcopy, pickled])
@pytest.mark.parametrize(("tracker", "options"), ENVIRONMENTS)
def test_a_copied_environment_goes_on_as_the_original(tracker, options, copied):
    """To the end of the episode and through the next one."""
    env = environment(tracker, **options)
    env.action_space.seed(1)
    env.reset(seed=2)
    drawn = [env.action_space.sample() for _ in range(9)]
    actions = drawn if env.actions == "presets" else [0.4 * action for action in drawn]
    if env.decision_every is not None:
        env.step(actions.pop())
    runs, ended = [], 0
    for one in (env, copied(env)):
        runs.append([])
        for action in actions:
            runs[-1].append(one.step(action))
            if runs[-1][-1][2]:
                ended += 1
                runs[-1].append((one.reset()[0],))
    assert ended >= 4
    for (seen, *others), (seen2, *others2) in zip(*runs, strict=True):
        assert np.array_equal(seen, seen2)
        assert others == others2


GOES_ON = """
import pickle, sys
env = pickle.load(open(sys.argv[1], "rb"))
seen, reward, *_ = env.step(0 * env.action_space.sample())
print(seen.tobytes().hex(), reward)
"""


@pytest.mark.parametrize("tracker", ["blob", TOY])
def test_an_episode_goes_on_in_another_process(tracker, tmp_path):
    env = environment(tracker)
    env.reset(seed=3)
    for _ in range(2):
        (tmp_path / "env").write_bytes(pickle.dumps(env))
        done = python("-c", GOES_ON, tmp_path / "env")
        seen, reward, *_ = env.step(np.zeros(env.action_space.shape, np.float32))
        assert done.stdout.split() == [seen.tobytes().hex(), str(reward)], done.stderr


def test_the_cache_of_a_copy():
    """A deep copy shares it; a pickled one has the same limit and is empty."""
    env = environment("blob", cache=2**20)
    env.reset(seed=3)
    assert copy.deepcopy(env).cache is env.cache
    assert (pickled(env).cache.limit, len(pickled(env).cache)) == (2**20, 0)


def test_what_is_made_of_a_kept_sequence_is_not_taken_for_it():
    kept = SourceCache().open(*sources("cross", [3]))
    assert pickled(kept.sequence).truth.pos.tobytes() == kept.truth.pos.tobytes()
    other = replace(kept.sequence, name="other")
    assert copy.copy(other).name == "other"
    with pytest.raises((AttributeError, pickle.PicklingError), match="local"):
        pickle.dumps(other)
