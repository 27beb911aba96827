"""The environment: Gymnasium's own checks for every tracker, rewards that sum to the objective, repeats, no truth."""

from __future__ import annotations

import dataclasses
from dataclasses import replace

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

import tracking
from scenarios.errors import InputError
from scenarios.loading.resolve import load
from sim.sequence import simulate
from tests.processes import FAKE, TOY, python
from tests.toy_tracker import Toy
from tracking.config import Config, param
from tracking.environment.env import TuningEnv
from tracking.running.signals import NAMES
from tracking.parameter_space import encode
from tracking.running.tracker_registry import names

ID = "flockscope/Tuning-v0"
SHORT = ["camera.fps=5", "duration=6"]
TINY = ["camera.fps=5", "duration=3"]


def make(tracker="blob", suite=("cross", "pass-by"), **options):
    return gymnasium.make(ID, tracker=tracker, suite=suite, **{"seeds": range(2), "set": SHORT, **options})


def played(env, actions=None, **reset):
    """Observations, rewards and the last info of an episode; actions: one for all steps, or drawn by a seed."""
    rng = np.random.default_rng(actions) if isinstance(actions, int) else None
    seen, info = env.reset(**reset)
    everything, rewards, done = [seen], [], False
    while not done:
        drawn = rng.uniform(-0.4, 0.4, env.action_space.shape) if rng else actions
        action = np.zeros(env.action_space.shape) if drawn is None else drawn
        seen, reward, done, cut, info = env.step(np.asarray(action, np.float32))
        assert not cut
        everything.append(seen)
        rewards.append(reward)
    return np.array(everything), np.array(rewards), info


@pytest.mark.parametrize(("tracker", "every"), [*((name, 10) for name in names()), (TOY, None)])
def test_gymnasium_checks_it_without_a_warning(tracker, every):
    env = make(tracker, decision_every=every, set=TINY)
    check_env(env.unwrapped)


@pytest.mark.parametrize("tracker", names())
def test_rewards_sum_to_what_evaluate_says(tracker):
    env = make(tracker, decision_every=7)
    _, rewards, info = played(env, seed=3)
    assert len(rewards) == 5
    (source,) = [s for s in env.unwrapped.sources if (s.name, s.seed) == (info["scenario"], info["seed"])]
    sequence = source.open()
    config = env.unwrapped.config
    run = tracking.track(tracker, sequence, params=config)
    scores = tracking.evaluate(sequence.truth, run)
    assert rewards.sum() == pytest.approx(scores["objective"], abs=1e-9)
    assert info["objective"] == pytest.approx(scores["objective"], abs=1e-12)
    for frame, total in zip((7, 14, 21, 28), np.cumsum(rewards), strict=False):
        prefix = tracking.evaluate(sequence.truth, run, frames=frame)["objective"]
        assert total == pytest.approx(prefix, abs=1e-9, nan_ok=True)


@pytest.mark.parametrize(("tracker", "every"), [*((name, 9) for name in names()), (TOY, None)])
def test_a_seed_repeats_everything(tracker, every):
    env = make(tracker, decision_every=every, set=TINY)
    first = played(env, 1, seed=5)
    played(env, 2)
    again = played(env, 1, seed=5)
    other = played(make(tracker, decision_every=every, cache=0, set=TINY), 1, seed=5)
    for run in (again, other):
        assert np.array_equal(run[0], first[0])
        assert np.array_equal(run[1], first[1])
        assert run[2] == first[2]


def test_options_choose_the_source_and_the_parameters():
    env = make()
    options = {"scenario": "pass-by", "seed": 1, "params": {"coast_time": 3.0, "management": "rho"}}
    _, info = env.reset(seed=0, options=options)
    assert (info["scenario"], info["seed"], info["params"]["coast_time"]) == ("pass-by", 1, 3.0)
    start = encode(env.unwrapped.space, env.unwrapped.base)
    first = played(env, start, seed=0, options=options)
    again = played(env, start, options=options)
    assert np.array_equal(first[1], again[1])
    plain = played(env, encode(env.unwrapped.space, env.unwrapped.defaults), options={"scenario": "pass-by", "seed": 1})
    assert first[1] != plain[1]


def test_the_truth_is_for_the_score_alone():
    """Other labels change rewards, and nothing that is observed or answered."""
    plain = simulate(load("cross", SHORT), 3, 0, ())
    moved = plain.truth.replace(pos=plain.truth.pos + 3.0, box=plain.truth.box + 50.0)
    other = dataclasses.replace(plain, load_truth=lambda: moved)
    expected, found = (played(make("blob", s, decision_every=10, set=(), detections="file")) for s in (plain, other))
    assert np.array_equal(found[0], expected[0])
    assert not np.array_equal(found[1], expected[1])


