"""Does the environment fit those who do reinforcement learning, and what does a step cost?

    python -m benchmarks environment [TRACKER …] [--episodes 1000] [--seed 0] [--environments DIR]

Four tables:

- Each tracker and each of its action spaces: Gymnasium's `check_env` with warnings as errors; a pickled copy in the
  middle of an episode goes on to the same bits; synchronous vectors in the three modes of autoreset, asynchronous ones,
  and DummyVecEnv and SubprocVecEnv of stable-baselines3 play the episodes of single environments; Gymnasium's wrappers.
- Random episodes: a tracker, a scene of `quick`, an action space, a reward, a number of frames between decisions, and a
  way to act are drawn, among them corners of the ranges and numbers outside. Observations lie in their space, rewards
  are finite, those of prefixes sum to the objective, those of windows are `tracking.evaluate` of the window times its
  share (compared in episodes of at most WINDOWS steps). An episode is stopped after LONGEST CPU seconds: at some
  corners of its ranges a tracker keeps whatever was measured, and takes each for a companion of all others.
- CPU time of a step with a decision in each frame, by fifth of an episode of `street`.
- CPU time of an episode as a step of the environment, which is how `tune` plays it, beside the same without one.
"""

from __future__ import annotations

import pickle
import time
import warnings
from collections import Counter
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
from gymnasium.spaces import Box
from gymnasium.utils.env_checker import check_env
from gymnasium.vector import AsyncVectorEnv, AutoresetMode, SyncVectorEnv
from gymnasium.wrappers import (
    FrameStackObservation,
    NormalizeObservation,
    RecordEpisodeStatistics,
    RescaleAction,
    TimeLimit,
)

import tracking
from benchmarks.peers.adapters import PEERS
from benchmarks.peers.environments import DEFAULT, make_environments
from benchmarks.support.options import add_trackers, new_parser, one_thread
from benchmarks.support.tables import head, row
from benchmarks.support.timing import machine_load, stopped_after
from scenarios.errors import FlockscopeError
from sim.types import Array
from tracking.environment.env import Actions, TuningEnv
from tracking.episodes.episode import Episode, sources
from tracking.episodes.episode_cache import SourceCache
from tracking.episodes.parallel_episodes import EpisodeTask, play_task
from tracking.episodes.tuned_tracker import tuned_tracker
from tracking.parameter_space import decode_and_build
from tracking.running.tracker_registry import names
from tracking.tuning.episode_player import stepped

ID = "tracking:flockscope/Tuning-v0"
SPACES: tuple[Actions, ...] = "residual", "absolute", "presets"
TINY = "camera.fps=5", "duration=3"  # 15 frames, two decisions
EVERY, SEEDS = 8, (1, 2)  # frames between decisions; of two episodes
SCENES, FIRST = "quick", 30_000  # of random episodes; their first seed
INTERVALS = None, 1, 3, 10, 50, 10_000
WINDOWS = 12
LONGEST = 60  # CPU seconds of a random episode
TIMED, STEPS, PAIRS = ["blob", "group-pda", "SORT"], ("street", [0], ["duration=20"]), 15
Make = Callable[[], gymnasium.Env[Any, Any]]
Played = tuple[list[Array], list[float]]


class TooLongError(FlockscopeError):
    """An episode takes too long; what runs the tracker lets it pass."""


def actions_of(env: Any, count: int) -> list[Any]:
    """Returns actions, the same for each environment of one action space."""
    rng = np.random.default_rng(0)
    if isinstance(env.action_space, Box):
        return list(rng.uniform(-0.4, 0.4, (count, *env.action_space.shape)).astype(np.float32))
    return list(rng.integers(0, env.action_space.n, count))


def played(env: Any, seed: int) -> Played:
    """Returns the observations and rewards of an episode."""
    seen, _ = env.reset(seed=seed)
    every, rewards, ended, cut = [seen], list[float](), False, False
    for action in actions_of(env, 100):
        seen, reward, ended, cut, _ = env.step(action)
        every.append(seen)
        rewards.append(float(reward))
        if ended or cut:
            break
    assert ended, "the episode ends"
    return every, rewards


def copied(make: Make) -> None:
    """A pickled copy goes on as the original."""
    env: Any = make().unwrapped
    env.reset(seed=SEEDS[0])
    first, *others = actions_of(env, 4)
    env.step(first)
    other = pickle.loads(pickle.dumps(env))
    for action in others:
        (seen, *rest), (seen2, *rest2) = env.step(action), other.step(action)
        assert np.array_equal(seen, seen2)
        assert rest == rest2
        if rest[1]:
            assert np.array_equal(env.reset()[0], other.reset()[0])


