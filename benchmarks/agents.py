"""Do agents of a library for reinforcement learning change a tracker's parameters better than linear policies?

    python -m benchmarks agents [TRACKER …] [--algorithms PPO SAC linear] [--training-seeds 5] [--configs 24]
        [--reward window] [--train 0:2] [--seeds 20000:20003] [--environments DIR] [--json FILE] [--chart FILE.svg]

PPO and SAC of stable-baselines3 learn on the scenes, with the parameters, the interval of decisions, the limit of
residuals and the number of episodes that the searches of `benchmarks.adaptation` have; `linear` is the policy from a
response surface (`tracking.tuning.adaptive`), which `tune --adaptive` finds. All learn once with each training seed and
are then played on the test seeds of `drift`, `drift-other` (changes of other kinds) and `standard` (no changes), the
agents without exploring. Scores are the objective (mean of HOTA and group_F1), means over the training seeds;
differences from the tracker's defaults are paired by scene, with 95 % intervals over scenes.

The networks are small (32, 32), as a budget of this size feeds no larger ones. What is not named in SETTINGS is the
library's default, which for PPO is that of Schulman et al. (2017) and for SAC that of Haarnoja et al. (2018) but for
the batch. Agents begin near a residual of 0. Numbers of PyTorch depend on the processor. What has been learned is kept
in the JSON file by tracker, algorithm and training seed, so that a run goes on after it was stopped. --chart: mean
objective of the training episodes by round, of the first tracker.
"""

from __future__ import annotations

import json
import time
import warnings
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
from gymnasium.spaces import Box

from benchmarks.adaptation import (
    LIMIT,
    SEARCHED,
    SUITES,
    Bench,
    Scene,
    Search,
    playable,
    rounds_of,
    scenes,
    training_scenes,
)
from benchmarks.peers.environments import DEFAULT, make_environments
from benchmarks.support import chart
from benchmarks.support.options import add_seeds, add_trackers, new_parser, one_thread, seeds_text
from benchmarks.support.tables import difference_cell, head, mean_cell, row
from scenarios.errors import InputError
from sim.types import Array
from tracking.environment.env import Floats, Reward
from tracking.running.policy import Policy
from tracking.tuning.adaptive import EVERY, searched_policy

ALGORITHMS = "PPO", "SAC", "linear"
GAMMA: dict[Reward, float] = {"window": 0.99, "prefix": 1.0}
NETWORK = [32, 32]
SETTINGS: dict[str, dict[str, Any]] = {
    # the standard deviation exp(-1) of an action is a residual of 0.15
    "PPO": {"n_steps": 512, "batch_size": 64, "policy_kwargs": {"net_arch": NETWORK, "log_std_init": -1.0}},
    "SAC": {"learning_starts": 500, "batch_size": 128, "policy_kwargs": {"net_arch": NETWORK}},
}
UNLIMITED = 10**9  # steps: the number of episodes ends the training
Play = Callable[[Scene], float]  # returns the objective of an episode
Run = dict[str, Any]  # "curve": mean objective of each round; by suite the objective by scene


class Training(gymnasium.Env[Floats, Any]):
    """All training scenes, each once in a round, in an order that is drawn anew.

    An action sets the parameters that are searched; 1 stands for the residual LIMIT. Rewards are divided by the share
    of a step in the scene, so that they are of the size of a score.

    State: the environment of the present scene; the scenes that wait in this round; the objectives of all episodes.
    """

    def __init__(self, bench: Bench, among: Sequence[Scene], reward: Reward) -> None:
        self.bench, self.among, self.reward = bench, among, reward
        self.env = bench.env(among[0], reward)
        self.waiting, self.objectives = list[int](), list[float]()
        self.observation_space, self.action_space = self.env.observation_space, Box(-1.0, 1.0, (len(bench.space),))

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Floats, dict[str, Any]]:
        """Begins an episode on the next scene."""
        super().reset(seed=seed)
        self.waiting = self.waiting or self.np_random.permutation(len(self.among)).tolist()
        self.env = self.bench.env(self.among[self.waiting.pop()], self.reward)
        return self.env.reset()

    def step(self, action: Any) -> tuple[Floats, float, bool, bool, dict[str, Any]]:
        """Sets the parameters until the next decision."""
        seen, reward, ended, cut, info = self.env.step(self.bench.action(residuals_of(action)))
        if ended:
            self.objectives.append(info["scores"].get("objective", float("nan")))
        assert self.env.rollout is not None
        assert self.env.decision_every is not None
        return seen, reward * self.env.rollout.length / self.env.decision_every, ended, cut, info


