"""Searches a policy on top of the best constant of a search, and keeps it only if it is surely better."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TypeVar

from scenarios.errors import FlockscopeError, InputError, counted
from sim.types import Array, DetectionMode
from sim.workers.calls import RunItems
from tracking.config import Config
from tracking.episodes.episode import Episode, Source
from tracking.episodes.parallel_episodes import (
    EpisodeTask,
    opened_sources,
    play_task,
    playing_workers,
    runnable,
)
from tracking.episodes.tuned_tracker import TunedTracker
from tracking.parameter_space import Space
from tracking.running.policy import Policy
from tracking.scoring.people import Similarity
from tracking.stats import FEWEST
from tracking.tuning.adaptive import Played, play_policy, searched_policy
from tracking.tuning.candidates import Comparison, HeldOutEvaluator, compare_episodes, too_few
from tracking.tuning.search_plan import SearchPlan


@dataclass(frozen=True)
class WindowsTask:
    """One episode with decisions to play by a worker; offset (P,) is added to the policy's residuals."""

    tracker: TunedTracker
    source: Source
    policy: Policy
    offset: Array
    detections: DetectionMode
    similarity: Similarity | None


R = TypeVar("R")
Task = TypeVar("Task", WindowsTask, EpisodeTask)


def play_windows(task: WindowsTask) -> Played | FlockscopeError:
    """Plays an episode, and returns it or the error that it caused."""
    from tracking.environment.env import TuningEnv

    cache = opened_sources()
    try:
        played = runnable(task.tracker)
        fps = cache.open(task.source).sequence.fps
        env = TuningEnv(
            played, task.source, params=task.policy.base, detections=task.detections, similarity=task.similarity,
            decision_every=max(round(task.policy.every * fps), 1), cache=cache, tracker_seed=task.source.seed,
        )  # fmt: skip
        return play_policy(env, task.policy, task.offset)
    except FlockscopeError as error:
        return error


@dataclass(frozen=True)
class Adapted:
    """What a search for a policy found: the policy, None if the constant stays; its comparisons with the constant, on
    validation scenes and then on the test scenes; and a line of text that says which."""

    policy: Policy | None
    comparisons: tuple[Comparison, ...]
    line: str


def online_space(plan: SearchPlan) -> Space:
    """Returns the searched parameters that may change between frames. Raises InputError if there is none, or if the
    search is not for the objective."""
    found = tuple(p for p in plan.space if p.online)
    if [goal.key for goal in plan.goals] != ["objective"]:
        got = f"a search for {', '.join(goal.key for goal in plan.goals)}"
        remedy = "search for it, or remove --adaptive"
        raise InputError(place="--adaptive", got=got, expected="one for objective alone", remedy=remedy)
    if not found:
        got, remedy = "none", "search others, or remove --adaptive"
        expected = "parameters that may change between frames"
        raise InputError(place="--adaptive", got=got, expected=expected, remedy=remedy)
    return found


def adapted(
    plan: SearchPlan, config: Config, training: Sequence[Source], configs: int, evaluator: HeldOutEvaluator
) -> Adapted:
    """Returns a policy that begins with `config`, if it is surely better on the validation scenes.

    training: scenes of the plan whose script comes true. configs: number of constant configs to play on them, of which
    it is learned; those with which the tracker fails are left out. evaluator: knows what `config` plays on other
    scenes.
    """
    report = evaluator.report
    space = online_space(plan)
    if len(plan.validation) < FEWEST:
        return Adapted(None, (), f"the constant stays: {too_few(len(plan.validation))}")
    if not training:
        return Adapted(None, (), "the constant stays: no training scene can be played")
    given = plan.detections, plan.options.similarity
    with playing_workers(plan.options.workers, plan.options.cluster) as run:

        def play(policy: Policy, offset: Array) -> list[Played]:
            tasks = [WindowsTask(plan.tracker, source, policy, offset, *given) for source in training]
            found = _played(run, play_windows, tasks)
            return [] if isinstance(found, FlockscopeError) else found

        def episodes(sources: Sequence[Source]) -> list[Episode] | FlockscopeError:
            more = plan.detections, False, plan.options.similarity, best
            return _played(run, play_task, [EpisodeTask(plan.tracker, source, {}, *more) for source in sources])

        best, _ = searched_policy(play, config, space, configs, plan.options.seed, report)
        if not any(best.weights.values()):
            return Adapted(None, (), "the constant stays: no policy is better in training")
        report("policy: validation")
        goal, comparisons = plan.goals[0], list[Comparison]()
        for name, sources in {"validation": plan.validation, **plan.tests}.items():
            before, after = evaluator.episodes(sources, config), episodes(sources)
            if isinstance(before, FlockscopeError) or isinstance(after, FlockscopeError):
                error = before if isinstance(before, FlockscopeError) else after
                return Adapted(None, tuple(comparisons), f"the constant stays: {name}: {error}")
            found = compare_episodes(name, goal, before, after)
            comparisons += [] if found is None else [found]
            if name == "validation" and (found is None or found.verdict != "better"):
                if found is not None and found.indicative:
                    return Adapted(None, tuple(comparisons), f"the constant stays: {too_few(found.sequences)}")
                words = "" if found is None else f": {found.difference_words}, {counted(found.sequences, 'sequence')}"
                return Adapted(None, tuple(comparisons), f"the constant stays: no policy is surely better{words}")
    return Adapted(best, tuple(comparisons), "the policy is kept: surely better than the constant in validation")


def _played(
    run: RunItems, function: Callable[[Task], R | FlockscopeError], tasks: Sequence[Task]
) -> list[R] | FlockscopeError:
    """Returns what the function makes of the tasks, in their order, or the first error. Raises that of workers."""
    from sim.workers.start import results_in_order

    found = list[R]()
    for result in results_in_order(run, function, tasks, lambda task, error: error.replaced(file=task.tracker.name)):
        if isinstance(result, FlockscopeError):
            return result
        found.append(result)
    return found
