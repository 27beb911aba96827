"""Chooses the parameters of the next trial: those of a good trial, with a few of them moved.

Declared ranges are wide and defaults are good, so a point drawn anywhere in them, or from a density over many
parameters, is nearly always worse. A trial therefore starts from one of the best finished trials, at first from the
defaults. Some of its parameters, three on average, are moved by a step whose standard deviation lies between a fortieth
and a half of the range, on the log scale where the parameter is declared so. In equal CPU time Optuna's TPE finds less
early in a search, and neither TPE nor CMA-ES surely more in all of it (`python -m benchmarks samplers`).

The parameters of trial n depend only on the seed, on n and on the trials finished before. A search that was killed and
is resumed therefore finds what it would have found.

All trials are played to their end: a pruner buys more trials in equal CPU time, and no better parameters.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, cast

import numpy as np
import optuna
from optuna.distributions import BaseDistribution, CategoricalDistribution, FloatDistribution, IntDistribution
from optuna.trial import FrozenTrial, TrialState

from sim.types import Array
from tracking.config import Param
from tracking.parameter_space import decode, encode
from tracking.tuning.search_plan import SearchPlan

MOVED = 3  # Number of parameters that are moved, on average.
STEPS = (0.05, 1.0)  # Least and greatest standard deviation of a step; the range of a parameter is [-1, 1].
PARENTS = 3  # Number of best trials that a trial may start from.


def distribution(p: Param) -> BaseDistribution:
    """Returns Optuna's distribution over the range or the choices of the parameter p, in its unit."""
    if p.scale == "categorical":
        return CategoricalDistribution(cast(Any, p.choices))
    if p.scale == "int":
        return IntDistribution(int(np.ceil(p.low)), int(np.floor(p.high)))
    return FloatDistribution(p.low, p.high, log=p.scale == "log")


def propose(plan: SearchPlan, study: optuna.Study, number: int) -> None:
    """Enqueues the parameters of trial `number`."""
    complete = study.get_trials(deepcopy=False, states=(TrialState.COMPLETE,))
    rng = np.random.default_rng(np.random.SeedSequence([plan.options.seed, number]))
    study.enqueue_trial(_moved(plan, study, complete, rng))


def _moved(
    plan: SearchPlan, study: optuna.Study, complete: Sequence[FrozenTrial], rng: np.random.Generator
) -> dict[str, Any]:
    space, parent = plan.space, _parent(plan, study, complete, rng)
    base = plan.config(parent)
    chosen = rng.random(len(space)) < MOVED / len(space)
    chosen[rng.integers(len(space))] = True
    low, high = np.log(STEPS)
    step = np.exp(rng.uniform(low, high, len(space))) * rng.standard_normal(len(space))
    point = encode(space, base)
    categorical = np.array([p.scale == "categorical" for p in space])
    target = np.where(categorical, rng.uniform(-1, 1, len(space)), _reflected(point + step))
    config = decode(space, np.where(chosen, target, point), base)
    moved = {p.name: getattr(config, p.name) for p, is_chosen in zip(space, chosen, strict=True) if is_chosen}
    return {**parent, **moved}


def _parent(
    plan: SearchPlan, study: optuna.Study, complete: Sequence[FrozenTrial], rng: np.random.Generator
) -> dict[str, Any]:
    if not complete:
        return dict(plan.defaults)
    if len(plan.goals) > 1:
        front = study.best_trials
        return dict(front[rng.integers(len(front))].params)
    ranked = sorted(complete, key=lambda t: plan.goals[0].gain(t.values[0], 0.0))
    return dict(ranked[min(int(rng.geometric(0.6)) - 1, PARENTS - 1, len(ranked) - 1)].params)


def _reflected(point: Array) -> Array:
    # Beyond 3 or -3 the mirror image would land outside again, behind the other end.
    return np.clip(np.where(np.abs(point) > 1, np.sign(point) * 2 - point, point), -1.0, 1.0)
