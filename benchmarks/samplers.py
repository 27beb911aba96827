"""What does a search reach with its own sampler, and what with Optuna's samplers and pruner, in equal CPU time?

    python -m benchmarks samplers [METHOD …] [--trackers …] [--suites …] [--searches 0:2] [--training 2]
                                  [--trials 30] [--state FILE.json] [--libraries FOLDER]

Each search tunes one tracker on one suite of short scenes, at 2.5 frames/s. Search k has training scenes and test
scenes of its own. All methods begin with the defaults and get the same budget: the CPU seconds in which the search's
own sampler plays 30 trials. Seconds are of the whole loop: sampler, storage, tracker and scores. An episode that
another method has played already is not played again, but its seconds count.

ours             moved parents
ours-wilcoxon    the same; Optuna's WilcoxonPruner stops trials that surely lose to the best one
tpe, tpe-single  Optuna's TPESampler, as it is (multivariate) and univariate
tpe-wilcoxon     TPE, and Optuna's WilcoxonPruner
cma-es           Optuna's CmaEsSampler from the defaults on; categorical parameters are drawn at random
random           Optuna's RandomSampler

The judged figure is the goal (objective; pairwise_F1 for `grouping`) on the test scenes, of the config with the best
mean on the training scenes so far, after a quarter, half and all of the budget. Differences from `ours` are paired over
tracker, suite and search, with 95 % intervals. --state keeps finished searches, so that a run can be continued.
"""

from __future__ import annotations

import json
import time
import warnings
from collections.abc import Callable, Generator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import optuna
from optuna.pruners import WilcoxonPruner
from optuna.samplers import BaseSampler, CmaEsSampler, RandomSampler, TPESampler
from optuna.study import StudyDirection
from optuna.trial import create_trial

from benchmarks.peers.environments import DEFAULT, make_environments
from benchmarks.support.follower import Follower
from benchmarks.support.options import add_seeds, new_parser
from benchmarks.support.replaced_code import Replacement, replaced_code
from benchmarks.support.tables import difference_cell, number, table
from scenarios.errors import FlockscopeError, InputError
from sim.types import Tracker
from tracking.episodes.episode import Episode, Source
from tracking.episodes.parallel_episodes import EpisodeOrError
from tracking.stats import mean_of_known
from tracking.tuning import study
from tracking.tuning.candidates import Goal
from tracking.tuning.episode_player import PlayEpisodes, episode_player
from tracking.tuning.options import TuneOptions
from tracking.tuning.search_plan import SearchPlan, search_plan

FPS = "scenario.camera.fps=2.5"
FRIENDS = Path(study.__file__).parents[2] / "scenarios" / "suites" / "friends-meet"
# By name: tracker, and what is fixed. `joint` is left out and `relational` has few particles, to play many searches.
TRACKERS: dict[str, tuple[str | type[Tracker], tuple[str, ...]]] = {
    "blob": ("blob", ()), "group-pda": ("group-pda", ()), "relational": ("relational", ("particles=50",)),
    "stereo": ("stereo", ()), "Follower": (Follower, ()), "grouping": ("grouping", ()),
}  # fmt: skip
# By name: scenes, and test seeds of each scene.
SUITES: dict[str, tuple[tuple[str, ...], int]] = {
    "crossing": (("crossing",), 2), "events": (("merge", "split", "queue"), 3),
    "friends": (tuple(str(FRIENDS / f"{name}.toml") for name in ("merge", "split", "transfer")), 3),
}  # fmt: skip
PARTS = (0.25, 0.5, 1.0)  # of the budget
MANY = 10**6  # trials, more than any budget buys
REFERENCE = "ours"
LIMIT = 0.1  # p-value below which Optuna's pruner stops a trial


Propose = Callable[[SearchPlan, optuna.Study, int], None]


class SpentError(Exception):
    """The budget of a search is spent."""


class Clock:
    """CPU seconds of a search. State: when it began; added: seconds of episodes that need not be played again."""

    def __init__(self) -> None:
        self.begun, self.added = time.process_time(), 0.0

    def now(self) -> float:
        """Returns the CPU seconds since the search began."""
        return time.process_time() - self.begun + self.added


