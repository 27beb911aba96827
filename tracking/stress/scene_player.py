"""Episodes of a sweep: trackers and the oracle on one scene, played here or in a worker; their store on disk.

All who play a scene play it in one process, so that it is simulated once.
"""

from __future__ import annotations

import json
import time
import traceback
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from functools import cache
from pathlib import Path
from typing import Any

from scenarios.errors import FlockscopeError, InputError, WorkError, shortened
from sim.store.atomic import write_file
from sim.types import DetectionMode
from sim.workers.calls import RemoteTraceback
from tracking.episodes.episode import Episode, streams_for
from tracking.episodes.episode_cache import OpenedSource
from tracking.episodes.parallel_episodes import EpisodeTask, opened_sources, play_task, playing_workers, used_by
from tracking.episodes.sources import Source
from tracking.episodes.tuned_tracker import TunedTracker, tuned_tracker
from tracking.oracle import oracle
from tracking.running.detection_mode import input_kind
from tracking.running.tracker_registry import find
from tracking.running.used_files import UsedFiles, changes

ORACLE = "oracle"  # its name among the trackers
TRACE_LINES = 8  # of the traceback of a failed tracker, the last ones


@dataclass(frozen=True)
class OracleTask:
    """An episode of the oracle with the input that a tracker gets."""

    tracker: TunedTracker
    source: Source
    detections: DetectionMode


Tasks = tuple[EpisodeTask | OracleTask, ...]  # all of one scene


@dataclass(frozen=True)
class Outcome:
    """The result of an episode: its scores by key, or {} and why there are none. `left_out` says how the script did not
    come true, `failed` how the tracker failed; else they are ""."""

    scores: dict[str, float]
    seconds: float = 0.0  # in the tracker
    frames: int = 0
    left_out: str = ""
    failed: str = ""
    traceback: str = ""  # of the failed tracker's own code, its last lines
    used: dict[str, str] = field(default_factory=dict)  # by the tracker, as `used_files.used`


PlayScenes = Callable[[Sequence[Tasks]], Iterator[Sequence[Outcome]]]  # Yields the outcomes of each scene, in order.


def contender(name: str, step_timeout: float | None = None) -> TunedTracker:
    """Returns the tracker of this name for a sweep; step_timeout: s, None for no limit. Raises InputError if there is
    none."""
    find(name)
    return tuned_tracker(name, step_timeout)


@contextmanager
def scene_player(workers: int = 1, cluster: str | None = None) -> Iterator[PlayScenes]:
    """Context manager: opens the workers and yields the function that plays scenes on them (`PlayScenes`)."""
    from sim.workers.start import results_in_order

    with playing_workers(workers, cluster) as run:
        yield lambda scenes: results_in_order(run, play_scene, scenes, _lost)


def _lost(tasks: Tasks, error: WorkError) -> list[Outcome]:
    raise error.replaced(file=", ".join(dict.fromkeys(task.tracker.name for task in tasks)), place=tasks[0].source.name)


def play_scene(tasks: Tasks) -> list[Outcome]:
    """Plays all episodes of one scene and returns an outcome for each. If the scene cannot be made, no episode is
    played and all outcomes are `left_out`."""
    first = tasks[0]
    try:
        opened = opened_sources().open(first.source, streams_for(first.tracker.tracker, first.detections))
        _ = opened.truth
    except FlockscopeError as error:
        return [Outcome({}, left_out=error.line())] * len(tasks)
    return [_play(task) if isinstance(task, EpisodeTask) else play_oracle(task, opened) for task in tasks]


def _play(task: EpisodeTask) -> Outcome:
    return replace(_outcome(play_task(task)), used=used_by(task.tracker))


def play_oracle(task: OracleTask, opened: OpenedSource) -> Outcome:
    """Returns the outcome of the oracle on an opened sequence, scored as by `tracking.comparison.compare_one`."""
    sequence, mode = opened.sequence, task.detections
    frames = () if mode == "image" else sequence.without_pictures()
    kind = input_kind(task.tracker.needs, mode, sequence, frames)
    try:
        given = {"detections": mode, "input": kind}
        scores = opened.scorer.evaluate(oracle(sequence, given, inputs=opened.input_frames, scorer=opened.scorer))
    except FlockscopeError as error:
        return _outcome(error)
    return Outcome({key: value for key, value in scores.items() if value == value}, frames=sequence.length or 0)


def _outcome(result: Episode | FlockscopeError) -> Outcome:
    if isinstance(result, Episode):
        return Outcome(dict(result.scores), result.seconds_tracking, result.frames, result.left_out)
    return Outcome({}, failed=result.line(), traceback=_traceback(result.__cause__))


def _traceback(cause: BaseException | None) -> str:
    if cause is None:
        return ""
    remote = isinstance(cause.__cause__, RemoteTraceback)  # raised in the process of a tracker with a limit of time
    text = str(cause.__cause__) if remote else "".join(traceback.format_exception(cause, chain=False))
    return "\n".join(text.strip().splitlines()[-TRACE_LINES:])


STORED = {"key", "tracker", *Outcome.__dataclass_fields__} - {"used"}  # Keys that each line of a store has.


@dataclass
class Store:
    """The episodes of a sweep in a file, one line each.

    Stored episodes of a tracker that has changed are left out. State: `known`, the lines by key of the episode;
    `taken`, the keys of those that were stored before; `used`, what each tracker has used, by name; `date`, when the
    file was written last before.

    fresh: True leaves all stored episodes out, and removes them.
    """

    path: Path
    fresh: bool = False
    known: dict[str, dict[str, Any]] = field(default_factory=dict)
    taken: set[str] = field(default_factory=set)
    used: dict[str, UsedFiles] = field(default_factory=dict)
    date: str = ""

    def __post_init__(self) -> None:
        text = self.path.read_text(encoding="utf-8") if self.path.exists() else ""
        rows = list[dict[str, Any]]()
        for line in text.splitlines():
            try:
                row = json.loads(line)
            except ValueError:  # the last line of a sweep that was killed
                continue
            if not isinstance(row, dict) or not row.keys() >= STORED:
                raise InputError(
                    file=self.path, got=shortened(line, 80), expected="episodes of `flockscope stress`",
                    remedy="move the file away, or choose another --out",
                )  # fmt: skip
            rows.append(row)
        if text and (self.fresh or not text.endswith("\n")):
            rows = [] if self.fresh else rows
            write_file(self.path, "".join(json.dumps(row) + "\n" for row in rows).encode())
        if rows:
            self.date = time.strftime("%Y-%m-%d %H:%M", time.localtime(self.path.stat().st_mtime))
        changed = cache(lambda used: changes(json.loads(used)))
        self.known = {row["key"]: row for row in rows if not changed(json.dumps(row.get("used", {})))}
        self.taken = set(self.known)

    def add(self, row: dict[str, Any]) -> None:
        """Stores an episode, a dict with its "key", in memory and as a new last line of the file."""
        self.used.setdefault(row["tracker"], UsedFiles()).add(row["tracker"], row["used"])
        self.known[row["key"]] = row
        self.path.parent.mkdir(parents=True, exist_ok=True)
        with self.path.open("a", encoding="utf-8") as file:
            file.write(json.dumps(row) + "\n")
