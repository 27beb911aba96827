"""What a search tries next: mostly a good trial with a few parameters moved, now and then what TPE makes of all trials.

Declared ranges are wide and defaults are good, so that a point drawn anywhere, or by a density over many parameters,
is nearly always worse. A trial therefore begins as one of the best so far (the first time, the defaults), and some of
its parameters, three on the mean, are moved: steps of any size from a fortieth to a half of the range, in the
logarithm where the parameter is declared so. Every fourth trial is TPE's, which sees what hill climbing does not.

What trial n tries follows from the seed, n and the finished trials before it, through a generator of its own: a study
that was killed and goes on finds what it would have found.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import optuna
from optuna.distributions import BaseDistribution, CategoricalDistribution, FloatDistribution, IntDistribution
from optuna.samplers import BaseSampler, TPESampler
from optuna.trial import FrozenTrial, TrialState

from tracking.config import Param
from tracking.parameter_space import decode, encode
from tracking.tuning.search_plan import Plan

AGAIN, PRUNED, ERROR = "again", "pruned after", "error"
"""Attributes of a trial: which it replaces, after how many episodes it was given up, what went wrong."""

MOVED = 3  # parameters on the mean
STEPS = (0.05, 1.0)  # standard deviation of a step in [-1, 1], the ends of a range between which it is drawn
PARENTS = 3  # so many of the best may be a trial's parent
EVERY = 4  # the how-manieth trial is TPE's
STARTUP = 10  # … once so many are finished


def distribution(p: Param) -> BaseDistribution:
    """A parameter as Optuna's, in its own unit."""
    if p.scale == "categorical":
        return CategoricalDistribution(p.choices)
    if p.scale == "int":
        return IntDistribution(int(np.ceil(p.low)), int(np.floor(p.high)))
    return FloatDistribution(p.low, p.high, log=p.scale == "log")


def slot(trials: Sequence[FrozenTrial], trial: FrozenTrial) -> int:
    """The trial's place in the search: how many new ones were begun before it, or before the one that it replaces."""
    number = trial.user_attrs.get(AGAIN, trial.number)
    return sum(t.number < number and AGAIN not in t.user_attrs for t in trials)


class Sampler(BaseSampler):
    """State: of the trial at hand, its generator, its TPE, and whether it is TPE's."""

    def __init__(self, plan: Plan) -> None:
        self._plan, self._space = plan, {p.name: distribution(p) for p in plan.space}
        self._rng, self._tpe, self._whole = np.random.default_rng(plan.seed), TPESampler(seed=plan.seed), False

    def before_trial(self, study: optuna.Study, trial: FrozenTrial) -> None:
        """Begin anew."""
        trials = study.get_trials(deepcopy=False)
        place = slot(trials, trial)
        entropy = np.random.SeedSequence([self._plan.seed, place])
        self._rng = np.random.default_rng(entropy)
        self._tpe = TPESampler(seed=int(entropy.generate_state(1)[0]), n_startup_trials=STARTUP)
        self._whole = place % EVERY == EVERY - 1 and sum(t.state == TrialState.COMPLETE for t in trials) >= STARTUP

    def infer_relative_search_space(self, study: optuna.Study, trial: FrozenTrial) -> dict[str, BaseDistribution]:
        """All parameters."""
        return self._tpe.infer_relative_search_space(study, trial) if self._whole else self._space

    def sample_relative(
        self, study: optuna.Study, trial: FrozenTrial, search_space: dict[str, BaseDistribution]
    ) -> dict[str, Any]:
        """A parent, moved; or as TPE says."""
        return self._tpe.sample_relative(study, trial, search_space) if self._whole else self._moved(study)

    def sample_independent(
        self, study: optuna.Study, trial: FrozenTrial, param_name: str, param_distribution: BaseDistribution
    ) -> Any:
        """As TPE."""
        return self._tpe.sample_independent(study, trial, param_name, param_distribution)

    def _moved(self, study: optuna.Study) -> dict[str, Any]:
        """A parent with some parameters moved; where the config refuses that, drawn back towards the parent."""
        space, rng = self._plan.space, self._rng
        old = self._parent(study)
        base = self._plan.config(old)
        chosen = rng.random(len(space)) < MOVED / len(space)
        chosen[rng.integers(len(space))] = True
        low, high = np.log(STEPS)
        step = np.exp(rng.uniform(low, high, len(space))) * rng.standard_normal(len(space))
        point = encode(space, base)
        anywhere = np.array([p.scale == "categorical" for p in space])
        aim = np.where(anywhere, rng.uniform(-1, 1, len(space)), _reflected(point + step))
        config = decode(space, np.where(chosen, aim, point), base)
        moved = {p.name for p, here in zip(space, chosen, strict=True) if here}
        return {name: getattr(config, name) if name in moved else value for name, value in old.items()}

    def _parent(self, study: optuna.Study) -> dict[str, Any]:
        """Parameters of one of the best that were played to the end, the better the likelier; at first the defaults."""
        trials = study.get_trials(deepcopy=False, states=(TrialState.COMPLETE,))
        whole = [t for t in trials if PRUNED not in t.user_attrs and t.params.keys() == self._plan.defaults.keys()]
        if not whole:
            return dict(self._plan.defaults)
        if len(self._plan.goals) > 1:
            whole = study.best_trials
            return dict(whole[self._rng.integers(len(whole))].params)
        goal = self._plan.goals[0]
        ranked = sorted(whole, key=lambda t: goal.gain(t.values[0], 0.0))
        at = min(int(self._rng.geometric(0.6)) - 1, PARENTS - 1, len(ranked) - 1)
        return dict(ranked[at].params)


def _reflected(point: np.ndarray) -> np.ndarray:
    """Points beyond an end of [-1, 1] mirrored at it."""
    return np.clip(np.where(np.abs(point) > 1, np.sign(point) * 2 - point, point), -1.0, 1.0)
