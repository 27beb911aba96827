"""Episodes of a sweep: one tracker on one scene, played in this process or in a worker, and their store on disk."""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import Any, Protocol

from scenarios.errors import FlockscopeError, InputError, OrderError, shortened
from sim.io.files.atomic import write_file
from sim.types import DetectionMode
from tracking.environment.episodes import Source, SourceCache, play
from tracking.running.time_limit import TimeLimited
from tracking.running.tracker_registry import code_hash, find, located

CACHE_BYTES = 512 * 2**20  # of sequences that each process keeps


@dataclass(frozen=True)
class Contender:
    """A tracker of a sweep."""

    name: str  # as it was given
    spec: str  # with an absolute path, for workers in another folder
    needs: tuple[str, ...]
    code: str  # hash of the file that defines it
    step_timeout: float | None = None


@dataclass(frozen=True)
class EpisodeJob:
    """One episode to play."""

    tracker: Contender
    source: Source
    detections: DetectionMode


@dataclass(frozen=True)
class Outcome:
    """What became of an episode: scores by key, () without; a script that did not come true; or a failed tracker."""

    scores: dict[str, float]
    seconds: float = 0.0
    left_out: str = ""
    failed: str = ""


class PlayJobs(Protocol):
    """A function that plays jobs."""

    def __call__(self, jobs: Sequence[EpisodeJob], /) -> Iterator[Outcome]:
        """Yields one outcome for each job, in order."""


def contender(name: str, step_timeout: float | None = None) -> Contender:
    """Returns a tracker of a sweep. Raises InputError if there is none of this name."""
    found = find(name)
    return Contender(name, located(name), tuple(found.needs), code_hash(found), step_timeout)


@contextmanager
def job_player(workers: int = 1, cluster: str | None = None) -> Iterator[PlayJobs]:
    """Opens the workers for the time of the context and returns the function that plays jobs on them."""
    from sim.workers.start import results_in_order, start_workers

    with start_workers(workers, cluster) as run:
        yield lambda jobs: results_in_order(run, play_job, jobs)


def play_job(job: EpisodeJob) -> Outcome:
    """Plays one episode; the tracker's seed is that of the scene."""
    limit = job.tracker.step_timeout
    tracker = job.tracker.spec if limit is None else TimeLimited(job.tracker.spec, limit)
    try:
        episode = play(
            tracker, job.source, detections=job.detections, tracker_seed=job.source.seed, cache=_cache(),
            every_score=True,
        )  # fmt: skip
    except OrderError as error:  # the scene's fault
        return Outcome({}, left_out=error.line())
    except FlockscopeError as error:
        return Outcome({}, failed=error.line())
    finally:
        if isinstance(tracker, TimeLimited):
            tracker.close()
    return Outcome(episode.scores, episode.seconds_tracking, episode.left_out)


@cache
def _cache() -> SourceCache:
    return SourceCache(CACHE_BYTES)


@dataclass
class Store:
    """The episodes of a sweep in a file, one line each; state: `known`, the lines by key of the episode."""

    path: Path
    known: dict[str, dict[str, Any]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        text = self.path.read_text(encoding="utf-8") if self.path.exists() else ""
        for line in text.splitlines():
            try:
                row = json.loads(line)
            except ValueError:  # the last line of a sweep that was killed
                continue
            if not isinstance(row, dict) or not row.keys() >= {"key", *Outcome.__dataclass_fields__}:
                raise InputError(
                    file=self.path, got=shortened(line, 80), expected="episodes of `flockscope stress`",
                    remedy="move the file away, or choose another --out",
                )  # fmt: skip
            self.known[row["key"]] = row
        if text and not text.endswith("\n"):
            write_file(self.path, "".join(json.dumps(row) + "\n" for row in self.known.values()).encode())

    def add(self, row: dict[str, Any]) -> None:
        """Stores an episode."""
        self.known[row["key"]] = row
        self.path.parent.mkdir(parents=True, exist_ok=True)
        with self.path.open("a", encoding="utf-8") as file:
            file.write(json.dumps(row) + "\n")