class Episodes:
    """Plays episodes once. State: each episode that was played, and its CPU seconds, by source and parameters."""

    def __init__(self, play: PlayEpisodes) -> None:
        self.play, self.played = play, dict[object, tuple[EpisodeOrError, float]]()

    def one(self, source: Source, values: Mapping[str, Any], clock: Clock) -> EpisodeOrError:
        """Returns an episode; its seconds are added to the clock if it is not played again."""
        key = (source.key, tuple(values.items()))
        if key in self.played:
            clock.added += self.played[key][1]
        else:
            start = time.process_time()
            (found,) = self.play([source], dict(values), False)
            self.played[key] = found, time.process_time() - start
        return self.played[key][0]

    def until(self, clock: Clock, budget: float, pruner: Pruner | None = None) -> PlayEpisodes:
        """Returns the player of one search, which raises SpentError after `budget` s. A trial that the pruner stops has
        no value."""

        def play(
            sources: Sequence[Source], values: dict[str, Any], every: bool
        ) -> Generator[EpisodeOrError, None, None]:
            played = dict[int, Episode]()
            for k in range(len(sources)) if pruner is None else pruner.order(len(sources)):
                found = self.one(sources[k], values, clock)
                if clock.now() > budget:
                    raise SpentError
                if isinstance(found, FlockscopeError):
                    yield found
                    return
                played[k] = found
                if pruner is not None and pruner.stops(played):
                    yield InputError(place="trial", got="a sure loss", expected="a better one", remedy="none")
                    return
            if pruner is not None:
                pruner.ended(played)
            yield from (played[k] for k in range(len(sources)))

        return play


class Pruner:
    """Optuna's WilcoxonPruner for the trials of a goal. State: number of trials; values of the best whole one by number
    of the scene."""

    def __init__(self, goal: Goal) -> None:
        self.goal, self.trials, self.best = goal, 0, dict[int, float]()
        with study.quiet_optuna():
            self.pruner = WilcoxonPruner(p_threshold=LIMIT)

    def order(self, scenes: int) -> list[int]:
        """Returns the scenes of a new trial in an order of its own, so that no few scenes decide about all trials."""
        self.trials += 1
        return np.random.default_rng(self.trials).permutation(scenes).tolist()  # type: ignore[no-any-return]

    def stops(self, played: Mapping[int, Episode]) -> bool:
        """Returns True if a trial surely loses by the episodes that it has played."""
        now = {k: value for k, value in self._known(played).items() if k in self.best}
        direction = StudyDirection.MAXIMIZE if self.goal.higher else StudyDirection.MINIMIZE
        stand_in: Any = type("Record", (), {"direction": direction, "best_trial": _trial(self.best)})
        return bool(self.best and self.pruner.prune(stand_in, _trial(now)))

    def ended(self, played: Mapping[int, Episode]) -> None:
        """Takes a trial that was played to its end."""
        now = self._known(played)
        if not self.best or self.goal.gain(mean_of_known(self.best.values()), mean_of_known(now.values())) > 0:
            self.best = now

    def _known(self, played: Mapping[int, Episode]) -> dict[int, float]:
        values = {k: self.goal.of(episode) for k, episode in played.items()}
        return {k: value for k, value in values.items() if value == value}


def _trial(values: Mapping[int, float]) -> optuna.trial.FrozenTrial:
    return create_trial(value=0.0, intermediate_values=dict(values))


def by(make: Callable[[SearchPlan, int], BaseSampler]) -> tuple[object, str, Propose]:
    """Returns the change of the search by which one of Optuna's samplers draws all trials but the first. make: returns
    the sampler for a plan and a seed."""

    def propose(plan: SearchPlan, record: optuna.Study, number: int) -> None:
        seed = np.random.SeedSequence([plan.options.seed, number]).generate_state(1)[0]
        record.sampler = make(plan, int(seed))

    return study, "propose", propose


def cma_es(plan: SearchPlan, seed: int) -> BaseSampler:
    """Returns CMA-ES that begins at the defaults."""
    start = {p.name: plan.defaults[p.name] for p in plan.space if p.scale != "categorical"}
    return CmaEsSampler(x0=start, seed=seed, warn_independent_sampling=False)


