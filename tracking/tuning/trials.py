"""The search itself: one trial after another, each played on the training scenes until it is clear that it loses."""

from __future__ import annotations

import time
from collections.abc import Callable
from contextlib import closing, suppress

import numpy as np
import optuna
from optuna.exceptions import UpdateFinishedTrialError

from scenarios.errors import FlockscopeError, InputError
from tracking.environment.episodes import Episode
from tracking.tuning.goals import Goal, mean
from tracking.tuning.parallel_episodes import Play
from tracking.tuning.sampler import ERROR, PRUNED
from tracking.tuning.search_plan import Plan, every_score
from tracking.tuning.study import Study

PAUSE = 0.5  # s between looks at whether others have finished
TINY = 1e-12  # by so much at least is a trial that was given up behind the best

Progress = Callable[[int, int, str], None]


def search(study: Study, play: Play, progress: Progress) -> None:
    """Play trials until as many as the plan wants are finished, here or by other processes."""
    desperate = False
    while True:
        progress(len(study.finished()), study.plan.trials, _so_far(study))
        asked = study.ask(desperate)
        if asked is not None:
            _play(study, asked, play)
        elif len(study.finished()) >= study.plan.trials:
            return
        elif study.shared:
            time.sleep(PAUSE)
        else:
            desperate = True


def _so_far(study: Study) -> str:
    """The best training value, in words: a sign of life, no result."""
    known = len(study.plan.goals) == 1 and any(t.value is not None for t in study.finished())
    return f"(best in training {study.optuna.best_value:.4f})" if known else ""


def _play(study: Study, asked: optuna.Trial, play: Play) -> None:
    """One trial; an error of the defaults is raised, an error of other ones means that these parameters cannot be.

    Errors of who plays end the search: the trial stays as it is, to be played again by whoever goes on. Where others
    took it as left, it is theirs.
    """
    with suppress(UpdateFinishedTrialError):
        found = _values(study, asked, play)
        if isinstance(found, FlockscopeError):
            if study.slot(asked) == 0:
                raise found
            asked.set_user_attr(ERROR, found.line())
        study.tell(asked, None if isinstance(found, FlockscopeError) else found)


def _values(study: Study, asked: optuna.Trial, play: Play) -> list[float] | FlockscopeError:
    """What the trial reached by each goal; where it was given up, what it would probably have reached; or the error by
    which these parameters cannot be."""
    plan, played = study.plan, dict[int, Episode]()
    try:
        config = plan.config(asked.params).as_dict()
    except FlockscopeError as error:
        return error
    # In an order of its own, so that trials are not given up by the same few scenes.
    order = np.random.default_rng([plan.seed, study.slot(asked)]).permutation(len(plan.training)).tolist()
    with closing(play([plan.training[k] for k in order], config, every_score(plan))) as answers:
        for at, answer in zip(order, answers, strict=True):
            if isinstance(answer, FlockscopeError):
                return answer
            played[at] = answer
            if _hopeless(asked, at, answer, plan) and len(played) < len(order):
                asked.set_user_attr(PRUNED, len(played))
                return [_estimate(study.optuna.best_trial, plan.goals[0], played)]
    found = [goal.mean([played[k] for k in sorted(played)]) for goal in plan.goals]
    unknown = [goal.key for goal, value in zip(plan.goals, found, strict=True) if value != value]
    if unknown:
        got, remedy = f"{unknown[0]} unknown in every training scene", "choose another score, suite or tracker"
        return InputError(place="--objective", got=got, expected="scenes that it is about", remedy=remedy)
    return found


def _hopeless(asked: optuna.Trial, at: int, episode: Episode, plan: Plan) -> bool:
    """Report an episode and ask whether to give up; never where there are several goals."""
    value = plan.goals[0].of(episode)
    if len(plan.goals) > 1 or value != value:
        return False
    asked.report(value, at)
    return asked.should_prune()


def _estimate(best: optuna.trial.FrozenTrial, goal: Goal, played: dict[int, Episode]) -> float:
    """The value of the best trial less what this one lost to it on the same scenes, which is nearer to the truth than
    the mean of those that happened to come first."""
    assert best.value is not None
    pairs = [(goal.of(e), best.intermediate_values[k]) for k, e in played.items() if k in best.intermediate_values]
    gain = mean(goal.gain(theirs, own) for own, theirs in pairs)
    gain = min(gain, -TINY) if gain == gain else -TINY
    return best.value + gain if goal.higher else best.value - gain
