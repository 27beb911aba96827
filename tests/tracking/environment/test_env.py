"""The environment: Gymnasium's own checks for every tracker, rewards that sum to the objective, repeats, no truth."""

from __future__ import annotations

import dataclasses
from dataclasses import replace

import gymnasium
import numpy as np
import pytest
from gymnasium.spaces import Box, Discrete
from gymnasium.utils.env_checker import check_env
from gymnasium.vector import AutoresetMode, SyncVectorEnv
from gymnasium.wrappers import (
    FlattenObservation,
    FrameStackObservation,
    NormalizeObservation,
    RecordEpisodeStatistics,
    RescaleAction,
    TimeLimit,
)  # fmt: skip

import tracking
from scenarios.errors import InputError, WorkError
from scenarios.loading.resolve import load
from sim.dataset.generate import generate
from sim.sequence import simulate
from sim.types import Groups
from tests.processes import FAKE, TOY, python
from tests.toy_tracker import BoxedToy, Toy
from tracking.config import Config, param
from tracking.environment.env import TuningEnv
from tracking.episodes.episode_cache import SourceCache
from tracking.grouping import foot_points
from tracking.parameter_space import encode
from tracking.running.signals import NAMES
from tracking.running.tracker_registry import names

ID = "flockscope/Tuning-v0"
TINY = ["camera.fps=5", "duration=3"]  # 15 frames
CACHE = SourceCache()  # of all tests, so that each scene is simulated once


def make(tracker="blob", suite=("cross", "pass-by"), **options):
    return gymnasium.make(
        ID, tracker=tracker, suite=suite, **{"seeds": range(2), "set": TINY, "cache": CACHE, **options}
    )


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


def run_again(env, info, **options):
    """The same run without the environment: the truth, and what `tracking.track` returns."""
    (source,) = [s for s in env.unwrapped.sources if (s.name, s.seed) == (info["scenario"], info["seed"])]
    sequence = source.open()
    return sequence.truth, tracking.track(env.unwrapped.tracker, sequence, params=env.unwrapped.config, **options)


@pytest.mark.parametrize(("tracker", "every"), [*((name, 10) for name in names()), (TOY, None)])
@pytest.mark.parametrize("actions", ["residual", "absolute", "presets"])
def test_gymnasium_checks_it_without_a_warning(tracker, every, actions):
    presets = ({}, {}) if actions == "presets" else ()
    env = make(tracker, decision_every=every, presets=presets, actions=actions)
    check_env(env.unwrapped)
    assert isinstance(env.action_space, Discrete if presets else Box)


@pytest.mark.parametrize("tracker", names())
def test_rewards_of_prefixes_sum_to_what_evaluate_says(tracker):
    env = make(tracker, decision_every=4, reward="prefix")
    _, rewards, info = played(env, seed=3)
    assert len(rewards) == 4
    truth, run = run_again(env, info)
    scores = tracking.evaluate(truth, run)
    assert rewards.sum() == pytest.approx(scores["objective"], abs=1e-9)
    assert info["objective"] == pytest.approx(scores["objective"], abs=1e-12)
    for frame, total in zip((4, 8, 12), np.cumsum(rewards), strict=False):
        prefix = tracking.evaluate(truth, run, frames=frame)["objective"]
        assert total == pytest.approx(prefix, abs=1e-9, nan_ok=True)


@pytest.mark.parametrize("tracker", [*names(), BoxedToy])
@pytest.mark.parametrize("margin", [0.0, 1.0])
def test_rewards_of_windows_are_their_objectives_by_length(tracker, margin):
    """Windows of 4, 4, 4 and 3 of 15 frames; a margin of 1 s is 5 frames, at the first window less."""
    env = make(tracker, decision_every=4, margin=margin)
    _, rewards, info = played(env, seed=3)
    truth, run = run_again(env, info)
    windows = [range(max(1, first - round(margin * 5)), min(first + 4, 16)) for first in (1, 5, 9, 13)]
    found = [tracking.evaluate(truth, run, frames=window)["objective"] for window in windows]
    assert rewards == pytest.approx(np.nan_to_num(found, nan=1.0) * [4 / 15, 4 / 15, 4 / 15, 3 / 15], abs=1e-9)
    assert 0 < rewards.sum() <= 1
    assert info["objective"] == pytest.approx(tracking.evaluate(truth, run)["objective"], abs=1e-12)