def in_vector(kind: Any, **options: Any) -> Callable[[Make], None]:
    """Returns a check of a vector of Gymnasium beside single environments."""

    def check(make: Make) -> None:
        envs = kind([make] * 2, **options)
        try:
            single = [played(make(), seed) for seed in SEEDS]
            envs.reset(seed=list(SEEDS))
            steps = [envs.step(np.stack([action] * 2)) for action in actions_of(make(), len(single[0][1]))]
            assert np.array_equal([step[1] for step in steps], np.transpose([one[1] for one in single]))
            assert steps[-1][2].all()
            last = steps[-1][4]["final_obs"] if "final_obs" in steps[-1][4] else steps[-1][0]
            assert np.array_equal(np.stack(list(last)), [one[0][-1] for one in single])
            if options.get("autoreset_mode") == AutoresetMode.DISABLED:
                envs.reset(options={"reset_mask": np.array([True, True])})
            assert not envs.step(np.stack([actions_of(make(), 1)[0]] * 2))[2].any()
        finally:
            envs.close()

    return check


def in_library(name: str) -> Callable[[Make], None]:
    """Returns a check of a vector of stable-baselines3 beside single environments."""

    def check(make: Make) -> None:
        from stable_baselines3.common import vec_env

        envs = getattr(vec_env, name)([make] * 2)
        try:
            single = [played(make(), seed) for seed in range(2)]
            envs.seed(0)
            envs.reset()
            for k, action in enumerate(actions_of(make(), len(single[0][1]))):
                _, rewards, ended, infos = envs.step(np.stack([action] * 2))
                assert np.array_equal(np.float32(rewards), np.float32([one[1][k] for one in single]))
            assert ended.all()
            for one, info in zip(single, infos, strict=True):
                assert np.array_equal(info["terminal_observation"], one[0][-1])
        finally:
            envs.close()

    return check


def wrapped(make: Make) -> None:
    """Wrappers of Gymnasium change what they are for."""
    plain = played(make(), 1)
    recorded = RecordEpisodeStatistics(make())
    played(recorded, 1)
    assert list(recorded.return_queue) == [sum(plain[1])]
    stacked = played(FrameStackObservation(make(), 2), 1)[0]
    assert all(np.array_equal(seen[1], alone) for seen, alone in zip(stacked, plain[0], strict=True))
    assert all(np.isfinite(seen).all() for seen in played(NormalizeObservation(make()), 1)[0])
    short = TimeLimit(make(), 1)
    short.reset(seed=1)
    assert short.step(actions_of(short, 1)[0])[2:4] == (False, True)
    if isinstance(make().action_space, Box):
        other = RescaleAction(make(), np.float32(0), np.float32(1))
        middle = np.full(other.action_space.shape, 0.5, np.float32)
        zero: Any = make()
        assert np.array_equal(other.reset(seed=1)[0], zero.reset(seed=1)[0])
        assert np.array_equal(other.step(middle)[0], zero.step(0 * middle)[0])


CHECKS: Mapping[str, Callable[[Make], None]] = {
    "check_env": lambda make: check_env(make().unwrapped, skip_render_check=True),
    "pickled": copied,
    **{f"sync, {mode.value}": in_vector(SyncVectorEnv, autoreset_mode=mode) for mode in AutoresetMode},
    "async": in_vector(AsyncVectorEnv),
    "DummyVecEnv": in_library("DummyVecEnv"),
    "SubprocVecEnv": in_library("SubprocVecEnv"),
    "wrappers": wrapped,
}


def check_all(trackers: tuple[str, ...]) -> None:
    """Prints for each tracker and action space which checks it passes."""
    print("\nChecks: yes, or the error")
    head(["tracker", "actions", *CHECKS])
    for tracker in trackers:
        for actions in SPACES:
            presets = [{}, {}] if actions == "presets" else []

            def make(tracker: str = tracker, actions: Actions = actions, presets: list[Any] = presets) -> Any:
                return gymnasium.make(
                    ID, tracker=tracker, suite="cross", seeds=range(3), set=TINY, decision_every=EVERY, actions=actions,
                    presets=presets,
                )  # fmt: skip

            row([f"`{tracker}`", actions, *(verdict(check, make) for check in CHECKS.values())])