def test_from_pixels():
    tiny = ["camera.fps=5", "duration=2", "camera.image=[160,120]"]
    env = make("group-pda", "cross", set=tiny, detections="image", decision_every=5)
    seen, rewards, info = played(env, seed=1)
    named = dict(zip(NAMES, seen[-1], strict=True))
    assert named["score"] == named["detections"] == 0
    assert len(rewards) == 2
    assert "pixel_radius" in info["names"]
    assert "radius" not in info["names"]


class Deaf(Toy):
    """Does not keep its config."""

    def __init__(self, config):
        super().__init__(config)
        self.kept = config

    def reset(self, context, seed):
        self.config = self.kept
        super().reset(context, seed)
        del self.config


@dataclasses.dataclass(frozen=True)
class Still(Config):
    tracker = "still"
    reach: float = param(1.0, (0.1, 5.0), "m", "no change", online=False)


class StillToy(Toy):
    config_class = Still


WRONG_ARGUMENTS = [
    (FAKE, {}, "a tracker with parameters"), ("blbo", {}, "did you mean blob"),
    ("blob", {"decision_every": 0}, "1 or more"), ("blob", {"decision_every": 2.5}, "1 or more"),
    ("blob", {"params": {"gaet": 0.5}}, "did you mean gate"),
    ("blob", {"suite": "nothing at all"}, "a scenario, a suite"),
    ("blob", {"detections": "boxes"}, "one of None, image, truth, file"),
    ("blob", {"seeds": [0, 20_000]}, "seeds of one split"),
    ("blob", {"set": "camera.fps=5"}, r"write \['camera.fps=5'\]"),
    (StillToy, {"decision_every": 5}, "may change between frames"),
]  # fmt: skip


@pytest.mark.parametrize(("tracker", "options", "words"), WRONG_ARGUMENTS)
def test_wrong_wishes_are_named(tracker, options, words):
    with pytest.raises(InputError, match=words):
        TuningEnv(tracker, **{"suite": "cross", "set": SHORT, **options})


@pytest.mark.parametrize(
    ("options", "words"),
    [({"scenrio": "cross"}, "did you mean scenario"), ({"scenario": "split"}, "one of cross"), ({"seed": 9}, "0 to 1")],
)
def test_wrong_options_are_named(options, words):
    with pytest.raises(InputError, match=words):
        make().reset(options=options)


def test_a_tracker_that_keeps_no_config_cannot_change_between_frames():
    with pytest.raises(InputError, match="keeps its config"):
        TuningEnv(Deaf, "cross", set=SHORT, decision_every=5).reset()


def test_vectorised():
    made = {"tracker": "blob", "suite": "cross", "seeds": range(3), "set": SHORT, "decision_every": 15}
    envs = gymnasium.make_vec(ID, 2, vectorization_mode="async", **made)
    try:
        seen, _ = envs.reset(seed=[1, 2])
        assert seen.shape == (2, len(NAMES))
        zero = np.zeros(envs.action_space.shape, np.float32)
        rewards = np.array([envs.step(zero)[1] for _ in range(2)])
    finally:
        envs.close()
    for k, seed in enumerate((1, 2)):
        assert played(make(suite="cross", seeds=range(3), decision_every=15), seed=seed)[1] == pytest.approx(
            rewards[:, k]
        )


KNOWN = "assert gymnasium.registry['flockscope/Tuning-v0'].entry_point == 'tracking.environment.env:TuningEnv'"


FIRST_IMPORTS = [
    ("import tracking", "assert 'gymnasium' not in sys.modules", "import gymnasium", KNOWN),
    ("import gymnasium", "env = gymnasium.make('tracking:flockscope/Tuning-v0', tracker='blob')", KNOWN),
]


@pytest.mark.parametrize("lines", FIRST_IMPORTS)
def test_it_is_known(lines):
    done = python("-c", "\n".join(["import sys", *lines]))
    assert done.returncode == 0, done.stderr


def test_a_step_needs_an_episode():
    for every in (None, 5):
        env = make(decision_every=every).unwrapped
        with pytest.raises(InputError, match=r"call reset\(\) first"):
            env.step(np.zeros(env.action_space.shape, np.float32))


def test_all_episodes_have_detections_of_one_kind():
    """That which the recorded ones have; where they have none in common, it is said at once."""
    whole = simulate(load("pass-by", SHORT), 1, 0, ())
    bare, boxed = replace(whole, name="bare", has_detections=False), replace(whole, name="boxed", load_truth=None)
    for mixed in (["cross", bare], [bare, "cross"]):
        env = make("group-pda", mixed).unwrapped
        assert env.mode == "truth"
        for seed in range(6):
            played(env, seed=seed)
    with pytest.raises(InputError, match="bare with truth"):
        make("group-pda", ["cross", boxed, bare])


def test_actions_of_another_shape_are_named():
    env = make().unwrapped
    env.reset(seed=0)
    with pytest.raises(InputError, match="action"):
        env.step(np.zeros(3, np.float32))