def test_where_boxes_stand_is_computed_once(monkeypatch):
    """However many windows have a frame in their margins: a step costs the same early and late in an episode."""
    seen, standing = list[int](), foot_points.standing

    def counted(tracks, *others):
        seen.extend(t.index for t in tracks)
        return standing(tracks, *others)

    monkeypatch.setattr(foot_points, "standing", counted)
    env = make(BoxedToy, decision_every=1).unwrapped
    env.reset(seed=0)
    for _ in range(14):
        env.step(np.zeros(env.action_space.shape, np.float32))
    assert sorted(seen) == list(range(1, 15))


def test_the_objective_is_not_known_before_the_end_of_windows():
    env = make(decision_every=10)
    env.reset(seed=0)
    assert env.step(np.zeros(env.action_space.shape, np.float32))[4]["objective"] == 0
    env = make(decision_every=None)
    _, rewards, info = played(env, seed=0)
    assert rewards.tolist() == [info["objective"]]


def test_statistics_are_collected_where_something_is_left_to_decide():
    for every, told in ((None, False), (5, True)):
        env = make(decision_every=every)
        env.reset(seed=0)
        seen = env.step(np.zeros(env.action_space.shape, np.float32))[0]
        assert seen[: len(NAMES)].any() == told


class FarAway(Toy):
    """Is 100 m off if `skip` is not 0."""

    def step(self, frame, detections):
        found = super().step(frame, detections)
        return found.replace(pos=found.pos + 100.0 * (self.config.skip > 0))


@pytest.mark.parametrize("every", [None, 4])
def test_parameters_may_lead_far_away(every):
    """That nobody tracked is near a detection is a mistake of the tracker with the parameters that it begins with."""
    env = make(FarAway, "cross", decision_every=every).unwrapped
    _, info = env.reset(seed=0)
    ended, action = False, np.float32([name == "skip" for name in info["names"]])
    while not ended:
        *_, ended, _, info = env.step(action)
    assert info["params"]["skip"] == 4
    assert info["scores"]["HOTA"] == 0
    with pytest.raises(WorkError, match="expected people in m near the detections"):
        played(env, None, seed=0, options={"params": {"skip": 1}})


def test_a_scene_without_people_or_tracks_is_right():
    plain = simulate(load("cross", TINY), 3, 0, ())
    truth = plain.truth
    late = truth.frame > 10
    held = ("frame", "id", "group", "pos", "vel", "box", "visibility", "visible_box", "z")
    late = truth.replace(
        **{n: getattr(truth, n)[late] for n in held if getattr(truth, n) is not None},
        groups=(Groups.none(),) * 15,
        events=(),
    )
    empty = [f.replace(detections=f.detections.keep(np.zeros(0, np.int64))) for f in plain]
    other = dataclasses.replace(plain, load_truth=lambda: late, frames=lambda: iter(empty), bare=None)
    _, rewards, _ = played(make("blob", other, set=(), detections="file", decision_every=5, margin=0.0))
    assert rewards == pytest.approx([1 / 3, 1 / 3, 0])


@pytest.mark.parametrize("tracker", [*names(), TOY])
def test_no_residual_is_what_the_episode_begins_with(tracker):
    given = dict.fromkeys(())
    if tracker == "blob":
        given = {"gate": 0.97, "coast_time": 0.7, "accel_noise": 1.23456789, "management": "rho"}
    for every in (None, 8):
        env = make(tracker, decision_every=every, params=given).unwrapped
        seen, info = env.reset(seed=0)
        start = info["params"]
        assert {k: start[k] for k in given} == given
        assert seen[len(NAMES) :] == pytest.approx(encode(env.space, env.defaults), abs=1e-6)
        zero = np.zeros(env.action_space.shape, np.float32)
        info = env.step(zero)[4]
        assert info["params"] == start, "to the last bit"
        assert not info["refused"]
    for sign in (-1.0, 1.0):
        env.reset(seed=0)
        seen, *_, info = env.step(zero + sign)
        numbers = [p for p in env.space if p.scale in ("linear", "log")]
        ends = [info["params"][p.name] == (p.low if sign < 0 else p.high) for p in numbers]
        assert all(ends) or info["refused"] or tracker != "blob"
        assert seen[len(NAMES) :] == pytest.approx(encode(env.space, env.config), abs=1e-6)


