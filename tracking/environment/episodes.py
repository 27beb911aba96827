"""Whole episodes for searches: a tracker with its parameters plays a source and is scored.

`play` plays an episode at once, `Rollout` frame by frame. With a `SourceCache` later episodes on a source are cheap.
"""

from __future__ import annotations

import time
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from sim.types import DetectionMode, Frame, Sequence, Tracker, Tracks, Truth
from tracking.environment.episode_cache import OpenedSource, SourceCache
from tracking.episode_source import Source, sources
from tracking.prepare import Params, prepare

__all__ = ["Episode", "Rollout", "Source", "SourceCache", "play", "sources", "streams_for"]

AnyTracker = str | type[Tracker]


@dataclass(frozen=True)
class Episode:
    """The result of an episode.

    name, seed: of the source; objective: nan if there is nothing to score; scores: by key of the catalogue, without
    those that are nan; frames: number played; seconds_tracking: time in the tracker; seconds_scoring: time for groups
    and scores.
    """

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
    cache: SourceCache | None = None,
    upto: int | None = None,
    every_score: bool = False,
) -> Episode:
    """Plays one episode, from the first frame to the last or to frame `upto`, and returns its result.

    tracker, config, detections: as for `tracking.track`. A simulated source is drawn as pictures only if `detections`
    is "image" or the tracker takes neither boxes nor points. The objective equals that of
    `tracking.evaluate(sequence.truth, tracking.track(…))` up to that frame. every_score: compute the whole catalogue.
    Raises the errors of `tracking.track`, and InputError if the source has no labels.
    """
    rollout = Rollout(tracker, source, config, detections=detections, tracker_seed=tracker_seed, cache=cache)
    for _ in rollout.advance(upto):
        pass
    return rollout.episode(every_score)


class Rollout:
    """An episode that is played frame by frame; the arguments are those of `play`.

    State: the prepared tracker, the tracks of the frames so far, the last frame, the seconds spent.
    """

    def __init__(
        self,
        tracker: AnyTracker,
        source: Source,
        config: Params = None,
        *,
        detections: DetectionMode | None = None,
        tracker_seed: int = 0,
        cache: SourceCache | None = None,
    ) -> None:
        self.source = source
        streams = streams_for(tracker, detections)
        self.opened: OpenedSource = OpenedSource(source, streams) if cache is None else cache.open(source, streams)
        self.truth: Truth = self.opened.truth
        self.prepared = prepare(tracker, self.sequence, params=config, detections=detections, seed=tracker_seed)
        self.tracks: list[Tracks] = []
        self.seconds_tracking = self.seconds_scoring = 0.0
        start = time.perf_counter()
        self.prepared.reset(tracker_seed)
        self.seconds_tracking += time.perf_counter() - start
        self._frames = self.prepared.frames()
        self._next: Frame | None = None
        self.last: Frame | None = None

    @property
    def sequence(self) -> Sequence:
        """The sequence that is played."""
        return self.opened.sequence

    @property
    def length(self) -> int:
        """Number of frames of the whole episode."""
        return self.truth.length

    def advance(self, upto: int | None = None) -> Iterator[tuple[Frame, Tracks]]:
        """Plays to frame `upto` or to the last one; yields each frame as the tracker got it, and the tracker's tracks.

        After an error of the tracker the next call begins with the same frame.
        """
        last = self.length if upto is None else min(upto, self.length)
        while len(self.tracks) < last:
            self._next = frame = self._next or next(self._frames, None)
            if frame is None:
                return
            start = time.perf_counter()
            tracks = self.prepared.step(frame)
            self.seconds_tracking += time.perf_counter() - start
            self.tracks.append(tracks)
            self._next, self.last = None, frame
            yield frame, tracks

    def episode(self, every_score: bool = False) -> Episode:
        """Returns the result of the frames so far. every_score: compute the whole catalogue."""
        scores = self.scores(every_score)
        return Episode(
            self.source.name,
            self.source.seed,
            scores.get("objective", float("nan")),
            scores,
            len(self.tracks),
            self.seconds_tracking,
            self.seconds_scoring,
        )

    def scores(self, every: bool = False) -> dict[str, float]:
        """Returns the scores of the frames so far by key, without those that are nan.

        every: the whole catalogue; else the objective and the scores that it is the mean of.
        """
        start = time.perf_counter()
        px_per_m = self.prepared.px_per_m(self.tracks)
        found = self._every_score(px_per_m) if every else self.opened.judge.scores(self.tracks, px_per_m)
        self.seconds_scoring += time.perf_counter() - start
        return {key: value for key, value in found.items() if value == value}

    def _every_score(self, px_per_m: float) -> Mapping[str, float]:
        from tracking.grouping.grouped_tracks import with_groups

        tracks = with_groups(self.tracks, self.prepared.context.fps, px_per_m) if self.tracks else ()
        return self.opened.judge.scorer.evaluate(tracks, frames=len(self.tracks))


def streams_for(tracker: AnyTracker, detections: DetectionMode | None) -> tuple[str, ...]:
    """Returns the pictures that a simulated sequence needs for this tracker, () if it needs none.

    They are needed if `detections` is "image", or is None and the tracker takes neither boxes nor points.
    """
    from tracking.tracker_registry import find

    needs = set((find(tracker) if isinstance(tracker, str) else tracker).needs)
    if detections in ("file", "truth") or (detections is None and needs & {"boxes", "points"}):
        return ()
    return ("left", "right", "background") if "stereo" in needs else ("left", "background")
