"""The loop of a search: one trial (set of parameters) after the other, each played on the training scenes until it
surely loses.

It surely loses if the p-value of a paired test against the best trial, after any scene, is below a limit. It then gets
an estimate of its value.
"""

from __future__ import annotations

import time
from contextlib import closing, suppress

import numpy as np
import optuna
from optuna.exceptions import UpdateFinishedTrialError

from scenarios.errors import FlockscopeError, InputError
from tracking.environment.episodes import Episode
from tracking.tuning.goals import Goal, finite_mean
from tracking.tuning.options import Progress
from tracking.tuning.parallel_episodes import PlayEpisodes
from tracking.tuning.sampler import ERROR, PRUNED
from tracking.tuning.search_plan import SearchPlan
from tracking.tuning.study import SearchStudy

PAUSE = 0.5  # Seconds between two looks at whether other processes have finished.

LEAST_LOSS = 1e-12  # Least difference between the best value and the estimate of a pruned trial.


def run_trials(study: SearchStudy, play: PlayEpisodes, progress: Progress) -> None:
    """Plays trials until the study has as many finished ones as planned, by this process or by others."""
    retry_unfinished, planned = False, study.plan.options.trials
    while True:
        progress(len(study.finished()), planned, _best_so_far(study))
        trial = study.ask(retry_unfinished)
        if trial is not None:
            _play_trial(study, trial, play)
        elif len(study.finished()) >= planned:
            return
        elif study.knows_running_trials:
            time.sleep(PAUSE)
        else:
            retry_unfinished = True


def _best_so_far(study: SearchStudy) -> str:
    known = len(study.plan.goals) == 1 and any(t.value is not None for t in study.finished())
    return f"(best in training {study.optuna.best_value:.4f})" if known else ""


def _play_trial(study: SearchStudy, trial: optuna.Trial, play: PlayEpisodes) -> None:
    with suppress(UpdateFinishedTrialError):
        values = _trial_values(study, trial, play)
        if isinstance(values, FlockscopeError):
            if study.place(trial) == 0:
                raise values
            trial.set_user_attr(ERROR, values.line())
        study.tell(trial, None if isinstance(values, FlockscopeError) else values)


def _trial_values(study: SearchStudy, trial: optuna.Trial, play: PlayEpisodes) -> list[float] | FlockscopeError:
    plan, played = study.plan, dict[int, Episode]()
    try:
        config = plan.config(trial.params).as_dict()
    except FlockscopeError as error:
        return error
    # Each trial has an order of its own, so that no few scenes decide about all trials.
    order = np.random.default_rng([plan.options.seed, study.place(trial)]).permutation(len(plan.training)).tolist()
    with closing(play([plan.training[k] for k in order], config, plan.needs_every_score)) as results:
        for k, result in zip(order, results, strict=True):
            if isinstance(result, FlockscopeError):
                return result
            played[k] = result
            if _should_prune(trial, k, result, plan) and len(played) < len(order):
                trial.set_user_attr(PRUNED, len(played))
                return [_estimate(study.optuna.best_trial, plan.goals[0], played)]
    values = [goal.mean([played[k] for k in sorted(played)]) for goal in plan.goals]
    unknown = [goal.key for goal, value in zip(plan.goals, values, strict=True) if value != value]
    if unknown:
        got, remedy = f"{unknown[0]} unknown in every training scene", "choose another score, suite or tracker"
        return InputError(place="--objective", got=got, expected="scenes that have this score", remedy=remedy)
    return values


def _should_prune(trial: optuna.Trial, scene: int, episode: Episode, plan: SearchPlan) -> bool:
    value = plan.goals[0].of(episode)
    if len(plan.goals) > 1 or value != value:
        return False
    trial.report(value, scene)
    return trial.should_prune()


def _estimate(best: optuna.trial.FrozenTrial, goal: Goal, played: dict[int, Episode]) -> float:
    assert best.value is not None
    pairs = [(goal.of(e), best.intermediate_values[k]) for k, e in played.items() if k in best.intermediate_values]
    gain = finite_mean(goal.gain(theirs, own) for own, theirs in pairs)
    gain = min(gain, -LEAST_LOSS) if gain == gain else -LEAST_LOSS
    return best.value + gain if goal.higher else best.value - gain