def test_absolute_actions_do_not_depend_on_what_an_episode_begins_with():
    found = []
    for params in ({}, {"gate": 0.97, "coast_time": 0.7}):
        env = make(decision_every=8, actions="absolute", params=params)
        env.reset(seed=0)
        found.append(env.step(np.full(env.action_space.shape, 0.3, np.float32))[4]["params"])
    assert found[0] == found[1]
    (coast,) = [p for p in env.unwrapped.space if p.name == "coast_time"]
    share = 0.65
    linear, log = coast.low + share * (coast.high - coast.low), coast.low * (coast.high / max(coast.low, 1e-9)) ** share
    assert found[0]["coast_time"] == pytest.approx(log if coast.scale == "log" else linear, rel=1e-6)


def test_presets_are_chosen_by_their_number():
    presets = [{}, {"coast_time": 0.7}, {"coast_time": 3.0, "gate": 0.97}]
    env = make(decision_every=5, actions="presets", presets=presets).unwrapped
    env.reset(seed=0)
    for action in (2, np.int64(1), np.array(0)):
        seen, *_, info = env.step(action)
        assert info["params"]["coast_time"] == presets[int(action)].get("coast_time", env.defaults.coast_time)
        assert seen[len(NAMES) :] == pytest.approx(encode(env.space, env.config), abs=1e-6)
    env.reset(seed=0)
    for action in (3, -1, 0.5, np.zeros(12), None):
        with pytest.raises(InputError, match="a whole number from 0 to 2"):
            env.step(action)


def test_a_preset_that_no_action_may_choose_in_an_episode_is_named_by_reset():
    env = make(decision_every=5, actions="presets", presets=[{}, {"coast_time": 0.7}]).unwrapped
    with pytest.raises(InputError, match=r"presets\[0\]: got another management; .*leave it as in `params`"):
        env.reset(seed=0, options={"params": {"management": "rho"}})
    env.reset(seed=0, options={"params": {"coast_time": 3.0}})
    assert env.step(0)[4]["params"]["coast_time"] == env.defaults.coast_time


class Falls(Toy):
    """Fails in frame 6."""

    def step(self, frame, detections):
        if frame.index == 6:
            raise ValueError("a mistake")
        return super().step(frame, detections)


def test_a_tracker_that_fails_between_decisions_ends_the_episode():
    env = make(Falls, "cross", decision_every=4).unwrapped
    env.reset(seed=0)
    still = np.zeros(env.action_space.shape, np.float32)
    env.step(still)
    with pytest.raises(WorkError, match="a mistake"):
        env.step(still)
    with pytest.raises(InputError, match="got an episode that has ended"):
        env.step(still)


def test_after_the_end_a_new_episode_has_to_begin():
    for every in (None, 8):
        env = make(decision_every=every).unwrapped
        played(env, seed=0)
        with pytest.raises(InputError, match=r"got an episode that has ended; .*call reset\(\) first"):
            env.step(np.zeros(env.action_space.shape, np.float32))
        played(env)


@pytest.mark.parametrize(("tracker", "every"), [*((name, 4) for name in names()), (TOY, None)])
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


