"""Plays the episodes of a search or a sweep: in this process, in several processes, or on a cluster.

Results come in the order of the sources. Workers play episodes, not trials: what is tried next depends on results and
never on the time they took, so a search finds the same with any number of workers.
"""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cache
from typing import Any

from scenarios.errors import FlockscopeError, InputError, OrderError, WorkError
from sim.types import DetectionMode, Tracker
from sim.workers.calls import RunItems
from tracking.episodes.episode import Episode, Source, SourceCache, play
from tracking.episodes.tuned_tracker import RULE, TunedTracker
from tracking.grouping.link_rule import LinkRule
from tracking.running.time_limit import TimeLimited
from tracking.running.tracker_registry import find
from tracking.running.used_files import code_of, used
from tracking.scoring.people import Similarity

CACHE_BYTES = 512 * 2**20  # Bytes of sequences that each process keeps for later episodes.


@dataclass(frozen=True)
class EpisodeTask:
    """One episode to play by a worker."""

    tracker: TunedTracker
    source: Source
    values: dict[str, Any]  # the tracker's parameters by name; others have their defaults
    detections: DetectionMode
    every_score: bool
    similarity: Similarity | None = None


EpisodeOrError = Episode | FlockscopeError
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


@contextmanager
def playing_workers(workers: int = 1, cluster: str | None = None) -> Iterator[RunItems]:
    """Context manager: opens workers and yields the function that runs items on them. At the end this process closes
    the trackers and forgets the sequences that it kept for episodes."""
    from sim.workers.start import start_workers

    with start_workers(workers, cluster) as run:
        try:
            yield run
        finally:
            for limited in _limited.values():
                limited.close()
            _limited.clear()
            opened_sources.cache_clear()


def _play_and_list(task: EpisodeTask) -> tuple[EpisodeOrError, dict[str, str]]:
    return play_task(task), used_by(task.tracker)


def _lost(task: EpisodeTask, error: WorkError) -> tuple[EpisodeOrError, dict[str, str]]:
    return error.replaced(file=task.tracker.name), {}


def used_by(tracker: TunedTracker) -> dict[str, str]:
    """Returns what a tracker has used in this process so far, as `used_files.used`; {} for the rule."""
    return {} if tracker.name == RULE else used(find(tracker.tracker))


def play_task(task: EpisodeTask) -> EpisodeOrError:
    """Plays an episode in this process and returns it, or the error that the tracker or its parameters caused.

    The process keeps the tracker and the opened sequences for later tasks. The tracker's seed is the source's seed. If
    the scene's script does not come true, the episode says so in `left_out`.
    """
    source, cache, tracker = task.source, opened_sources(), _runnable(task.tracker)
    try:
        if tracker == RULE:
            from tracking.episodes.grouping_episodes import play_rule

            return play_rule(source, LinkRule.from_dict(task.values), cache)
        return play(
            tracker, source, task.values or None, detections=task.detections,
            tracker_seed=source.seed, cache=cache, every_score=task.every_score, similarity=task.similarity,
        )  # fmt: skip
    except OrderError as error:  # the scene's fault, whatever the parameters
        return Episode(source.name, source.seed, float("nan"), {}, 0, 0.0, error.line())
    except FlockscopeError as error:
        return error


_limited: dict[TunedTracker, TimeLimited] = {}  # In a worker: the processes of trackers with a limit of time.


def _runnable(tracker: TunedTracker) -> str | type[Tracker] | TimeLimited:
    if tracker.name != RULE and code_of(find(tracker.tracker)) != tracker.code:
        raise WorkError(
            place="tracker", got=f"another {tracker.name} than when the command began", expected="the same files",
            remedy="run the command again; put the same files on all machines of a cluster",
        )  # fmt: skip
    if isinstance(tracker.tracker, type) or tracker.step_timeout is None:
        return tracker.tracker
    return _limited.setdefault(tracker, TimeLimited(tracker.tracker, tracker.step_timeout))


@cache
def opened_sources() -> SourceCache:
    """Returns the cache of the sequences that this process keeps for later episodes; always the same object."""
    return SourceCache(CACHE_BYTES)
