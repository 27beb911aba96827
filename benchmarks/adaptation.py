"""Does it pay to change a tracker's parameters while it runs?

    python -m benchmarks adaptation [TRACKER …] [--configs 30] [--train 0:2] [--seeds 20000:20004] [--out FIGURE.svg]

Trackers are played on the suite `drift`, whose detector changes twice within a minute. Configs are drawn round the
defaults, and each plays all training scenes as a constant; everything below is chosen or fitted by these. Objective
(mean of HOTA and group_F1) on the test seeds of `drift`, of `drift-other`, which has changes of other kinds, and of
`standard`, where nothing changes; differences from the best constant, paired by scene, with 95 % intervals:

defaults         the tracker's own
best constant    the config that is best in training
hindsight        for each part of each entry of `drift` the config that was best there in training; it is told when
                 the parts begin, which no tracker knows: what could be gained
rule             three lines: the noise of positions follows the residuals, the probability of detection the share of
                 tracks that are found, false alarms the detections that belong to no track
policy           linear, from a response surface (`tracking.tuning.adaptive`), as `tune --adaptive` finds it
--out: what the policy does in the first test episode, as a picture.
"""

from __future__ import annotations

import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from benchmarks.support.options import add_seeds, new_parser
from benchmarks.support.tables import difference_cell, head, mean_cell, row
from scenarios.errors import OrderError
from scenarios.schema.schedule import Schedule
from scenarios.schema.values import Model
from sim.draws import drawn
from sim.types import Array
from tracking.environment.env import TuningEnv
from tracking.episodes.episode_cache import SourceCache
from tracking.episodes.sources import Source, sources
from tracking.parameter_space import space_of
from tracking.running.policy import Policy
from tracking.running.signals import NAMES
from tracking.running.tracker_registry import config_class, find
from tracking.tuning.adaptive import (
    EVERY,
    MEMORY,
    Played,
    drawn_residuals,
    mean_objective,
    play_policy,
    searched_policy,
)

TRACKERS = "blob", "group-pda"
SUITES = "drift", "drift-other", "standard"
LIMIT, SEED = 0.4, 0  # of the rule; of the search
SCENES = 2**31  # bytes of scenes that are kept
# the parameters that are searched: those of detections, motion and existence
SEARCHED = {
    "blob": (
        "accel_noise", "position_noise", "size_noise", "speed_prior", "gate", "detect_prob", "hidden_time",
        "clutter_rate",
    ),
    "group-pda": (
        "gate", "radius", "accel_noise", "point_noise", "confirm_time", "coast_time", "report_coast", "carry_time",
        "carry_reach",
    ),
    "relational": (
        "noise_scale", "point_noise", "outlier_share", "detect_prob", "hidden_time", "clutter_density", "birth_rate",
    ),
}  # fmt: skip
RULES = {
    "blob": {
        "position_noise": {"residual": 1.0, "bias": -0.45}, "detect_prob": {"found": 0.8, "bias": -0.75},
        "clutter_rate": {"extra": 0.8, "bias": -0.2},
    },
    "group-pda": {
        "point_noise": {"residual": 1.0, "bias": -0.45}, "coast_time": {"found": -0.5, "bias": 0.45},
        "confirm_time": {"extra": 0.6, "bias": -0.15},
    },
    "relational": {
        "point_noise": {"residual": 1.0, "bias": -0.45}, "detect_prob": {"found": 0.8, "bias": -0.75},
        "clutter_density": {"extra": 0.8, "bias": -0.2},
    },
}  # fmt: skip


@dataclass(frozen=True)
class Scene:
    """A scene to play: its source, and the s at which what the detector measures changes."""

    source: Source
    changes: tuple[float, ...]

    def part(self, t: float) -> int:
        """Returns in which part a window that begins at t s lies."""
        return sum(t >= at for at in self.changes)


def scenes(suite: str, seeds: range) -> list[Scene]:
    """Returns the scenes of a suite."""
    found = []
    for source in sources(f"suite:{suite}", seeds):
        assert source.entry is not None
        made = drawn(source.entry.scenario, source.seed, source.entry.repeat)
        found.append(Scene(source, tuple(sorted({at for s in schedules(made) for at in s.at[1:]}))))
    return found


def schedules(table: Model) -> list[Schedule[float]]:
    """Returns all schedules in a table of a scenario."""
    values = [getattr(table, name) for name in type(table).model_fields]
    own = [value for value in values if isinstance(value, Schedule)]
    inner = [value for value in values if isinstance(value, Model) and not isinstance(value, Schedule)]
    return own + [one for each in inner for one in schedules(each)]


class Bench:
    """One tracker: plays its episodes. State: the scenes that are kept."""

    def __init__(self, tracker: str) -> None:
        self.tracker, self.cache = tracker, SourceCache(SCENES)
        kind = config_class(find(tracker), tracker)
        self.space = tuple(p for p in space_of(kind, "file", online=True) if p.name in SEARCHED[tracker])
        self.base = kind()
        self.still = Policy(self.base, EVERY, MEMORY, {p.name: {} for p in self.space})

    def env(self, scene: Scene) -> TuningEnv:
        """Returns an environment of one scene."""
        fps = self.cache.open(scene.source).sequence.fps
        return TuningEnv(
            self.tracker, scene.source, detections="file", decision_every=max(round(EVERY * fps), 1), cache=self.cache,
            tracker_seed=scene.source.seed,
        )  # fmt: skip

    def play(self, scene: Scene, policy: Policy, offset: Array | None = None) -> Played:
        """Plays an episode."""
        return play_policy(self.env(scene), policy, offset)

    def told(self, scene: Scene, residuals: Array, chosen: Mapping[tuple[str, int], int]) -> float:
        """Returns the objective of an episode played by the config that is chosen for each part of the scene."""
        env, ended, t, scores = self.env(scene), False, 0.0, dict[str, float]()
        env.reset()
        columns = [env.space.index(p) for p in self.space]
        while not ended:
            action = np.zeros(len(env.space))
            action[columns] = residuals[chosen[scene.source.name, scene.part(t + EVERY / 2)]]
            _, _, ended, _, info = env.step(action)
            t, scores = t + EVERY, info["scores"]
        return scores["objective"]


