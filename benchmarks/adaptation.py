"""Does it pay to change a tracker's parameters while it runs?

    python -m benchmarks adaptation [TRACKER …] [--configs 24] [--train 0:2] [--seeds 20000:20003]
        [--environments DIR] [--chart FILE.svg] [--out FIGURE.svg]

Trackers are played on the suite `drift`, whose detector changes twice within a minute, and on `quick`, where nothing
changes. All searches play these training scenes equally often, each time with one set of parameters, and choose what
has the best mean objective (mean of HOTA and group_F1). Then on the test seeds of `drift`, of `drift-other`, which has
changes of other kinds, and of `standard`, where nothing changes; differences from the best constant, paired by scene,
with 95 % intervals:

defaults           the tracker's own
random, TPE, CMA   constants drawn round the defaults, by Optuna's TPE and by its CMA-ES; the best in training of all
                   three is the best constant
TPE, twice         by TPE with the rounds that a policy has beside those of a constant

and residuals round the best constant, with rounds of their own:

rule               three lines: the noise of positions follows the residuals, the probability of detection the share of
                   tracks that are found, false alarms the detections that belong to no track
linear by CMA      linear in four statistics, whose weights Optuna's CMA-ES searches
policy             linear, from a response surface (`tracking.tuning.adaptive`), as `tune --adaptive` finds it

What could be gained is told by `benchmarks hindsight`. SORT and ByteTrack are those of roboflow `trackers`
(benchmarks/peers). --chart: the best training value over the
searches; --out: what the policy does in the first test episode. Each of the first tracker.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.peers.adapters import PEERS, ByteTrackConfig, SortConfig
from benchmarks.peers.environments import DEFAULT, make_environments
from benchmarks.support import chart
from benchmarks.support.options import add_seeds, add_trackers, new_parser, one_thread
from benchmarks.support.tables import difference_cell, head, mean_cell, row
from scenarios.errors import OrderError
from scenarios.schema.schedule import Schedule
from scenarios.schema.values import Model
from sim.draws import drawn
from sim.types import Array
from tracking.config import Config
from tracking.environment.env import Floats, Reward, TuningEnv
from tracking.episodes.episode_cache import SourceCache
from tracking.episodes.sources import Source, sources
from tracking.parameter_space import decode, moved, space_of
from tracking.running.policy import BIAS, Policy
from tracking.running.signals import NAMES
from tracking.running.tracker_registry import config_class, find
from tracking.tuning.adaptive import (
    EVERY,
    FITS,
    MEMORY,
    Played,
    drawn_residuals,
    mean_objective,
    play_policy,
    searched_policy,
)

TRACKERS = "blob", "group-pda", "SORT", "ByteTrack"
TRAINING, SUITES = ("drift", "quick"), ("drift", "drift-other", "standard")
LIMIT, SEED = 0.4, 0  # of the rule; of the searches
SCENES = 2**31  # bytes of scenes that are kept
SPREAD = 0.3  # standard deviation with which CMA-ES begins; of a linear policy, for statistics of unit variance
TOLD = ("observed", "found", "extra", "residual")  # statistics of the linear policy that CMA-ES searches
MARKS = (1, 8, 16, 24, 32, 48, 64, 88)  # rounds of a search that are printed
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
    "SORT": tuple(SortConfig.params()),
    "ByteTrack": tuple(ByteTrackConfig.params()),
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
    "SORT": {
        "minimum_iou_threshold": {"residual": -1.0, "bias": 0.45}, "lost_track_buffer": {"found": -0.5, "bias": 0.45},
        "minimum_consecutive_frames": {"extra": 0.6, "bias": -0.15},
    },
    "ByteTrack": {
        "minimum_iou_threshold": {"residual": -1.0, "bias": 0.45}, "lost_track_buffer": {"found": -0.5, "bias": 0.45},
        "minimum_consecutive_frames": {"extra": 0.6, "bias": -0.15},
    },
}  # fmt: skip


Given = tuple[Policy, Array]  # a policy, and what is added to its residuals (P,)


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

    def __init__(self, name: str) -> None:
        self.tracker, self.cache = find(PEERS[name][1] if name in PEERS else name), SourceCache(SCENES)
        kind = config_class(self.tracker, name)
        known = space_of(kind, "file", online=True)
        self.searched = np.array([p.name in SEARCHED[name] for p in known])  # of the parameters of an action
        self.space = tuple(p for p in known if p.name in SEARCHED[name])
        self.base = kind()
        self.still = self.constant(self.base)

    def constant(self, config: Config) -> Policy:
        """Returns the policy that keeps a config."""
        return Policy(config, EVERY, MEMORY, {p.name: {} for p in self.space})

    def env(self, scene: Scene, reward: Reward = "window") -> TuningEnv:
        """Returns an environment of one scene."""
        fps = self.cache.open(scene.source).sequence.fps
        return TuningEnv(
            self.tracker, scene.source, detections="file", decision_every=max(round(EVERY * fps), 1), cache=self.cache,
            tracker_seed=scene.source.seed, reward=reward,
        )  # fmt: skip

    def play(self, scene: Scene, policy: Policy, offset: Array | None = None) -> Played:
        """Plays an episode."""
        return play_policy(self.env(scene), policy, offset)

    def action(self, residuals: Array) -> Array:
        """Returns the action of an environment for the residuals (P,) of the searched parameters."""
        found = np.zeros(len(self.searched))
        found[self.searched] = residuals
        return found

    def objective(self, scene: Scene, act: Callable[[int, Floats], Array]) -> float:
        """Returns the objective of an episode. act: returns residuals (P,) for the number of a decision, from 0, and
        what is observed then."""
        env, ended, k, info = self.env(scene), False, 0, dict[str, Any]()
        seen, _ = env.reset()
        while not ended:
            seen, _, ended, _, info = env.step(self.action(act(k, seen)))
            k += 1
        return float(info["scores"].get("objective", np.nan))


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


def training_scenes(bench: Bench, seeds: range) -> list[Scene]:
    """Returns the scenes on which all searches are trained, those that change first."""
    return [scene for suite in TRAINING for scene in playable(bench, scenes(suite, seeds))]


class Search:
    """Plays sets of parameters on all training scenes. State: `means`, the mean objective of each round."""

    def __init__(self, bench: Bench, training: Sequence[Scene]) -> None:
        self.bench, self.training, self.means = bench, training, list[float]()

    def play(self, policy: Policy, offset: Array) -> list[Played]:
        """Returns what a policy plays; offset (P,): is added to its residuals."""
        found = [self.bench.play(scene, policy, offset) for scene in self.training]
        self.means.append(mean_objective(found))
        return found

    @property
    def best(self) -> list[float]:
        """The best mean objective after each round."""
        return np.maximum.accumulate(self.means).tolist()  # type: ignore[no-any-return]


def by_optuna(
    search: Search, sampler: Any, rounds: int, size: int, made: Callable[[Array], Given]
) -> list[tuple[Given, list[Played]]]:
    """Returns what is made of each of `rounds` vectors (size,) in [-1, 1], 0 first, that a sampler of Optuna asks for,
    and what it plays; made(vector): a policy and its offset."""
    import optuna

    optuna.logging.set_verbosity(optuna.logging.ERROR)
    study = optuna.create_study(direction="maximize", sampler=sampler)
    names = [f"x{k}" for k in range(size)]
    study.enqueue_trial(dict.fromkeys(names, 0.0))
    found = []
    for _ in range(rounds):
        trial = study.ask()
        given = made(np.array([trial.suggest_float(name, -1.0, 1.0) for name in names]))
        played = search.play(*given)
        study.tell(trial, mean_objective(played))
        found.append((given, played))
    return found


def cma(size: int) -> Any:
    """Returns Optuna's CMA-ES that begins at 0."""
    from optuna.samplers import CmaEsSampler

    return CmaEsSampler(
        x0={f"x{k}": 0.0 for k in range(size)}, sigma0=SPREAD, seed=SEED, warn_independent_sampling=False
    )