@pytest.mark.parametrize("tracker", ["blob", "group-pda"])
def test_many_random_steps(tracker):
    """On a scene whose detector changes; every observation and reward is finite and in its space."""
    worse = [*TINY, "sensor.every={at=[0, 1], value=[1, 3]}", "sensor.clutter_rate={at=[0, 2], value=[0, 9]}"]
    env = make(tracker, "cross", set=worse, decision_every=1)
    env.action_space.seed(4)
    seen, _ = env.reset(seed=4)
    for _ in range(300 // 15):
        total = 0.0
        for k in range(15):
            seen, reward, ended, cut, _ = env.step(env.action_space.sample())
            assert env.observation_space.contains(seen)
            assert np.isfinite(reward)
            assert (ended, cut) == (k == 14, False)
            total += reward
        assert 0 <= total <= 1
        env.reset()


def test_options_choose_the_source_and_the_parameters():
    env = make(actions="absolute")
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
    plain = simulate(load("cross", TINY), 3, 0, ())
    moved = plain.truth.replace(pos=plain.truth.pos + 3.0, box=plain.truth.box + 50.0)
    other = dataclasses.replace(plain, load_truth=lambda: moved)
    expected, found = (played(make("blob", s, decision_every=10, set=(), detections="file")) for s in (plain, other))
    assert np.array_equal(found[0], expected[0])
    assert not np.array_equal(found[1], expected[1])


def test_from_pixels():
    tiny = ["camera.fps=5", "duration=2", "camera.image=[160,120]"]
    env = make("group-pda", "cross", set=tiny, detections="image", decision_every=5)
    seen, rewards, info = played(env, seed=1)
    named = dict(zip(NAMES, seen[-1], strict=False))
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
    ("blob", {"detections": "boxes"}, "one of None, image, file, truth"),
    (TOY, {"detections": "image"}, "one of None, file, truth; "),
    (TOY, {"detections": "both"}, "one of None, file, truth; "),
    ("blob", {"cache": "big"}, "cache: got 'big'; expected bytes"), ("blob", {"cache": -1}, "cache: got -1"),
    ("blob", {"every_score": "yes"}, "every_score: got 'yes'"),
    ("blob", {"tracker_seed": 1.5}, "tracker_seed: got 1.5"),
    ("blob", {"tracker_seed": -1}, "tracker_seed: got -1"), ("blob", {"seeds": [0.5]}, "seeds: got 0.5"),
    ("blob", {"seeds": [0, 20_000]}, "seeds of one split"),
    ("blob", {"set": "camera.fps=5"}, r"write \['camera.fps=5'\]"),
    (StillToy, {"decision_every": 5}, "may change between frames"),
    ("blob", {"actions": "residuals"}, "did you mean residual"),
    ("blob", {"reward": "windows"}, "did you mean window"),
    ("blob", {"margin": -1}, "margin: got -1; expected seconds from 0 to 3600"),
    ("blob", {"margin": float("nan")}, "margin: got nan"),
    ("blob", {"actions": "presets"}, "0 presets with actions='presets'"),
    ("blob", {"presets": [{}]}, "1 presets with actions='residual'"),
    ("blob", {"actions": "presets", "presets": {"gate": 0.97}}, r"write \[\{'gate': 0.97\}\]"),
    ("blob", {"actions": "presets", "presets": 3}, "got 3; expected a list of configs"),
    ("blob", {"actions": "presets", "presets": [{"gaet": 0.5}]}, "did you mean gate"),
    ("blob", {"actions": "presets", "presets": [{}, {"management": "rho"}], "decision_every": 5},
     r"presets\[1\]: got another management; expected a parameter that may change here"),
]  # fmt: skip


@pytest.mark.parametrize(("tracker", "options", "words"), WRONG_ARGUMENTS)
def test_wrong_wishes_are_named(tracker, options, words):
    with pytest.raises(InputError, match=words):
        TuningEnv(tracker, **{"suite": "cross", "set": TINY, **options})


@pytest.mark.parametrize(
    ("options", "words"),
    [({"scenrio": "cross"}, "did you mean scenario"), ({"scenario": "split"}, "one of cross"), ({"seed": 9}, "0 to 1")],
)
def test_wrong_options_are_named(options, words):
    with pytest.raises(InputError, match=words):
        make().reset(options=options)


def test_a_tracker_that_keeps_no_config_cannot_change_between_frames():
    with pytest.raises(InputError, match="keeps its config"):
        TuningEnv(Deaf, "cross", set=TINY, decision_every=5).reset()


