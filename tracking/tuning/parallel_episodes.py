"""Episodes of a search, played here, by other processes or elsewhere; answers come in the order of the questions.

Workers play episodes, not trials: what is asked next depends on answers alone, never on who was quick, so that a
search finds the same with any number of them.
"""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cache
from typing import Any

from scenarios.errors import FlockscopeError, InputError, WorkError
from sim.types import DetectionMode, Tracker
from tracking.environment.episodes import Cache, Episode, Source
from tracking.tuning.tuned_tracker import Subject, subject_of

HELD = 512 * 2**20
"""Bytes of sequences that each process holds."""


@dataclass(frozen=True)
class Job:
    """One episode to play."""

    tracker: str | type[Tracker]
    source: Source
    values: dict[str, Any]
    detections: DetectionMode
    every_score: bool
    code: str


Answer = Episode | FlockscopeError
Play = Callable[[Sequence[Source], dict[str, Any], bool], Generator[Answer, None, None]]


@contextmanager
def players(
    subject: Subject, detections: DetectionMode, workers: int = 1, cluster: str | None = None
) -> Iterator[Play]:
    """play(sources, values, every_score): an answer for each source in turn, an error where there is no episode.

    Once its taker stops nothing more is begun.
    """
    from sim.workers.start import results_in_order, start_workers

    if isinstance(subject.tracker, type) and (workers > 1 or cluster):
        remedy = "give file.py:Class or module:Class, or one worker"
        raise InputError(place="--workers", got="a class", expected="a name that workers can look up", remedy=remedy)
    with start_workers(workers, cluster) as run:
        alone, held = workers == 1 and cluster is None, Cache(HELD)

        def play(sources: Sequence[Source], values: dict[str, Any], every: bool) -> Generator[Answer, None, None]:
            jobs = [Job(subject.tracker, s, values, detections, every, subject.code) for s in sources]
            if alone:
                yield from (_attempt(job, subject, held) for job in jobs)
            else:
                yield from results_in_order(run, play_job, jobs)

        yield play


def play_job(job: Job) -> Answer:
    """Play an episode in a worker, which keeps what it opened; WorkError where its tracker is another one."""
    return _attempt(job, *_kept(job.tracker, job.code))


@cache
def _kept(tracker: str | type[Tracker], code: str) -> tuple[Subject, Cache]:
    subject = subject_of(tracker)
    if subject.code != code:
        raise WorkError(
            place="tracker", got=f"another {subject.name} in a worker", expected="the file as it is here",
            remedy="put the same file there, and start the workers anew",
        )  # fmt: skip
    return subject, Cache(HELD)


def _attempt(job: Job, subject: Subject, held: Cache) -> Answer:
    try:
        return subject.play(job.source, job.values, job.detections, held, job.every_score)
    except FlockscopeError as error:
        return error
