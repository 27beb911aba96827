"""Whole episodes for searches and agents: a tracker with its parameters on a source, and the objective it reaches.

`sources(...)` says what is to be played on, `play(...)` plays one; a `Cache` makes the next episode on the same source
cheap. `Rollout` is an episode frame by frame.
"""

from __future__ import annotations

import time
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from sim.types import DetectionMode, Frame, Sequence, Tracker, Tracks, Truth
from tracking.environment.episode_cache import Cache, Held
from tracking.episode_source import Source, sources
from tracking.prepare import Params, prepare

__all__ = ["Cache", "Episode", "Rollout", "Source", "play", "sources", "streams_for"]

AnyTracker = str | type[Tracker]


@dataclass(frozen=True)
class Episode:
    """What came of an episode: objective (nan: nothing to score), the known scores that it is made of, by key of the
    catalogue; frames played; seconds in the tracker, and in grouping and scoring its answers."""

    name: str
    seed: int
    objective: float
    scores: dict[str, float]
    frames: int
    seconds_tracking: float
    seconds_scoring: float


def play(
    tracker: AnyTracker,
    source: Source,
    config: Params = None,
    *,
    detections: DetectionMode | None = None,
    tracker_seed: int = 0,
    cache: Cache | None = None,
    upto: int | None = None,
    every_score: bool = False,
) -> Episode:
    """One episode, from the first frame to the last, or to `upto`.

    tracker, config, detections: as for `tracking.track`, but that a simulated source is drawn only where "image" is
    asked for, or the tracker takes nothing else. The objective is exactly that of
    `tracking.evaluate(sequence.truth, tracking.track(…))`, up to that frame. every_score: compute the whole catalogue.
    Errors are those of `tracking.track`, and InputError for a source without labels.
    """
    rollout = Rollout(tracker, source, config, detections=detections, tracker_seed=tracker_seed, cache=cache)
    for _ in rollout.advance(upto):
        pass
    return rollout.episode(every_score)


class Rollout:
    """An episode frame by frame. State: the tracker, its answers so far, the last frame, the seconds spent."""

    def __init__(
        self,
        tracker: AnyTracker,
        source: Source,
        config: Params = None,
        *,
        detections: DetectionMode | None = None,
        tracker_seed: int = 0,
        cache: Cache | None = None,
    ) -> None:
        self.source = source
        streams = streams_for(tracker, detections)
        self.held: Held = Held(source, streams) if cache is None else cache.hold(source, streams)
        self.truth: Truth = self.held.truth
        self.ready = prepare(tracker, self.sequence, params=config, detections=detections, seed=tracker_seed)
        self.answers: list[Tracks] = []
        self.seconds_tracking = self.seconds_scoring = 0.0
        begun = time.perf_counter()
        self.ready.reset(tracker_seed)
        self.seconds_tracking += time.perf_counter() - begun
        self._frames = self.ready.frames()
        self._next: Frame | None = None
        self.last: Frame | None = None

    @property
    def sequence(self) -> Sequence:
        """What is played on."""
        return self.held.sequence

    @property
    def length(self) -> int:
        """Frames of the whole episode."""
        return self.truth.length

    def advance(self, upto: int | None = None) -> Iterator[tuple[Frame, Tracks]]:
        """Play on, to the frame `upto` or to the last: each frame as the tracker was given it, and its answer.

        After an error of the tracker's the same frame comes again.
        """
        last = self.length if upto is None else min(upto, self.length)
        while len(self.answers) < last:
            self._next = frame = self._next or next(self._frames, None)
            if frame is None:
                return
            begun = time.perf_counter()
            answer = self.ready.step(frame)
            self.seconds_tracking += time.perf_counter() - begun
            self.answers.append(answer)
            self._next, self.last = None, frame
            yield frame, answer

    def episode(self, every_score: bool = False) -> Episode:
        """What has come of it so far."""
        scores = self.scores(every_score)
        return Episode(
            self.source.name,
            self.source.seed,
            scores.get("objective", float("nan")),
            scores,
            len(self.answers),
            self.seconds_tracking,
            self.seconds_scoring,
        )

    def scores(self, every: bool = False) -> dict[str, float]:
        """The known scores of the frames so far, by key: the objective and what it is the mean of, or all."""
        begun = time.perf_counter()
        px_per_m = self.ready.px_per_m(self.answers)
        found = self._every_score(px_per_m) if every else self.held.judge.scores(self.answers, px_per_m)
        self.seconds_scoring += time.perf_counter() - begun
        return {key: value for key, value in found.items() if value == value}

    def _every_score(self, px_per_m: float) -> Mapping[str, float]:
        from tracking.grouping.grouped_tracks import with_groups

        answers = with_groups(self.answers, self.ready.context.fps, px_per_m) if self.answers else ()
        return self.held.judge.scorer.evaluate(answers, frames=len(self.answers))


def streams_for(tracker: AnyTracker, detections: DetectionMode | None) -> tuple[str, ...]:
    """The pictures that a simulated sequence must have for this tracker, () none."""
    from tracking.tracker_registry import find

    needs = set((find(tracker) if isinstance(tracker, str) else tracker).needs)
    if detections in ("file", "truth") or (detections is None and needs & {"boxes", "points"}):
        return ()
    return ("left", "right", "background") if "stereo" in needs else ("left", "background")