def residuals_of(action: Any) -> Array:
    """Returns the residuals (P,) for an agent's action (P,)."""
    return LIMIT * np.clip(np.asarray(action, float), -1.0, 1.0)


def learned_by_agent(
    bench: Bench, training: Sequence[Scene], algorithm: str, rounds: int, seed: int, reward: Reward
) -> tuple[Array, Play]:
    """Returns the mean objective of each round, and a function that plays a scene by what was learned."""
    import stable_baselines3
    from stable_baselines3.common.callbacks import StopTrainingOnMaxEpisodes

    env = Training(bench, training, reward)
    kind = getattr(stable_baselines3, algorithm)
    agent = kind("MlpPolicy", env, gamma=GAMMA[reward], seed=seed, device="cpu", **SETTINGS[algorithm])
    agent.learn(UNLIMITED, callback=StopTrainingOnMaxEpisodes(rounds * len(training)))
    curve = np.nanmean(np.reshape(env.objectives[: rounds * len(training)], (rounds, -1)), axis=1)

    def act(_: int, seen: Floats) -> Array:
        return residuals_of(agent.predict(seen, deterministic=True)[0])

    return curve, lambda scene: bench.objective(scene, act)


def learned_linear(bench: Bench, training: Sequence[Scene], configs: int, seed: int) -> tuple[Array, Play]:
    """Returns the same of a linear policy."""
    search = Search(bench, training)
    policy, _ = searched_policy(search.play, bench.base, bench.space, configs, seed, lambda text: None)
    return np.array(search.means), partial(played_by, bench, policy)


def played_by(bench: Bench, policy: Policy, scene: Scene) -> float:
    """Returns the objective of an episode that is played by a policy."""
    return bench.play(scene, policy).objective


class Results:
    """What was learned, by "tracker/algorithm/training seed", in a JSON file. State: the runs so far.

    Raises InputError if the file is of other options.
    """

    def __init__(self, path: Path, options: Mapping[str, Any]) -> None:
        self.path, self.options, self.runs = path, dict(options), dict[str, Run]()
        if path.exists():
            found = json.loads(path.read_text())
            if found["options"] != self.options:
                expected, remedy = json.dumps(self.options), "give another file, or the options of this one"
                raise InputError(
                    file=path, place="options", got=json.dumps(found["options"]), expected=expected, remedy=remedy
                )
            self.runs = found["runs"]

    def add(self, key: str, run: Run) -> None:
        """Adds a run and writes the file."""
        self.runs[key] = run
        self.path.parent.mkdir(parents=True, exist_ok=True)
        part = self.path.with_suffix(".part")
        part.write_text(json.dumps({"options": self.options, "runs": self.runs}, indent=1))
        part.replace(self.path)


def learn(name: str, algorithms: Sequence[str], seeds: int, train: range, test: range, results: Results) -> None:
    """Learns with a tracker what is not among the results yet, and plays it on all test scenes."""
    wanted = [(algorithm, seed) for algorithm in algorithms for seed in range(seeds)]
    missing = [pair for pair in (("defaults", 0), *wanted) if f"{name}/{pair[0]}/{pair[1]}" not in results.runs]
    if not missing:
        return
    bench, configs, reward = Bench(name), results.options["configs"], results.options["reward"]
    training = training_scenes(bench, train)
    for algorithm, seed in missing:
        begun = time.perf_counter()
        if algorithm == "defaults":
            curve, play = np.zeros(0), partial(played_by, bench, bench.still)
        elif algorithm == "linear":
            curve, play = learned_linear(bench, training, configs, seed)
        else:
            curve, play = learned_by_agent(bench, training, algorithm, rounds_of(configs), seed, reward)
        run: Run = {"curve": curve.tolist()}
        for suite in SUITES:
            found = playable(bench, scenes(suite, test))
            run[suite] = {f"{s.source.name}/{s.source.seed}": play(s) for s in found}
        results.add(f"{name}/{algorithm}/{seed}", run)
        means = ", ".join(f"{suite} {np.nanmean([*run[suite].values()]):.3f}" for suite in SUITES)
        print(f"{name}, {algorithm}, seed {seed}: {means}; {(time.perf_counter() - begun) / 60:.1f} min", flush=True)