TPE = by(lambda plan, seed: TPESampler(seed=seed))
# By method: what is replaced in the search, and whether a pruner stops trials.
METHODS: dict[str, tuple[tuple[Replacement, ...], bool]] = {
    REFERENCE: ((), False),
    "ours-wilcoxon": ((), True),
    "tpe": ((TPE,), False),
    "tpe-single": ((by(lambda plan, seed: TPESampler(seed=seed, multivariate=False)),), False),
    "tpe-wilcoxon": ((TPE,), True),
    "cma-es": ((by(cma_es),), False),
    "random": ((by(lambda plan, seed: RandomSampler(seed=seed)),), False),
}


@dataclass(frozen=True)
class Searched:
    """What one search has reached after each part of the budget."""

    trials: int  # finished ones, the defaults included
    seconds: float  # the budget, CPU s
    training: tuple[float, ...]  # value of the best config after each part of the budget
    test: tuple[float, ...]
    defaults: float  # their value on the test scenes


class Cell:
    """One tracker on one suite with the scenes of one search. State: the episodes that were played."""

    def __init__(self, plan: SearchPlan, play: PlayEpisodes) -> None:
        self.plan, self.episodes = plan, Episodes(play)
        self.tests = plan.tests[plan.suite_name]
        for source in (*plan.training, *self.tests):  # simulates the scenes and compiles the kernels
            for _ in play([source], plan.base.as_dict(), False):
                pass

    def searched(self, method: str, trials: int, budget: float) -> Searched:
        """Plays a search until so many trials are finished or the budget, CPU s, is spent."""
        changes, stops = METHODS[method]
        plan = replace(self.plan, options=replace(self.plan.options, trials=trials))
        pruner = Pruner(plan.goals[0]) if stops else None
        clock, ends = Clock(), list[float]()

        def progress(finished: int, planned: int | None, text: str) -> None:
            ends.extend([clock.now()] * (finished - len(ends)))

        with replaced_code(changes), study.open_study(plan, None, "samplers") as made:
            with suppress(SpentError):
                study.run_trials(made, self.episodes.until(clock, budget, pruner), progress)
            spent = min(budget, clock.now())
            records = made.records()[: len(ends)]
        goal, training, test = plan.goals[0], list[float](), list[float]()
        for part in PARTS:
            done = [r for r, end in zip(records, ends, strict=True) if end <= part * spent]
            ranked = [r for r in done if not r.error] or records[:1]
            best = max(ranked, key=lambda r: goal.gain(0.0, r.values[0]))
            training.append(best.values[0])
            test.append(self.tested(best.params))
        return Searched(len(ends), spent, tuple(training), tuple(test), self.tested(plan.defaults))

    def tested(self, params: Mapping[str, Any]) -> float:
        """Returns the mean of the goal over the test scenes; an episode that fails counts 0."""
        values, clock = self.plan.config(dict(params)).as_dict(), Clock()
        found = [self.episodes.one(source, values, clock) for source in self.tests]
        goal = self.plan.goals[0]
        return mean_of_known(0.0 if isinstance(e, FlockscopeError) else goal.of(e) for e in found)


# Tracker, suite, number of the search, training seeds of each scene, trials that the budget is for.
Key = tuple[str, str, int, int, int]
Found = dict[Key, dict[str, Searched]]  # by method


def cell_plan(key: Key) -> SearchPlan:
    """Returns the plan of a search: seeds of the scenes follow from its number."""
    tracker, suite, search, train, _ = key
    (made, fixed), (scenes, test) = TRACKERS[tracker], SUITES[suite]
    first = 20_000 + test * search
    return search_plan(
        TuneOptions(
            tracker=made, suite=scenes, seeds=range(train * search, train * (search + 1)), check=None,
            test=range(first, first + test), set=(FPS, *fixed), seed=search,
        )
    )  # fmt: skip


def play_methods(key: Key, methods: Sequence[str], found: Found, state: Path | None) -> None:
    """Plays the searches by all methods that are not found yet; prints each and stores it."""
    mine = found.setdefault(key, {})
    if all(method in mine for method in methods):
        return
    plan = cell_plan(key)
    with episode_player(plan.tracker, plan.detections) as play:
        cell = Cell(plan, play)
        for method in (method for method in methods if method not in mine):
            budget = (key[-1], float("inf")) if method == REFERENCE else (MANY, mine[REFERENCE].seconds)
            mine[method] = one = cell.searched(method, *budget)
            values = " ".join(f"{v:.4f}" for v in (*one.training, *one.test, one.defaults))
            print(*key, method, f"{one.trials} trials, {one.seconds:.1f} s, {values}", flush=True)
            write(state, found)