def verdict(check: Callable[[Make], None], make: Make) -> str:
    """Returns "yes" if a check passes, else its error."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            check(make)
    except Exception as error:  # what fails is the result
        return f"{type(error).__name__}: {str(error).splitlines()[0][:80] if str(error) else ''}"
    return "yes"


def random_episodes(trackers: tuple[str, ...], count: int, seed: int) -> None:
    """Prints how many random episodes were played, and what was wrong with them."""
    cache = SourceCache(2**30)
    overtime = TooLongError(got=f"more than {LONGEST} CPU seconds", expected="less", remedy="none")
    done, steps, long, wrong = (Counter[str]() for _ in range(4))
    for k in range(count):
        rng = np.random.default_rng((seed, k))  # so that an episode can be played alone
        tracker = str(rng.choice(trackers))
        try:
            with stopped_after(LONGEST, overtime):
                steps[tracker] += random_episode(tracker, rng, cache)
        except TooLongError:
            long[tracker] += 1
            print(f"episode {k}, {tracker}: stopped", flush=True)
        except Exception as error:  # what fails is the result
            wrong[tracker] += 1
            print(f"episode {k}, {tracker}: {type(error).__name__}: {error}", flush=True)
        done[tracker] += 1
    print(f"\n{count} random episodes, seed {seed}")
    head(["tracker", "episodes", "steps", f"stopped after {LONGEST} s", "wrong"])
    for tracker in trackers:
        row([f"`{tracker}`", *(str(counter[tracker]) for counter in (done, steps, long, wrong))])


def random_episode(tracker: str, rng: np.random.Generator, cache: SourceCache) -> int:
    """Plays a random episode and returns its number of steps. Raises AssertionError if it is wrong."""
    every, actions = INTERVALS[rng.integers(len(INTERVALS))], SPACES[rng.integers(len(SPACES))]
    reward = "prefix" if rng.random() < 0.5 else "window"
    options: dict[str, Any] = {
        "seeds": [FIRST + int(rng.integers(20))], "set": ["camera.fps=5"], "decision_every": every, "cache": cache,
        "reward": reward, "margin": float(rng.choice([0.0, 0.3, 1.0, 100.0])), "tracker_seed": int(rng.integers(100)),
    }  # fmt: skip
    if actions == "presets":
        plain = TuningEnv(tracker, SCENES, **options)
        places = rng.uniform(-1, 1, (3, len(plain.space)))
        options["presets"] = [
            decode_and_build(plain.space, place, plain.defaults, lambda config: config) for place in places
        ]
    env = TuningEnv(tracker, SCENES, actions=actions, **options)
    way = rng.integers(5)
    seen, info = env.reset(seed=int(rng.integers(1000)))
    assert env.observation_space.contains(seen), "an observation lies in its space"
    total, rewards, ended = 0.0, list[tuple[range, float]](), False
    while not ended:
        first = info["frame"] + 1
        seen, got, ended, cut, info = env.step(drawn_action(env, way, rng))
        assert env.observation_space.contains(seen), "an observation lies in its space"
        assert np.isfinite(got), "a reward is finite"
        assert not cut, "no episode is cut short"
        total += got
        rewards.append((range(first, info["frame"] + 1), got))
    assert env.rollout is not None
    if reward == "prefix" or every is None:
        assert abs(total - info["objective"]) < 1e-9, f"rewards sum to {total}, not to {info['objective']}"
    else:
        assert -1e-12 <= total <= 1 + 1e-9, f"rewards sum to {total}"
        if len(rewards) <= WINDOWS:
            for frames, got in rewards:
                expected = window_reward(env, frames)
                assert abs(got - expected) < 1e-9, f"the reward of frames {frames} is {got}, not {expected}"
    return len(rewards)


def window_reward(env: TuningEnv, frames: range) -> float:
    """Returns the reward of a window by `tracking.evaluate`."""
    assert env.rollout is not None
    truth, first = env.rollout.truth, max(frames[0] - round(env.margin * env.rollout.sequence.fps), 1)
    tracks = env.rollout.tracks[: frames[-1]]
    if not any(len(t.id) for t in tracks[first - 1 :]) and truth.rows(first).start == truth.rows(frames[-1]).stop:
        found = 1.0
    else:
        found = tracking.evaluate(truth, tracks, frames=range(first, frames[-1] + 1))["objective"]
    return (1.0 if np.isnan(found) else found) * len(frames) / env.rollout.length


def drawn_action(env: TuningEnv, way: int, rng: np.random.Generator) -> Any:
    """Returns an action: inside the ranges, at corners, outside, at one corner throughout, or none."""
    if env.actions == "presets":
        return int(rng.integers(len(env.presets)))
    size = env.action_space.shape
    inside, corner = rng.uniform(-1, 1, size), rng.choice([-1.0, 1.0], size)
    ways = inside, corner, 3 * inside, np.where(np.arange(size[0]) % 2, 1.0, -1.0), np.zeros(size)
    return ways[way].astype(rng.choice([np.float32, np.float64]))


def timed(libraries: Mapping[str, str]) -> dict[str, Any]:
    """Returns by name the trackers of TIMED, without those of libraries that are not installed."""
    found = {name: PEERS[name] for name in TIMED if name in PEERS}
    missing = {name for name, (library, _) in found.items() if not libraries.get(library)}
    return {name: found[name][1] if name in found else name for name in TIMED if name not in missing}


def time_steps(libraries: Mapping[str, str]) -> None:
    """Prints the CPU time of a step of some trackers."""
    suite, seeds, settings = STEPS
    print(f"\nCPU time of a step with decision_every=1, ms: {suite}, {', '.join(settings)}; {machine_load()}")
    head(["tracker", *(f"fifth {k}" for k in range(1, 6)), "tracks: first, last fifth", "last step"])
    for name, tracker in timed(libraries).items():
        env = TuningEnv(tracker, suite, seeds=seeds, set=settings, detections="file", decision_every=1)
        zero, spent, tracks = np.zeros(env.action_space.shape, np.float32), list[float](), list[int]()
        for _ in range(2):  # in the first episode kernels are compiled
            env.reset()
            spent, tracks, ended = [], [], False
            while not ended:
                begun = time.process_time_ns()
                ended = env.step(zero)[2]
                spent.append((time.process_time_ns() - begun) / 1e6)
                assert env.rollout is not None
                tracks.append(len(env.rollout.tracks[-1].id))
        parts, people = np.array_split(spent[:-1], 5), np.array_split(tracks, 5)
        ends = f"{people[0].mean():.1f}, {people[-1].mean():.1f}"
        row([f"`{name}`", *(f"{part.mean():.2f}" for part in parts), ends, f"{spent[-1]:.1f}"])


def compare_ways(libraries: Mapping[str, str]) -> None:
    """Prints how much CPU time it takes to play episodes by steps of the environment. Raises AssertionError if scores
    differ."""
    suite, seeds, settings = STEPS
    print(f"\nCPU time of an episode by a step of the environment, of {PAIRS} pairs: {suite}, {', '.join(settings)}")
    head(["tracker", "episodes, ms", "by steps, ms", "more"])
    (source,) = sources(suite, seeds, settings)
    for name, tracker in timed(libraries).items():
        task = EpisodeTask(tuned_tracker(tracker), source, {}, "file", every_score=False)
        spent: dict[Any, list[float]] = {play_task: [], stepped: []}
        for k in range(PAIRS + 1):  # in the first pair kernels are compiled
            scores = []
            for play, times in spent.items():
                begun = time.process_time_ns()
                found = play(task)
                times += [(time.process_time_ns() - begun) / 1e6] if k else []
                assert isinstance(found, Episode)
                scores.append(found.scores)
            assert scores[0] == scores[1], f"{name}: scores by steps of the environment differ"
        plain, by_steps = (float(np.median(times)) for times in spent.values())
        row([f"`{name}`", f"{plain:.0f}", f"{by_steps:.0f}", f"{by_steps / plain - 1:+.1%}"])


def main() -> None:
    parser = new_parser(__doc__)
    add_trackers(parser, names())
    parser.add_argument("--episodes", type=int, default=1000, help="random episodes")
    parser.add_argument("--seed", type=int, default=0, help="of the random episodes")
    parser.add_argument("--environments", type=Path, default=DEFAULT, metavar="DIR", help="folder of the libraries")
    given = parser.parse_args()
    one_thread()
    libraries = make_environments(given.environments, ("roboflow", "stable-baselines3"))
    trackers = tuple(given.trackers or names())
    check_all(trackers)
    random_episodes(trackers, given.episodes, given.seed)
    time_steps(libraries)
    compare_ways(libraries)


if __name__ == "__main__":
    main()
