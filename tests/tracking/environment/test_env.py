"""The environment: Gymnasium's own checks for every tracker, rewards that sum to the objective, repeats, no truth."""

from __future__ import annotations

import dataclasses
import json
from dataclasses import replace
from pathlib import Path

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from gymnasium.wrappers import FlattenObservation, RecordEpisodeStatistics, RescaleAction, TimeLimit

import tracking
from scenarios.errors import InputError
from scenarios.loading.resolve import load
from sim.dataset.generate import generate
from sim.sequence import simulate
from sim.types import Truth
from tests.toy_tracker import Toy
from tracking.config import Config, param
from tracking.environment.env import OBSERVATIONS, TuningEnv
from tracking.environment.observation import NAMES
from tracking.parameter_space import decode, encode
from tracking.running.run import TrackingRun
from tracking.running.tracker_registry import names

ID = "flockscope/Tuning-v0"
SHORT = ["camera.fps=5", "duration=6"]
FAKE = f"{Path(__file__).resolve().parents[2] / 'fake_tracker.py'}:Nearest"
TOY = f"{Path(__file__).resolve().parents[2] / 'toy_tracker.py'}:Toy"


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


@pytest.mark.parametrize("every", [None, 10])
@pytest.mark.parametrize("observation", OBSERVATIONS)
@pytest.mark.parametrize("tracker", [*names(), TOY])
def test_gymnasium_checks_it_without_a_warning(tracker, observation, every):
    env = make(tracker, decision_every=every, observation=observation)
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


@pytest.mark.parametrize("tracker", names())
def test_once_per_episode_is_a_run_with_these_parameters(tracker):
    env = make(tracker)
    action = np.random.default_rng(2).uniform(-0.3, 0.3, env.action_space.shape).astype(np.float32)
    _, (reward,), info = played(env, action, seed=4)
    config = decode(env.unwrapped.space, action, env.unwrapped.defaults)
    assert info["params"] == config.as_dict()
    sequence = next(s for s in env.unwrapped.sources if (s.name, s.seed) == (info["scenario"], info["seed"])).open()
    run = tracking.track(tracker, sequence, params=config)
    assert reward == tracking.evaluate(sequence.truth, run)["objective"] == info["scores"]["objective"]


@pytest.mark.parametrize("every", [None, 9])
@pytest.mark.parametrize("tracker", [*names(), TOY])
def test_a_seed_repeats_everything(tracker, every):
    env = make(tracker, decision_every=every)
    first = played(env, 1, seed=5)
    played(env, 2)
    again = played(env, 1, seed=5)
    other = played(make(tracker, decision_every=every, cache=0), 1, seed=5)
    for run in (again, other):
        assert np.array_equal(run[0], first[0])
        assert np.array_equal(run[1], first[1])
        assert run[2] == first[2]


def test_a_refused_reset_leaves_the_episode_as_it_was():
    env = make(decision_every=5)
    env.reset(seed=0, options={"scenario": "cross"})
    by_tracker = {"confirm_ratio": 2.0, "speed_prior": 0.1, "accel_noise": 10.0}
    for wrong in (
        {"scenario": "pass-by", "params": {"gate": 7}},
        {"scenario": "pass-by", "params": by_tracker},
        {"scenario": "cros"},
    ):
        with pytest.raises(InputError):
            env.reset(options=wrong)
        *_, info = env.step(np.zeros(env.action_space.shape, np.float32))
        assert info["scenario"] == env.unwrapped.rollout.source.name == "cross"
    assert info["frame"] == 15


def test_a_step_needs_an_episode():
    for every in (None, 5):
        env = make(decision_every=every).unwrapped
        with pytest.raises(InputError, match=r"call reset\(\) first"):
            env.step(np.zeros(env.action_space.shape, np.float32))


def test_options_choose_the_source_and_the_parameters():
    env = make()
    options = {"scenario": "pass-by", "seed": 1, "params": {"report_delay": 3.0, "association": "nearest"}}
    _, info = env.reset(seed=0, options=options)
    assert (info["scenario"], info["seed"], info["params"]["report_delay"]) == ("pass-by", 1, 3.0)
    start = encode(env.unwrapped.space, env.unwrapped.base)
    first = played(env, start, seed=0, options=options)
    again = played(env, start, options=options)
    assert np.array_equal(first[1], again[1])
    plain = played(env, encode(env.unwrapped.space, env.unwrapped.defaults), options={"scenario": "pass-by", "seed": 1})
    assert first[1] != plain[1]


def test_unseeded_resets_draw_sources_and_seeded_ones_differ():
    env = make(seeds=range(5))
    env.reset(seed=0)
    drawn = {(i["scenario"], i["seed"]) for i in (env.reset()[1] for _ in range(15))}
    assert len(drawn) > 4
    assert {name for name, _ in drawn} == {"cross", "pass-by"}