def read(state: Path | None) -> Found:
    """Returns the finished searches that a file keeps, {} without one."""
    if state is None or not state.exists():
        return {}
    stored = json.loads(state.read_text(encoding="utf-8"))
    return {tuple(key): {method: Searched(**one) for method, one in by_method.items()} for key, by_method in stored}


def write(state: Path | None, found: Found) -> None:
    """Writes the finished searches to a file."""
    if state is not None:
        stored = [(key, {method: vars(one) for method, one in by_method.items()}) for key, by_method in found.items()]
        state.write_text(json.dumps(stored), encoding="utf-8")


def report(found: Found) -> None:
    """Prints the tables of searches; each key has the same methods."""
    methods, trackers = next(iter(found.values())), dict.fromkeys(key[0] for key in found)
    rows = {}
    for method in methods:
        pairs = [(by_method[method], by_method[REFERENCE]) for by_method in found.values()]
        others = [
            *([a.test[k] - b.test[k] for a, b in pairs] for k in range(len(PARTS))),
            [a.training[-1] - b.training[-1] for a, b in pairs],
        ]
        rows[method] = [
            difference_cell([a.test[-1] - a.defaults for a, _ in pairs]),
            *("–" if method == REFERENCE else difference_cell(values) for values in others),
            number(60 * sum(a.trials for a, _ in pairs) / sum(a.seconds for a, _ in pairs), 0),
            "–" if method == REFERENCE else difference_cell([a.trials - b.trials for a, b in pairs], "trials"),
        ]
    columns = [
        "gain over the defaults, test", *(f"less ours, test, {part:.0%} of the budget" for part in PARTS),
        "less ours, training", "trials per CPU minute", "trials less ours",
    ]  # fmt: skip
    table(f"{len(found)} searches by each method", "method", columns, rows)
    cells = {
        tracker: [
            number(
                mean_of_known(
                    by[method].test[-1] - by[method].defaults for key, by in found.items() if key[0] == tracker
                )
            )
            for method in methods
        ]
        for tracker in trackers
    }
    table("Gain over the defaults on the test scenes", "tracker", list(methods), cells)


def main() -> None:
    parser = new_parser(__doc__)
    parser.add_argument("methods", nargs="*", default=list(METHODS), help="all if absent")
    parser.add_argument("--trackers", nargs="+", default=list(TRACKERS), choices=TRACKERS)
    parser.add_argument("--suites", nargs="+", default=list(SUITES), choices=SUITES)
    add_seeds(parser, "0:2", "--searches", "numbers of the searches of each tracker and suite: ")
    parser.add_argument("--training", type=int, default=2, help="training seeds of each scene")
    parser.add_argument("--trials", type=int, default=30, help="trials of `ours`, whose CPU time is the budget")
    parser.add_argument("--state", type=Path, help="file that keeps finished searches")
    parser.add_argument("--libraries", type=Path, default=DEFAULT, help="where the library of CMA-ES is installed")
    args = parser.parse_args()
    unknown = [name for name in args.methods if name not in METHODS]
    if unknown:
        parser.error(f"{unknown[0]}: choose from {', '.join(METHODS)}")
    methods = [name for name in METHODS if name in (REFERENCE, *args.methods)]
    if "cma-es" in methods and not make_environments(args.libraries, ("cmaes",))["cmaes"]:
        methods.remove("cma-es")
        print("left out: cma-es, whose library cannot be installed")
    warnings.simplefilter("ignore")
    found = read(args.state)
    keys = [
        (tracker, suite, search, args.training, args.trials)
        for search in args.searches for tracker in args.trackers for suite in args.suites
    ]  # fmt: skip
    for key in keys:
        play_methods(key, methods, found, args.state)
    report({key: {method: found[key][method] for method in methods} for key in keys})


if __name__ == "__main__":
    main()
