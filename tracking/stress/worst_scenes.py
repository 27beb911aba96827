"""Search for the scenes in which a tracker is worst, next to what its detections allow.

A scene has a value of each axis between its ends, a scenario of the suite, and a seed. Its *shortfall* is the oracle's
score less the tracker's; a failed tracker has the score 0. The first 16 scenes are drawn at random. Of the others half
are drawn by Optuna's TPE sampler, which draws more where shortfalls were great. It draws three in four once its scenes
have a greater mean shortfall than the random ones, by a standard error, and one in four if the mean is smaller.

So that not all scenes show one failure again and again, the shortfall that the sampler gets is reduced near a worse
failure of the same scenario. Scenes are near if no axis differs by a fifth of its range. The failures that are listed
are the worst ones, no two near each other.

What is drawn depends on the seed of the search and on the scores so far, not on the number of workers. A search that
was stopped draws the same scenes again, takes stored episodes from the store, and so goes on where it was.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from scenarios.loading.resolve import Entry, SuiteEntry, load, rows
from tracking.episodes.sources import Source
from tracking.stress.sweep import Plan, Scene, Sweep, last_of_each_key

if TYPE_CHECKING:
    import optuna

BATCH = 8  # scenes that are drawn before their scores are known, for any number of workers
RANDOM = 2 * BATCH  # first scenes, all of them drawn at random
NEAR = 0.2  # least difference of some axis, as a share of its range, of scenes that are not near
LISTED = 5  # failures
SCENARIO = "scenario"  # name of the parameter


@dataclass(frozen=True)
class SearchedScene:
    """A scene that the search has drawn, with the scores of oracle and tracker on it."""

    number: int  # of the scene in the search, from 0
    scene: Scene
    place: tuple[float, ...]  # shares of the way from easy to hard
    scenario: str  # name or file, as `generate` takes it
    settings: tuple[str, ...]
    sampled: bool  # drawn by the sampler, not at random
    oracle: float = float("nan")
    score: float = float("nan")

    @property
    def shortfall(self) -> float:
        """The oracle's score less the tracker's; nan if one is unknown."""
        return self.oracle - self.score

    def nearness(self, other: SearchedScene) -> float:
        """Returns how near two scenes are: 1 at an equal place, falling to 0 where an axis differs by a fifth of its
        range; 0 for different scenarios."""
        if (self.scenario, self.scene.source.name) != (other.scenario, other.scene.source.name):
            return 0.0
        apart = max((abs(a - b) for a, b in zip(self.place, other.place, strict=True)), default=0.0)
        return max(0.0, 1 - apart / NEAR)


def search(
    sweep: Sweep, count: int, seed: int = 0, sampler: optuna.samplers.BaseSampler | None = None
) -> list[SearchedScene]:
    """Searches for scenes in which the first tracker of a sweep falls short of the oracle.

    Args:
        sweep: Gives the plan, the trackers and the store of episodes. The search ends early if its budget is spent.
        count: Number of scenes to play.
        seed: Seed of the search.
        sampler: Optuna's sampler that draws scenes; None takes TPE.

    Returns:
        All scenes on which both scores are known, in the order in which they were drawn.

    Raises:
        InputError: Optuna is not installed, or a scene cannot be made.
    """
    from tracking.tuning.search import require_optuna

    require_optuna("--search")
    import optuna

    from tracking.tuning.study import quiet_optuna

    sweep.check_scenes()
    entries = [entry for name in sweep.plan.scenarios for entry in rows(name)]
    tracker, found = next(iter(sweep.trackers)), list[SearchedScene]()
    with quiet_optuna():
        tpe = optuna.samplers.TPESampler(seed=seed, n_startup_trials=0, multivariate=True, constant_liar=True)
        study = optuna.create_study(direction="maximize", sampler=sampler or tpe)
        for first in range(0, count, BATCH):
            if sweep.spent():
                break
            quarters = 0 if first < RANDOM else _quarters(found)
            numbers = range(first, min(first + BATCH, count))
            trials = [_asked(study, sweep.plan, len(entries), seed, n, n % 4 < quarters) for n in numbers]
            drawn = [_drawn(sweep.plan, entries, trial, seed, trial.number % 4 < quarters) for trial in trials]
            sweep.play([failure.scene for failure in drawn], [tracker])
            for trial, failure in zip(trials, drawn, strict=True):
                oracle, score = (sweep.score(name, failure.scene) for name in (sweep.oracles[tracker], tracker))
                played = replace(failure, oracle=oracle, score=score)
                if np.isfinite(played.shortfall):
                    study.tell(trial, _novelty(played, found))
                    found.append(played)
                else:
                    study.tell(trial, state=optuna.trial.TrialState.FAIL)
    return found


def worst(found: Sequence[SearchedScene], most: int = LISTED) -> list[SearchedScene]:
    """Returns at most `most` failures with the greatest shortfalls above 0, worst first, no two near each other."""
    chosen = list[SearchedScene]()
    for failure in sorted(found, key=lambda one: -one.shortfall):
        if failure.shortfall > 0 and len(chosen) < most and not any(failure.nearness(other) for other in chosen):
            chosen.append(failure)
    return chosen


def _quarters(found: Sequence[SearchedScene]) -> int:
    """Returns how many of four scenes the sampler draws: 2, 3 if its mean shortfall is greater, 1 if it is smaller."""
    drawn = np.array([failure.shortfall for failure in found if failure.sampled])
    random = np.array([failure.shortfall for failure in found if not failure.sampled])
    if len(drawn) < 2 or len(random) < 2:
        return 2
    gain = drawn.mean() - random.mean()
    error = np.sqrt(drawn.var(ddof=1) / len(drawn) + random.var(ddof=1) / len(random))
    return 1 if gain < 0 else 3 if gain > error else 2


def _asked(study: optuna.Study, plan: Plan, entries: int, seed: int, number: int, sampled: bool) -> optuna.Trial:
    """Returns the next trial, drawn by the sampler of the study or at random."""
    from optuna.distributions import CategoricalDistribution, FloatDistribution

    if not sampled:
        rng = np.random.default_rng([seed, number, 1])
        study.enqueue_trial({**{axis.name: rng.random() for axis in plan.axes}, SCENARIO: int(rng.integers(entries))})
    shares = {axis.name: FloatDistribution(0.0, 1.0) for axis in plan.axes}
    return study.ask({**shares, SCENARIO: CategoricalDistribution(range(entries))})


def _drawn(plan: Plan, entries: Sequence[SuiteEntry], trial: optuna.Trial, seed: int, sampled: bool) -> SearchedScene:
    entry: SuiteEntry = entries[trial.params[SCENARIO]]
    # Four digits, so that the scene's command is short; what was drawn and what is played differ by less than 0.1 %.
    values = tuple(float(f"{axis.at(trial.params[axis.name]):.4g}") for axis in plan.axes)
    settings = last_of_each_key((*entry.settings, *map(str, plan.settings_at(values))))
    scenario = load(entry.scenario, (*entry.settings, *plan.settings_at(values))).model_copy(
        update={"name": entry.name}
    )
    of_scene = int(np.random.default_rng([seed, trial.number]).choice(plan.seeds))
    source = Source(entry.name, of_scene, entry=Entry(entry.name, scenario))
    place = tuple(trial.params[axis.name] for axis in plan.axes)
    return SearchedScene(trial.number, Scene(source, values), place, entry.scenario, settings, sampled)


def _novelty(played: SearchedScene, found: Sequence[SearchedScene]) -> float:
    worse = (played.nearness(other) for other in found if other.shortfall >= played.shortfall)
    return max(played.shortfall, 0.0) * (1 - max(worse, default=0.0))
