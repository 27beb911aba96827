"""Plays the episodes of a search: each is an episode of the environment with one decision.

Results come in the order of the sources. Workers play episodes, not trials: what is tried next depends on results and
never on the time they took, so a search finds the same with any number of workers.
"""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterator, Sequence
from contextlib import contextmanager
from typing import Any

import numpy as np

from scenarios.errors import FlockscopeError, InputError, OrderError, WorkError
from sim.types import DetectionMode
from tracking.episodes.episode import Episode, Source
from tracking.episodes.parallel_episodes import (
    EpisodeOrError,
    EpisodeTask,
    opened_sources,
    play_task,
    playing_workers,
    runnable,
    used_by,
)
from tracking.episodes.tuned_tracker import RULE, TunedTracker
from tracking.scoring.people import Similarity

# play(sources, values, every_score) yields one result per source: the episode, or the error of these parameters.
PlayEpisodes = Callable[[Sequence[Source], dict[str, Any], bool], Generator[EpisodeOrError, None, None]]


@contextmanager
def episode_player(
    tracker: TunedTracker,
    detections: DetectionMode,
    workers: int = 1,
    cluster: str | None = None,
    similarity: Similarity | None = None,
    note: Callable[[dict[str, str]], None] = lambda used: None,
) -> Iterator[PlayEpisodes]:
    """Context manager: opens the workers and yields the function play(sources, values, every_score) (`PlayEpisodes`).
    cluster: address of a dask scheduler, None for processes here. A class as tracker needs one worker here. note:
    called after each episode with what the tracker has used, as of `used_by`."""
    from sim.workers.start import results_in_order

    if isinstance(tracker.tracker, type) and (workers > 1 or cluster):
        remedy = "give file.py:Class or module:Class, or one worker"
        raise InputError(place="--workers", got="a class", expected="a name that workers can look up", remedy=remedy)
    with playing_workers(workers, cluster) as run:

        def play_all(
            sources: Sequence[Source], values: dict[str, Any], every_score: bool
        ) -> Generator[EpisodeOrError, None, None]:
            given = (values, detections, every_score, similarity)
            tasks = [EpisodeTask(tracker, s, *given) for s in sources]
            for result, more in results_in_order(run, _play_and_list, tasks, _lost):
                note(more)
                yield result

        yield play_all


def _play_and_list(task: EpisodeTask) -> tuple[EpisodeOrError, dict[str, str]]:
    return stepped(task), used_by(task.tracker)


def _lost(task: EpisodeTask, error: WorkError) -> tuple[EpisodeOrError, dict[str, str]]:
    return error.replaced(file=task.tracker.name), {}


def stepped(task: EpisodeTask) -> EpisodeOrError:
    """Plays an episode as `play_task` does, by stepping the environment: parameters are those that the episode begins
    with, and the one action changes nothing. The rule of groups is no tracker, and is played as there."""
    from tracking.environment.env import TuningEnv

    if task.tracker.name == RULE:
        return play_task(task)
    source = task.source
    try:
        env = TuningEnv(
            runnable(task.tracker), source, params=task.values or None, detections=task.detections,
            similarity=task.similarity, cache=opened_sources(), tracker_seed=source.seed, every_score=task.every_score,
        )  # fmt: skip
        env.reset()
        env.step(np.zeros(len(env.space), np.float32))
        return env.episode()
    except OrderError as error:  # the scene's fault, whatever the parameters
        return Episode(source.name, source.seed, float("nan"), {}, 0, 0.0, error.line())
    except FlockscopeError as error:
        return error