def test_the_truth_is_for_the_score_alone(monkeypatch):
    """A sequence whose truth raises unless it is being scored: observations and answers are those of the plain one."""
    plain = simulate(load("cross", SHORT), 3, 0, ())
    expected = played(make("blob", plain, decision_every=10, set=()))

    class Poison:
        allowed = True

    poison, real = Poison(), plain.truth
    fields = {f.name for f in dataclasses.fields(Truth)}

    def guarded(self, name):
        if name in fields - {"length"} and object.__getattribute__(self, "__class__") is Guarded and not poison.allowed:
            raise AssertionError(f"looked at the truth: {name}")
        return object.__getattribute__(self, name)

    class Guarded(Truth):
        __getattribute__ = guarded

        def replace(self, **changes):  # of the camera and the scene, which are known
            return self

    hidden = Guarded(**{f.name: getattr(real, f.name) for f in dataclasses.fields(Truth)})
    from tracking.environment.episodes import Rollout

    scores, poison.allowed = Rollout.scores, False

    def scoring(self, *args):
        poison.allowed = True
        try:
            return scores(self, *args)
        finally:
            poison.allowed = False

    monkeypatch.setattr(Rollout, "scores", scoring)
    sequence = dataclasses.replace(plain, load_truth=lambda: hidden)
    found = played(make("blob", sequence, decision_every=10, set=()))
    assert np.array_equal(found[0], expected[0])
    assert np.array_equal(found[1], expected[1])
    with pytest.raises(AssertionError, match="looked at the truth"):
        _ = hidden.pos


def test_stored_sequences_and_lists(tmp_path):
    generate(["cross"], range(7, 9), tmp_path, set=SHORT, streams=())
    env = make("group-pda", tmp_path, set=())
    _, rewards, info = played(env, seed=1)
    assert info["scenario"].startswith("cross-s0000")
    assert rewards.sum() == pytest.approx(info["objective"])
    mixed = make("blob", [tmp_path, simulate(load("pass-by", SHORT), 1, 0, ()), "split"])
    assert {s.name for s in mixed.unwrapped.sources} == {"cross-s00007", "cross-s00008", "pass-by", "split"}


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


@pytest.mark.parametrize("decision_every", [None, 10])
def test_people_are_compared_as_asked(decision_every):
    """The reward is the score of this similarity; without one it is that of the data, here the ground."""
    found = {}
    for similarity in (None, "ground", "image"):
        env = make(similarity=similarity, decision_every=decision_every)
        _, rewards, info = played(env, seed=1)
        rollout = env.unwrapped.rollout
        run = TrackingRun(tuple(rollout.tracks), {"detections": "file"})
        expected = tracking.evaluate(rollout.truth, run, similarity=similarity)
        assert rewards.sum() == pytest.approx(expected["objective"], abs=1e-12)
        found[similarity] = info["scores"]["HOTA"]
    assert found[None] == found["ground"] != found["image"]
    with pytest.raises(InputError, match="similarity"):
        make(similarity="volume")
    with pytest.raises(InputError, match="no boxes to compare"):
        played(make(TOY, similarity="boxes"), seed=1)


def test_from_pixels():
    tiny = ["camera.fps=5", "duration=2", "camera.image=[160,120]"]
    env = make("group-pda", "cross", set=tiny, detections="image", decision_every=5, render_mode="rgb_array")
    seen, rewards, info = played(env, seed=1)
    named = dict(zip(env.unwrapped.observation_names, seen[-1], strict=True))
    assert named["score"] == named["detections"] == 0
    assert len(rewards) == 2
    assert "pixel_radius" in info["names"]
    assert "radius" not in info["names"]
    assert env.render().shape == (152, 160, 3)


def test_from_pixels_detections_that_came_with_the_pictures_are_not_there():
    """Neither for the tracker nor in what is observed: blob's tracks and a camera's sensor are both on the ground."""
    tiny = ["camera.fps=5", "duration=2", "camera.image=[320,240]"]
    env = make("blob", "cross", set=tiny, detections="image", decision_every=5)
    held = env.unwrapped.cache.open(env.unwrapped.sources[0], ("left",))
    assert any(len(frame.detections.pos) for frame in held.sequence)
    seen, _, _ = played(env, seed=1)
    assert env.unwrapped.rollout.last.detections is None
    named = dict(zip(env.unwrapped.observation_names, seen[-1], strict=True))
    assert named["score"] == named["detections"] == 0


def test_which_parameters_an_action_sets():
    once, often = make().unwrapped, make(decision_every=5).unwrapped
    assert set(often.parameter_names) < set(make(detections="image").unwrapped.parameter_names) | set(
        once.parameter_names
    )
    assert "dark" not in once.parameter_names
    assert all(p.online for p in often.space)
    params = make("group-pda").unwrapped
    assert params.observation_names[0] == "time"
    assert len(make("group-pda", observation="parameters").unwrapped.observation_names) == len(NAMES) + len(
        params.space
    )


