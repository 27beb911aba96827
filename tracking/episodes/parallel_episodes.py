"""Plays the episodes of a search or a sweep in a worker: this process, one of several, or one of a cluster."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cache
from typing import Any

from scenarios.errors import FlockscopeError, OrderError, WorkError
from sim.types import DetectionMode, Tracker
from sim.workers.calls import RunItems
from tracking.episodes.episode import Episode, Source, SourceCache, play
from tracking.episodes.tuned_tracker import RULE, TunedTracker
from tracking.grouping.link_rule import LinkRule
from tracking.running.policy import Policy
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
    policy: Policy | None = None  # in place of `values`


EpisodeOrError = Episode | FlockscopeError


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


def used_by(tracker: TunedTracker) -> dict[str, str]:
    """Returns what a tracker has used in this process so far, as `used_files.used`; {} for the rule."""
    return {} if tracker.name == RULE else used(find(tracker.tracker))


def play_task(task: EpisodeTask) -> EpisodeOrError:
    """Plays an episode in this process and returns it, or the error that the tracker or its parameters caused.

    The process keeps the tracker and the opened sequences for later tasks. The tracker's seed is the source's seed. If
    the scene's script does not come true, the episode says so in `left_out`.
    """
    source, cache, tracker = task.source, opened_sources(), runnable(task.tracker)
    try:
        if tracker == RULE:
            from tracking.episodes.grouping_episodes import play_rule

            return play_rule(source, LinkRule.from_dict(task.values), cache)
        return play(
            tracker, source, task.policy or task.values or None, detections=task.detections,
            tracker_seed=source.seed, cache=cache, every_score=task.every_score, similarity=task.similarity,
        )  # fmt: skip
    except OrderError as error:  # the scene's fault, whatever the parameters
        return Episode(source.name, source.seed, float("nan"), {}, 0, 0.0, error.line())
    except FlockscopeError as error:
        return error


_limited: dict[TunedTracker, TimeLimited] = {}  # In a worker: the processes of trackers with a limit of time.


def runnable(tracker: TunedTracker) -> str | type[Tracker] | TimeLimited:
    """Returns what plays for a tracker. Raises WorkError if its files are others than when the command began."""
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