def playable(bench: Bench, found: Sequence[Scene]) -> list[Scene]:
    """Returns the scenes whose script comes true."""
    kept = []
    for scene in found:
        try:
            _ = bench.cache.open(scene.source).truth
            kept.append(scene)
        except OrderError:
            print(f"left out: {scene.source.name} seed {scene.source.seed}")
    return kept


def adaptation(tracker: str, configs: int, train: range, seeds: range, out: Path | None) -> None:
    """Prints the tables of one tracker."""
    bench = Bench(tracker)
    training = playable(bench, scenes("drift", train))
    residuals = drawn_residuals(bench.space, configs, np.random.default_rng(SEED))

    def play(policy: Policy, offset: Array) -> list[Played]:
        return [bench.play(scene, policy, offset) for scene in training]

    policy, pool = searched_policy(play, bench.base, bench.space, configs, SEED, lambda text: None)
    best = int(np.argmax([mean_objective(each) for each in pool]))
    parts = best_by_part(training, pool)
    rule = Policy(bench.base, EVERY, MEMORY, RULES[tracker], LIMIT)
    print(f"\n{tracker}: {configs} configs, {len(training)} training scenes", flush=True)
    print(policy.to_toml())
    for suite in SUITES:
        test = playable(bench, scenes(suite, seeds))
        found = {
            "defaults": [bench.play(s, bench.still).objective for s in test],
            "best constant": [bench.play(s, bench.still, residuals[best]).objective for s in test],
        }
        if suite == "drift":
            found["hindsight"] = [bench.told(s, residuals, parts) for s in test]
        found["rule"] = [bench.play(s, rule).objective for s in test]
        found["policy"] = [bench.play(s, policy).objective for s in test]
        known = np.isfinite(list(found.values())).all(axis=0)
        print(f"\n{tracker}, {suite}: {known.sum()} scenes", flush=True)
        head(["parameters", "objective", "beside the best constant"])
        for name, values in found.items():
            gain = np.array(values)[known] - np.array(found["best constant"])[known]
            row([name, mean_cell(np.array(values)[known]), difference_cell(gain) if name != "best constant" else "–"])
        if suite == "drift":
            head(["entry", *found])
            for name in dict.fromkeys(s.source.name for s in test):
                mine = [k for k, s in enumerate(test) if s.source.name == name]
                row([name, *(f"{np.mean([values[k] for k in mine]):.3f}" for values in found.values())])
        if suite == "drift" and out is not None:
            draw(bench, test[0], policy, out)


def best_by_part(training: Sequence[Scene], pool: Sequence[Sequence[Played]]) -> dict[tuple[str, int], int]:
    """Returns the number of the best config in each part of each entry, by name and part."""
    found: dict[tuple[str, int], int] = {}
    for name in dict.fromkeys(scene.source.name for scene in training):
        mine = [k for k, scene in enumerate(training) if scene.source.name == name]
        for part in range(3):
            score = np.zeros(len(pool))
            for k in mine:
                times = EVERY * np.arange(len(pool[0][k].score))
                inside = np.array([training[k].part(t + EVERY / 2) == part for t in times])
                score += [one[k].score[inside].mean() if inside.any() else 0.0 for one in pool]
            found[name, part] = int(np.argmax(score))
    return found


def draw(bench: Bench, scene: Scene, policy: Policy, out: Path) -> None:
    """Draws what a policy sees and does in one episode."""
    from matplotlib.figure import Figure

    played = bench.play(scene, policy)
    t = EVERY * np.arange(len(played.seen))
    moved = [policy.residual(seen) for seen in played.seen]
    figure = Figure(figsize=(8, 7), layout="constrained")
    above, middle, below = figure.subplots(3, 1, sharex=True)
    for name in ("observed", "found", "extra", "residual", "nis"):
        above.plot(t, played.seen[:, NAMES.index(name)], label=name)
    for k, p in enumerate(policy.space):
        middle.plot(t, [one[k] for one in moved], label=p.name)
    below.plot(t[1:], played.score, label="policy")
    below.plot(t[1:], bench.play(scene, bench.still).score, label="defaults")
    for axes, words in ((above, "statistics"), (middle, "residuals"), (below, "objective of a window")):
        for at in scene.changes:
            axes.axvline(at, color="grey", linestyle="--")
        axes.set_ylabel(words)
        axes.legend(fontsize=7, loc="upper left", ncols=2)
    below.set_xlabel(f"s, {scene.source.name} seed {scene.source.seed}")
    figure.savefig(out)


def main() -> None:
    parser = new_parser(__doc__)
    parser.add_argument("trackers", nargs="*", default=TRACKERS, choices=SEARCHED)
    parser.add_argument("--configs", type=int, default=30)
    add_seeds(parser, "0:2", "--train", "of training: ")
    add_seeds(parser, "20000:20004", what="of test: ")
    parser.add_argument("--out", type=Path, help="picture of the first tracker's first test episode")
    given = parser.parse_args()
    warnings.simplefilter("ignore")
    for k, tracker in enumerate(given.trackers):
        adaptation(tracker, given.configs, given.train, given.seeds, given.out if k == 0 else None)


if __name__ == "__main__":
    main()