def compare(name: str, algorithms: Sequence[str], seeds: int, results: Results) -> None:
    """Prints the tables of one tracker."""
    for suite in SUITES:
        still = results.runs[f"{name}/defaults/0"][suite]
        print(f"\n{name}, {suite}: {len(still)} scenes, {seeds} training seeds")
        head(["parameters", "objective", "beside the defaults", "training seeds: least, most"])
        row(["defaults", mean_cell(list(still.values())), "–", "–"])
        for algorithm in algorithms:
            every = [results.runs[f"{name}/{algorithm}/{seed}"][suite] for seed in range(seeds)]
            found = np.array([[one[scene] for scene in still] for one in every])  # (seeds, scenes)
            means, ends = found.mean(axis=0), np.nanmean(found, axis=1)
            gain = means - np.array(list(still.values()))
            row([algorithm, mean_cell(means), difference_cell(gain), f"{ends.min():.3f}, {ends.max():.3f}"])


def draw(name: str, algorithms: Sequence[str], seeds: int, results: Results, path: Path) -> None:
    """Draws the learning curves of one tracker: means over the training seeds, and from the least to the most."""
    curves = {}
    for algorithm in algorithms:
        found = np.array([results.runs[f"{name}/{algorithm}/{seed}"]["curve"] for seed in range(seeds)])
        curves[algorithm] = (found.mean(axis=0), found.min(axis=0), found.max(axis=0))
    x = list(range(1, 1 + rounds_of(results.options["configs"])))
    chart.lines([chart.Panel(f"{name}, training episodes", x, curves, "rounds", "objective")], path)


def main() -> None:
    parser = new_parser(__doc__)
    add_trackers(parser, SEARCHED, "group-pda and blob")
    parser.add_argument("--algorithms", nargs="+", choices=ALGORITHMS, default=ALGORITHMS, help="what learns")
    parser.add_argument("--training-seeds", type=int, default=5, help="how often each learns")
    parser.add_argument("--configs", type=int, default=24, help="budget: as of `benchmarks.adaptation`")
    parser.add_argument("--reward", choices=GAMMA, default="window", help="of the environment")
    add_seeds(parser, "0:2", "--train", "of training: ")
    add_seeds(parser, "20000:20003", what="of test: ")
    parser.add_argument("--environments", type=Path, default=DEFAULT, metavar="DIR", help="folder of the libraries")
    parser.add_argument("--json", type=Path, default=Path("agents.json"), metavar="FILE", help="what was learned")
    parser.add_argument("--chart", type=Path, help="picture of the learning curves")
    given = parser.parse_args()
    warnings.simplefilter("ignore")
    one_thread()
    found = make_environments(given.environments, ("roboflow", "stable-baselines3"))
    if set(given.algorithms) - {"linear"} and not found["stable-baselines3"]:
        remedy = "see what pip says, or give --algorithms linear"
        raise InputError(place="--algorithms", got="no stable-baselines3", expected="the library", remedy=remedy)
    options = {
        "configs": given.configs, "reward": given.reward, "train": seeds_text(given.train),
        "test": seeds_text(given.seeds), "every": EVERY, "limit": LIMIT,
    }  # fmt: skip
    results = Results(given.json, options)
    for k, name in enumerate(given.trackers or ("group-pda", "blob")):
        learn(name, given.algorithms, given.training_seeds, given.train, given.seeds, results)
        compare(name, given.algorithms, given.training_seeds, results)
        if k == 0 and given.chart is not None:
            draw(name, given.algorithms, given.training_seeds, results, given.chart)


if __name__ == "__main__":
    main()