def linear(bench: Bench, base: Config, mean: Array, sd: Array) -> Callable[[Array], Given]:
    """Returns what makes a policy of weights (P (1 + S),), each of a standardised statistic of TOLD; mean, sd (S,)."""
    still = np.zeros(len(bench.space))

    def made(vector: Array) -> Given:
        rows = {}
        for p, (first, *others) in zip(bench.space, vector.reshape(len(bench.space), -1), strict=True):
            weights = {name: float(w / d) for name, w, d in zip(TOLD, others, sd, strict=True)}
            bias = first - sum(w * m for w, m in zip(weights.values(), mean, strict=True))
            rows[p.name] = {BIAS: float(bias), **weights}
        return Policy(base, EVERY, MEMORY, rows, LIMIT), still

    return made


def adaptation(name: str, configs: int, train: range, seeds: range, picture: Path | None, curve: Path | None) -> None:
    """Prints the tables of one tracker."""
    from optuna.samplers import TPESampler

    bench = Bench(name)
    training = training_scenes(bench, train)
    size, still = len(bench.space), np.zeros(len(bench.space))
    rounds = rounds_of(configs)
    searches = {key: Search(bench, training) for key in ("random", "TPE", "CMA", "linear by CMA", "policy")}
    drawn = drawn_residuals(bench.space, rounds, np.random.default_rng(SEED))
    longer = by_optuna(searches["TPE"], TPESampler(seed=SEED), 2 * rounds, size, lambda x: (bench.still, x))
    pools = {
        "random": [((bench.still, each), searches["random"].play(bench.still, each)) for each in drawn],
        "TPE": longer[:rounds],
        "CMA": by_optuna(searches["CMA"], cma(size), rounds, size, lambda x: (bench.still, x)),
    }
    best = {key: best_of(pool) for key, pool in {**pools, "TPE, twice": longer}.items()}
    constant = max(pools, key=lambda key: mean_objective(best[key][1]))
    base = decode(bench.space, moved(bench.space, best[constant][0][1], bench.base), bench.base)
    policy, _ = searched_policy(searches["policy"].play, base, bench.space, configs, SEED, lambda text: None)
    seen = np.concatenate([one.seen[:-1] for one in best[constant][1]])[:, [NAMES.index(each) for each in TOLD]]
    weighted = linear(bench, base, seen.mean(axis=0), np.maximum(seen.std(axis=0), 0.01))
    dimensions = size * (1 + len(TOLD))
    lines = by_optuna(searches["linear by CMA"], cma(dimensions), rounds, dimensions, weighted)
    rule = Policy(base, EVERY, MEMORY, RULES[name], LIMIT)
    known = {
        "defaults": (bench.still, still), **{key: given for key, (given, _) in best.items()}, "rule": (rule, None),
        "linear by CMA": best_of(lines)[0], "policy": (policy, None),
    }  # fmt: skip
    print(f"\n{name}: {rounds} rounds of {len(training)} training scenes; the best constant is that of {constant}")
    head(["search", *(f"{k} rounds" for k in MARKS if k <= 2 * rounds)])
    for key, search in searches.items():
        row([key, *(f"{search.best[k - 1]:.3f}" if k <= len(search.best) else "–" for k in MARKS if k <= 2 * rounds)])
    print(f"\n{policy.to_toml()}", flush=True)
    if curve is not None:
        x = list(range(1, rounds + 1))
        curves = {key: search.best[:rounds] for key, search in searches.items()}
        panel = chart.Panel(f"{name}, training scenes", x, curves, "rounds")
        chart.lines([panel], curve)
    for suite in SUITES:
        test = playable(bench, scenes(suite, seeds))
        found = {key: [bench.play(s, *given).objective for s in test] for key, given in known.items()}
        settled = np.isfinite(list(found.values())).all(axis=0)
        print(f"\n{name}, {suite}: {settled.sum()} scenes", flush=True)
        head(["parameters", "objective", "beside the best constant"])
        for key, values in found.items():
            gain = np.array(values)[settled] - np.array(found[constant])[settled]
            row([key, mean_cell(np.array(values)[settled]), difference_cell(gain) if key != constant else "–"])
        if suite == "drift":
            head(["entry", *found])
            for entry in dict.fromkeys(s.source.name for s in test):
                mine = [k for k, s in enumerate(test) if s.source.name == entry]
                row([entry, *(f"{np.mean([values[k] for k in mine]):.3f}" for values in found.values())])
        if suite == "drift" and picture is not None:
            draw(bench, test[0], policy, picture)


