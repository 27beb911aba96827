"""Searches a policy on top of the best constant of a search, and keeps it only if it is surely better."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

from scenarios.errors import FlockscopeError, InputError, OrderError, WorkError, counted
from sim.types import Array, DetectionMode
from sim.workers.calls import RunItems
from tracking.config import Config
from tracking.episodes.episode import Episode, Source
from tracking.episodes.parallel_episodes import (
    EpisodeOrError,
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
from tracking.tuning.adaptive import EVERY, MEMORY, Played, play_policy, searched_policy
from tracking.tuning.candidates import Comparison, compare_episodes
from tracking.tuning.search_plan import SearchPlan


@dataclass(frozen=True)
class WindowsTask:
    """One episode with decisions to play by a worker; offset (P,) is added to the policy's residuals."""

    tracker: TunedTracker
    source: Source
    policy: Policy
    offset: Array | None
    detections: DetectionMode
    similarity: Similarity | None


def play_windows(task: WindowsTask) -> Played | FlockscopeError | None:
    """Plays an episode; None if the scene's script does not come true."""
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
    except OrderError:
        return None
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
        remedy = "remove --objective, or --adaptive"
        raise InputError(place="--adaptive", got=plan.goals[0].key, expected="objective", remedy=remedy)
    if not found:
        got, remedy = "none", "search others, or remove --adaptive"
        expected = "parameters that may change between frames"
        raise InputError(place="--adaptive", got=got, expected=expected, remedy=remedy)
    return found


def adapted(plan: SearchPlan, config: Config, configs: int, report: Callable[[str], None]) -> Adapted:
    """Returns a policy that begins with `config`, if it is surely better on the validation scenes. configs: number of
    constant configs to play, of which it is learned."""
    space = online_space(plan)
    with playing_workers(plan.options.workers, plan.options.cluster) as run:
        first = _windows(run, plan, plan.training, still(config), None)
        known = [source for source, one in zip(plan.training, first, strict=True) if one is not None]
        if not known:
            return Adapted(None, (), "the constant stays: no training scene can be played")

        def play(policy: Policy, offset: Array) -> list[Played]:
            return [one for one in _windows(run, plan, known, policy, offset) if one is not None]

        best, _ = searched_policy(play, config, space, configs, plan.options.seed, report)
        if not any(best.weights.values()):
            return Adapted(None, (), "the constant stays: no policy is better in training")
        report("policy: validation")
        goal, comparisons = plan.goals[0], list[Comparison]()
        for name, sources in {"validation": plan.validation, **plan.tests}.items():
            before, after = (list(_episodes(run, plan, sources, one)) for one in (still(config), best))
            found = compare_episodes(name, goal, before, after)
            comparisons += [] if found is None else [found]
            if name == "validation" and (found is None or found.verdict != "better"):
                words = "" if found is None else f": {found.difference_words}, {counted(found.sequences, 'sequence')}"
                return Adapted(None, tuple(comparisons), f"the constant stays: no policy is surely better{words}")
    return Adapted(best, tuple(comparisons), "the policy is kept: surely better than the constant in validation")


def still(config: Config) -> Policy:
    """Returns the policy that keeps a config."""
    return Policy(config, EVERY, MEMORY, {})


def _windows(
    run: RunItems, plan: SearchPlan, sources: Sequence[Source], policy: Policy, offset: Array | None
) -> list[Played | None]:
    from sim.workers.start import results_in_order

    given = (policy, offset, plan.detections, plan.options.similarity)
    tasks = [WindowsTask(plan.tracker, source, *given) for source in sources]
    found = list[Played | None]()
    for result in results_in_order(run, play_windows, tasks, _lost):
        if isinstance(result, FlockscopeError):
            raise result
        found.append(result)
    return found


def _episodes(run: RunItems, plan: SearchPlan, sources: Sequence[Source], policy: Policy) -> Iterator[Episode]:
    from sim.workers.start import results_in_order

    more = (plan.detections, False, plan.options.similarity, policy)
    tasks = [EpisodeTask(plan.tracker, source, {}, *more) for source in sources]
    for result in results_in_order(run, play_task, tasks, _lost_episode):
        if isinstance(result, FlockscopeError):
            raise result
        yield result


def _lost(task: WindowsTask, error: WorkError) -> Played | FlockscopeError | None:
    return error.replaced(file=task.tracker.name)


def _lost_episode(task: EpisodeTask, error: WorkError) -> EpisodeOrError:
    return error.replaced(file=task.tracker.name)