def test_whatever_the_action_an_episode_comes_of_it():
    for tracker in names():
        for every in (None, 10):
            env = make(tracker, "cross", seeds=range(1), decision_every=every)
            for corner in (-1.0, 1.0):
                _, rewards, info = played(env, np.full(env.action_space.shape, corner), seed=2)
                assert np.isfinite(rewards).all()
                assert rewards.sum() == pytest.approx(info["objective"], abs=1e-9)


def test_parameters_that_the_tracker_refuses_are_left_as_they_were():
    """At any frame rate newborn tracks of blob must start above confirm_ratio."""
    env = make(decision_every=5).unwrapped
    env.reset(seed=1)
    wrong = dataclasses.replace(env.defaults, confirm_ratio=2.0, speed_prior=0.1, accel_noise=10.0)
    _, _, _, _, info = env.step(encode(env.space, wrong).astype(np.float32))
    assert "confirm_ratio" in info["refused"]
    assert info["params"] == env.defaults.as_dict()
    _, _, _, _, info = env.step(encode(env.space, env.defaults).astype(np.float32))
    assert info["refused"] == ""
    once = make().unwrapped
    once.reset(seed=1)
    *_, info = once.step(encode(once.space, wrong).astype(np.float32))
    assert 1.5 <= info["params"]["confirm_ratio"] < 2.0


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


@pytest.mark.parametrize(
    ("tracker", "options", "words"),
    [
        (FAKE, {}, "a tracker with parameters"),
        ("blbo", {}, "did you mean blob"),
        ("blob", {"decision_every": 0}, "1 or more"),
        ("blob", {"decision_every": 2.5}, "1 or more"),
        ("blob", {"observation": "statistic"}, "did you mean statistics"),
        ("blob", {"params": {"gaet": 0.5}}, "did you mean gate"),
        ("blob", {"suite": "nothing at all"}, "a scenario, a suite"),
        ("blob", {"render_mode": "human"}, "rgb_array"),
        ("blob", {"detections": "boxes"}, "one of None, image, truth, file"),
        ("blob", {"seeds": 5}, r"write for example range\(5\)"),
        ("blob", {"set": "camera.fps=5"}, r"write \['camera.fps=5'\]"),
        (StillToy, {"decision_every": 5}, "may change between frames"),
    ],
)
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


def test_actions_of_another_shape_are_named():
    env = make().unwrapped
    env.reset(seed=0)
    with pytest.raises(InputError, match="action"):
        env.step(np.zeros(3, np.float32))


def test_wrappers():
    env = make(decision_every=6)
    env = RecordEpisodeStatistics(FlattenObservation(RescaleAction(TimeLimit(env, 3), np.float32(0), np.float32(1))))
    env.reset(seed=1)
    for k in range(3):
        *_, done, cut, info = env.step(np.full(env.action_space.shape, 0.5, np.float32))
        assert (done, cut) == (False, k == 2)
    assert info["episode"]["l"] == 3
    assert info["episode"]["r"] == pytest.approx(info["objective"], abs=1e-6)


@pytest.mark.parametrize("mode", ["sync", "async"])
def test_vectorised(mode):
    made = {"tracker": "blob", "suite": "cross", "seeds": range(3), "set": SHORT, "decision_every": 15}
    envs = gymnasium.make_vec(ID, 2, vectorization_mode=mode, **made)
    try:
        seen, _ = envs.reset(seed=[1, 2])
        assert seen.shape == (2, 30)
        zero = np.zeros(envs.action_space.shape, np.float32)
        rewards = np.array([envs.step(zero)[1] for _ in range(2)])
    finally:
        envs.close()
    for k, seed in enumerate((1, 2)):
        assert played(make(suite="cross", seeds=range(3), decision_every=15), seed=seed)[1] == pytest.approx(
            rewards[:, k]
        )


@pytest.mark.parametrize(("every", "rate"), [(None, 5), (2, 2), (10, 1)])
def test_a_video_takes_as_long_as_what_it_shows(every, rate):
    """RecordVideo asks before the first reset."""
    env = make(decision_every=every, render_mode="rgb_array")
    assert env.metadata["render_fps"] == rate
    env.reset(seed=1)
    assert env.metadata["render_fps"] == rate


def test_video(tmp_path):
    pytest.importorskip("moviepy", reason="RecordVideo writes with moviepy")
    from gymnasium.wrappers import RecordVideo

    env = RecordVideo(make(decision_every=3, render_mode="rgb_array"), str(tmp_path / "films"), lambda episode: True)
    played(env, seed=1)
    env.close()
    (film,) = tmp_path.glob("films/*.mp4")
    import cv2

    video = cv2.VideoCapture(str(film))
    assert int(video.get(cv2.CAP_PROP_FRAME_COUNT)) >= 10
    assert (video.get(cv2.CAP_PROP_FRAME_WIDTH), video.get(cv2.CAP_PROP_FRAME_HEIGHT)) == (640, 512)


def test_what_it_says_can_be_written_down():
    _, _, info = played(make("group-pda", decision_every=15), seed=1)
    assert json.loads(json.dumps(info))["objective"] == info["objective"]
    assert set(info["scores"]) == {"objective", "group_F1"}
