"""The loop of a search: one trial (set of parameters) after the other, each played on the training scenes until it
surely loses.

It surely loses if the p-value of a paired test against the best trial, after any scene, is below a limit. It then gets
an estimate of its value.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from contextlib import closing, suppress

import numpy as np
import optuna
from optuna.exceptions import UpdateFinishedTrialError

from scenarios.errors import FlockscopeError, InputError
from tracking.environment.episodes import Episode
from tracking.tuning.goals import Goal, finite_mean
from tracking.tuning.parallel_episodes import PlayEpisodes
from tracking.tuning.sampler import ERROR, PRUNED
from tracking.tuning.search_plan import SearchPlan
from tracking.tuning.study import SearchStudy

PAUSE = 0.5
"""Seconds between two looks at whether other processes have finished."""

LEAST_LOSS = 1e-12
"""Least difference between the best value and the estimate of a pruned trial."""

Progress = Callable[[int, int, str], None]


def run_trials(study: SearchStudy, play: PlayEpisodes, progress: Progress) -> None:
    """Plays trials until the study has as many finished ones as planned, by this process or by others, for which it
    waits.

    play: plays episodes. progress: called before each trial, and while waiting, as progress(finished, planned, text).
    Raises the error of the defaults if they cannot be played, InputError if no training scene has a score for a goal
    with them, and every error of the workers.
    """
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
    """Returns the best training value of the study as a text for the progress bar, "(best in training 0.8123)".

    "" if no trial has a value or there are several goals.
    """
    known = len(study.plan.goals) == 1 and any(t.value is not None for t in study.finished())
    return f"(best in training {study.optuna.best_value:.4f})" if known else ""


def _play_trial(study: SearchStudy, trial: optuna.Trial, play: PlayEpisodes) -> None:
    """Plays one trial and stores its values in the study; an error means impossible parameters, and is raised for the
    defaults.

    play: plays episodes. An error that it raises comes from the workers. It is raised, and leaves the trial unfinished.
    If another process has finished the trial in the meantime, its values stay.
    """
    with suppress(UpdateFinishedTrialError):
        values = _trial_values(study, trial, play)
        if isinstance(values, FlockscopeError):
            if study.place(trial) == 0:
                raise values
            trial.set_user_attr(ERROR, values.line())
        study.tell(trial, None if isinstance(values, FlockscopeError) else values)


def _trial_values(study: SearchStudy, trial: optuna.Trial, play: PlayEpisodes) -> list[float] | FlockscopeError:
    """Returns the value of a trial by each goal, an estimate if it is pruned; or the FlockscopeError of its parameters.

    An InputError is also returned if a goal's score is unknown in every training scene. Scenes are played with `play`
    in an order of the trial's own. With one goal its score in each scene is stored in the trial of the study, and so is
    the number of episodes before pruning. Errors of the workers are raised.
    """
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
    """Reports the first goal's score in one episode to the pruner; True if the trial is to be stopped.

    scene: number, from 0, of the scene among the training sources; plan: gives the goals. False, without a report, if
    there are several goals or the score is unknown.
    """
    value = plan.goals[0].of(episode)
    if len(plan.goals) > 1 or value != value:
        return False
    trial.report(value, scene)
    return trial.should_prune()


def _estimate(best: optuna.trial.FrozenTrial, goal: Goal, played: dict[int, Episode]) -> float:
    """Returns an estimate of a pruned trial's value by `goal`: the best trial's value, worsened by the mean loss to it
    on common scenes.

    best: the best trial, which must have a value (else an assertion fails). played: the pruned trial's episode by scene
    number. The estimate is always worse than the best value, by 1e-12 at least. The mean of a few scenes depends much
    on which scenes came first; the paired loss does not.
    """
    assert best.value is not None
    pairs = [(goal.of(e), best.intermediate_values[k]) for k, e in played.items() if k in best.intermediate_values]
    gain = finite_mean(goal.gain(theirs, own) for own, theirs in pairs)
    gain = min(gain, -LEAST_LOSS) if gain == gain else -LEAST_LOSS
    return best.value + gain if goal.higher else best.value - gain