@pytest.mark.parametrize("mode", AutoresetMode)
def test_vectors_begin_new_episodes_as_gymnasium_says(mode):
    """Two environments whose episodes are two steps long, beside single ones."""
    made = {"suite": "cross", "seeds": range(3), "decision_every": 8}
    envs = SyncVectorEnv([lambda: make(**made)] * 2, autoreset_mode=mode)
    seen, _ = envs.reset(seed=[1, 2])
    assert seen.shape == (2, len(NAMES) + len(envs.envs[0].unwrapped.space))
    zero = np.zeros(envs.action_space.shape, np.float32)
    single = [played(make(**made), seed=seed) for seed in (1, 2)]
    steps = [envs.step(zero) for _ in range(2)]
    assert pytest.approx(np.array([one[1] for one in single])) == np.array([step[1] for step in steps]).T
    assert [step[2].tolist() for step in steps] == [[False, False], [True, True]]
    last = steps[-1][4]["final_obs"] if mode == AutoresetMode.SAME_STEP else steps[-1][0]
    assert np.array_equal(np.stack(list(last)), [one[0][-1] for one in single])
    if mode == AutoresetMode.DISABLED:
        envs.reset(options={"reset_mask": np.array([True, True])})
    elif mode == AutoresetMode.NEXT_STEP:
        _, rewards, ended, _, _ = envs.step(zero)
        assert not rewards.any()
        assert not ended.any()
    seen, _, ended, _, info = envs.step(zero)
    assert info["frame"].tolist() == [8, 8]
    assert not ended.any()
    envs.close()


def test_processes_beside_each_other():
    made = {"tracker": "blob", "suite": "cross", "seeds": range(3), "set": TINY, "decision_every": 8}
    envs = gymnasium.make_vec(ID, 2, vectorization_mode="async", **made)
    try:
        envs.reset(seed=[1, 2])
        zero = np.zeros(envs.action_space.shape, np.float32)
        rewards = np.array([envs.step(zero)[1] for _ in range(2)])
    finally:
        envs.close()
    for k, seed in enumerate((1, 2)):
        single = played(make(suite="cross", seeds=range(3), decision_every=8), seed=seed)
        assert single[1] == pytest.approx(rewards[:, k])


def test_usual_wrappers_fit():
    """What learners put around an environment: other ranges, statistics of episodes, a limit of steps."""
    env = RecordEpisodeStatistics(
        RescaleAction(FlattenObservation(make(decision_every=4)), np.float32(0), np.float32(1))
    )
    env.reset(seed=0)
    for _ in range(4):
        *_, ended, _, info = env.step(np.full(env.action_space.shape, 0.5, np.float32))
    assert ended
    plain = played(make(decision_every=4), seed=0)
    assert info["episode"]["r"] == pytest.approx(plain[1].sum())
    assert info["episode"]["l"] == 4
    stacked = FrameStackObservation(NormalizeObservation(make(decision_every=4)), 3)
    seen, _ = stacked.reset(seed=0)
    assert seen.shape == (3, *make(decision_every=4).observation_space.shape)
    assert np.isfinite(stacked.step(np.zeros(env.action_space.shape, np.float32))[0]).all()
    short = TimeLimit(make(decision_every=4), 2)
    short.reset(seed=0)
    assert [short.step(np.zeros(env.action_space.shape, np.float32))[2:4] for _ in range(2)] == [
        (False, False),
        (False, True),
    ]


def test_stored_and_simulated_scenes_have_the_same_names(tmp_path):
    generate(["cross", "pass-by"], range(2), tmp_path, set=TINY, streams=())
    found = []
    for suite, settings in ((("cross", "pass-by"), TINY), (str(tmp_path), ())):
        env = make("blob", suite, set=settings, decision_every=8)
        for seed in range(3):
            _, info = env.reset(seed=seed, options={"scenario": "pass-by", "seed": 1})
            assert (info["scenario"], info["seed"]) == ("pass-by", 1)
        found.append(played(env, options={"scenario": "pass-by", "seed": 1}))
    assert found[0][1] == pytest.approx(found[1][1], abs=1e-3)


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
    whole = simulate(load("pass-by", TINY), 1, 0, ())
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
