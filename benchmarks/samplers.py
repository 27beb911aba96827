"""What does a search reach with its own sampler and stopping rule, and what with Optuna's, in equal CPU time?

    python -m benchmarks samplers [METHOD …] [--trackers …] [--suites …] [--searches 0:2] [--training 2]
                                  [--trials 30] [--state FILE.json] [--libraries FOLDER]

Each search tunes one tracker on one suite of short scenes, at 2.5 frames/s. Search k has training scenes and test
scenes of its own. All methods begin with the defaults and get the same budget: the CPU seconds in which the search's
own sampler plays 30 trials without stopping any. Seconds are of the whole loop: sampler, storage, tracker and scores.
An episode that another method has played already is not played again, but its seconds count.

ours               moved parents and every fourth trial by TPE; trials that surely lose are stopped (the default)
ours whole         the same, no trial is stopped
ours by Optuna     the same, stopped by Optuna's WilcoxonPruner
moved              moved parents only, no trial is stopped
TPE, TPE single    Optuna's TPESampler, as it is (multivariate) and univariate; no trial is stopped
TPE stopped        TPE, stopped by the search's own rule
TPE by Optuna      TPE, stopped by Optuna's WilcoxonPruner
CMA-ES             Optuna's CmaEsSampler from the defaults on; categorical parameters are drawn at random
random             Optuna's RandomSampler

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
from optuna.samplers import BaseSampler, CmaEsSampler, RandomSampler, TPESampler
from optuna.trial import TrialState, create_trial

from benchmarks.peers.environments import DEFAULT, make_environment
from benchmarks.support.options import add_seeds, new_parser
from benchmarks.support.replaced_code import Replacement, replaced_code
from benchmarks.support.tables import EXACT, difference_cell, mean_cell, number, table
from benchmarks.tuning import Follower
from scenarios.errors import FlockscopeError
from sim.types import Tracker
from tracking.episodes.episode import Episode, Source
from tracking.episodes.parallel_episodes import EpisodeOrError
from tracking.stats import mean_of_known
from tracking.tuning import sampler, study
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
REFERENCE, WHOLE = "ours", "ours whole"


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

    def until(self, clock: Clock, budget: float) -> PlayEpisodes:
        """Returns the player of one search, which raises SpentError after `budget` s."""

        def play(
            sources: Sequence[Source], values: dict[str, Any], every: bool
        ) -> Generator[EpisodeOrError, None, None]:
            for source in sources:
                found = self.one(source, values, clock)
                if clock.now() > budget:
                    raise SpentError
                yield found

        return play


def by(make: Callable[[SearchPlan, int], BaseSampler]) -> Replacement:
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


def estimate_by_optuna(made: study.SearchStudy, played: dict[int, Episode]) -> float | None:
    """Returns an estimate of a trial that Optuna's WilcoxonPruner stops, as the search estimates those that it stops
    itself; None if it goes on."""
    goal = made.plan.goals[0]
    if not any(t.state == TrialState.COMPLETE for t in made.finished()):
        return None
    best = made.optuna.best_trial
    known = {k: v for k, v in enumerate(best.user_attrs[study.SCENES]) if v == v}
    now = {k: goal.of(e) for k, e in played.items() if k in known and goal.of(e) == goal.of(e)}
    direction = made.optuna.direction
    stand_in: Any = type("Record", (), {"direction": direction, "best_trial": whole(known)})
    if not optuna.pruners.WilcoxonPruner(p_threshold=made.plan.options.prune).prune(stand_in, whole(now)):
        return None
    loss = max(-mean_of_known(goal.gain(known[k], v) for k, v in now.items()), study.LEAST_LOSS)
    return float(best.value - loss if goal.higher else best.value + loss)


def whole(values: Mapping[int, float]) -> optuna.trial.FrozenTrial:
    """Returns a trial with these values by number of the scene."""
    return create_trial(value=0.0, intermediate_values=dict(values))


BY_OPTUNA = (study, "_estimate_if_losing", estimate_by_optuna)
# By method: what is replaced in the search, and the p-value that stops a trial.
METHODS: dict[str, tuple[tuple[Replacement, ...], float]] = {
    WHOLE: ((), 0.0),  # first: its seconds are the budget
    REFERENCE: ((), TuneOptions.prune),
    "ours by Optuna": ((BY_OPTUNA,), TuneOptions.prune),
    "moved": (((sampler, "TPE_FROM", float("inf")),), 0.0),
    "TPE": ((by(lambda plan, seed: TPESampler(seed=seed)),), 0.0),
    "TPE single": ((by(lambda plan, seed: TPESampler(seed=seed, multivariate=False)),), 0.0),
    "TPE stopped": ((by(lambda plan, seed: TPESampler(seed=seed)),), TuneOptions.prune),
    "TPE by Optuna": ((by(lambda plan, seed: TPESampler(seed=seed)), BY_OPTUNA), TuneOptions.prune),
    "CMA-ES": ((by(cma_es),), 0.0),
    "random": ((by(lambda plan, seed: RandomSampler(seed=seed)),), 0.0),
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
        changes, prune = METHODS[method]
        plan = replace(self.plan, options=replace(self.plan.options, prune=prune, trials=trials))
        clock, ends = Clock(), list[float]()

        def progress(finished: int, planned: int | None, text: str) -> None:
            ends.extend([clock.now()] * (finished - len(ends)))

        with replaced_code(changes), study.open_study(plan, None, "samplers") as made:
            with suppress(SpentError):
                study.run_trials(made, self.episodes.until(clock, budget), progress)
            spent = min(budget, clock.now())
            records = made.records()[: len(ends)]
        goal, training, test = plan.goals[0], list[float](), list[float]()
        for part in PARTS:
            done = [r for r, end in zip(records, ends, strict=True) if end <= part * spent]
            ranked = [r for r in done if not r.pruned and not r.error] or records[:1]
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


def cell_plan(tracker: str, suite: str, search: int, train: int) -> SearchPlan:
    """Returns the plan of a search: seeds of the scenes follow from its number. train: training seeds of each scene."""
    (made, fixed), (scenes, test) = TRACKERS[tracker], SUITES[suite]
    first = 20_000 + test * search
    return search_plan(
        TuneOptions(
            tracker=made, suite=scenes, seeds=range(train * search, train * (search + 1)), test=range(first, first + test),
            check=None, set=(FPS, *fixed), seed=search,
        )
    )  # fmt: skip


def main() -> None:
    parser = new_parser(__doc__)
    parser.add_argument("methods", nargs="*", default=list(METHODS), help="all if absent")
    parser.add_argument("--trackers", nargs="+", default=list(TRACKERS), choices=TRACKERS)
    parser.add_argument("--suites", nargs="+", default=list(SUITES), choices=SUITES)
    add_seeds(parser, "0:2", "--searches", "numbers of the searches of each tracker and suite: ")
    parser.add_argument("--training", type=int, default=2, help="training seeds of each scene")
    parser.add_argument("--trials", type=int, default=30, help="trials of `ours whole`, whose CPU time is the budget")
    parser.add_argument("--state", type=Path, help="file that keeps finished searches")
    parser.add_argument("--libraries", type=Path, default=DEFAULT, help="where the library of CMA-ES is installed")
    args = parser.parse_args()
    unknown = [name for name in args.methods if name not in METHODS]
    if unknown:
        parser.error(f"{unknown[0]}: choose from {', '.join(METHODS)}")
    make_environment(args.libraries, "cmaes", ("cmaes",))
    warnings.simplefilter("ignore")
    methods = [name for name in METHODS if name in (WHOLE, REFERENCE, *args.methods)]
    found = read(args.state)
    for search in args.searches:
        for tracker in args.trackers:
            for suite in args.suites:
                if all((tracker, suite, search, method) in found for method in methods):
                    continue
                plan = cell_plan(tracker, suite, search, args.training)
                with episode_player(plan.tracker, plan.detections) as play:
                    cell, budget = Cell(plan, play), float("inf")
                    for method in methods:
                        key = (tracker, suite, search, method)
                        if key not in found:
                            trials = args.trials if method == WHOLE else 10**6
                            found[key] = cell.searched(method, trials, budget)
                            print(*key, one_line(found[key]), flush=True)
                            write(args.state, found)
                        budget = found[tracker, suite, search, WHOLE].seconds
    keys = [(t, s, k) for k in args.searches for t in args.trackers for s in args.suites]
    report({m: [found[t, s, k, m] for t, s, k in keys] for m in methods}, keys)


Found = dict[tuple[str, str, int, str], Searched]


def one_line(one: Searched) -> str:
    """Returns what a search has reached, as text."""
    values = " ".join(f"{v:.4f}" for v in (*one.training, *one.test, one.defaults))
    return f"{one.trials} trials, {one.seconds:.1f} s, {values}"


def read(state: Path | None) -> Found:
    """Returns the finished searches that a file keeps."""
    if state is None or not state.exists():
        return {}
    return {(t, s, k, m): Searched(**one) for t, s, k, m, one in json.loads(state.read_text())}


def write(state: Path | None, found: Found) -> None:
    """Writes the finished searches to a file."""
    if state is not None:
        state.write_text(json.dumps([[*key, vars(one)] for key, one in found.items()]))


def report(found: Mapping[str, Sequence[Searched]], keys: Sequence[tuple[str, str, int]]) -> None:
    """Prints the tables. found: by method its searches, in the order of `keys`: tracker, suite, number."""
    rows, ours = {}, found[REFERENCE]
    for method, searches in found.items():
        gain = [one.test[-1] - one.defaults for one in searches]
        rows[method] = [mean_cell(gain)]
        if method == REFERENCE:
            rows[method] += ["–"] * (len(PARTS) + 1)
        else:
            for k in range(len(PARTS)):
                rows[method].append(difference_cell([a.test[k] - b.test[k] for a, b in zip(searches, ours, strict=True)]))
            apart = [a.training[-1] - b.training[-1] for a, b in zip(searches, ours, strict=True)]
            rows[method].append(difference_cell(apart))
        rows[method].append(number(60 * sum(o.trials for o in searches) / sum(o.seconds for o in searches), 0))
    parts = [f"{part:.0%} of the budget" for part in PARTS]
    columns = ["gain over the defaults, test", *(f"less ours, test, {part}" for part in parts), "less ours, training"]
    table(f"{len(keys)} searches each, goal", "method", [*columns, "trials per CPU minute"], rows)
    names = list(dict.fromkeys(tracker for tracker, _, _ in keys))
    cells = {}
    for method, searches in found.items():
        mine = {name: [o for o, key in zip(searches, keys, strict=True) if key[0] == name] for name in names}
        cells[method] = [number(np.mean([o.test[-1] - o.defaults for o in mine[name]]).item()) for name in names]
    cells["defaults"] = [number(np.mean([o.defaults for o, k in zip(ours, keys, strict=True) if k[0] == n]).item()) for n in names]
    table("Gain over the defaults on the test scenes", "method", names, cells)


if __name__ == "__main__":
    main()