def rounds_of(configs: int) -> int:
    """Returns how often the search for a linear policy plays all training scenes."""
    return configs + configs // 2 + 2 * len(FITS)


def best_of(pool: Sequence[tuple[Given, list[Played]]]) -> tuple[Given, list[Played]]:
    """Returns what has the best mean objective."""
    return max(pool, key=lambda one: mean_objective(one[1]))


def draw(bench: Bench, scene: Scene, policy: Policy, out: Path) -> None:
    """Draws what a policy sees and does in one episode."""
    import matplotlib
    from matplotlib.figure import Figure

    played, still = bench.play(scene, policy), bench.play(scene, bench.constant(policy.base))
    t = EVERY * np.arange(len(played.seen))
    moved = np.array([policy.residual(seen) for seen in played.seen])
    panels = (
        ("statistics, averaged", t, {name: played.seen[:, NAMES.index(name)] for name in TOLD}),
        ("residual of a parameter", t, {p.name: column for p, column in zip(policy.space, moved.T, strict=True)}),
        ("objective of a window", t[1:], {"policy": played.score, "best constant": still.score}),
    )
    with matplotlib.rc_context(chart.STYLE):
        figure = Figure(figsize=(9.6, 8.0), layout="constrained")
        for axes, (words, x, curves) in zip(figure.subplots(3, 1, sharex=True), panels, strict=True):
            for k, (name, values) in enumerate(curves.items()):
                axes.plot(x, values, "-" if k < len(chart.COLOURS) else ":", color=chart.colour(k), label=name)
            for at in scene.changes:
                axes.axvline(at, color="#777", linestyle="--", linewidth=1)
            axes.set_ylabel(words)
            axes.legend(loc="center left", bbox_to_anchor=(1.0, 0.5), frameon=False)
        axes.set_xlabel(f"s, {scene.source.name} seed {scene.source.seed}; dashed: the detector changes")
        figure.savefig(out, metadata={"Date": None})


def main() -> None:
    parser = new_parser(__doc__)
    add_trackers(parser, SEARCHED)
    parser.add_argument("--configs", type=int, default=24, help="constants that a policy is learned from")
    add_seeds(parser, "0:2", "--train", "of training: ")
    add_seeds(parser, "20000:20003", what="of test: ")
    parser.add_argument("--environments", type=Path, default=DEFAULT, metavar="DIR", help="folder of the libraries")
    parser.add_argument("--chart", type=Path, help="picture of the searches")
    parser.add_argument("--out", type=Path, help="picture of what the policy does")
    given = parser.parse_args()
    warnings.simplefilter("ignore")
    one_thread()
    make_environments(given.environments, ("cmaes", "roboflow"))
    for k, tracker in enumerate(given.trackers or TRACKERS):
        pictures = (given.out, given.chart) if k == 0 else (None, None)
        adaptation(tracker, given.configs, given.train, given.seeds, *pictures)


if __name__ == "__main__":
    main()
