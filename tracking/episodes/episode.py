"""Whole episodes for searches: a tracker with its parameters plays a source (one sequence) and is scored against its
truth.

`play` plays an episode at once and returns an `Episode`, `Rollout` plays frame by frame. With a `SourceCache`, which
keeps opened sequences, later episodes on a source are cheap.
"""

from __future__ import annotations

import time
from collections.abc import Iterator, Mapping
from collections.abc import Sequence as SequenceOf
from dataclasses import KW_ONLY, dataclass
from itertools import islice
from typing import TYPE_CHECKING, Any

from scenarios.errors import InputError
from sim.types import DetectionMode, Frame, Sequence, Tracker, Tracks, Truth
from tracking.episodes.episode_cache import OpenedSource, SourceCache
from tracking.episodes.sources import Source, sources
from tracking.running.prepare import Params, prepare
from tracking.running.time_limit import TimeLimited

__all__ = ["Episode", "Rollout", "Source", "SourceCache", "play", "sources", "streams_for"]

if TYPE_CHECKING:
    from tracking.scoring.people import Similarity

AnyTracker = str | type[Tracker] | TimeLimited


@dataclass(frozen=True)
class Episode:
    """The result of an episode: one tracker on one sequence.

    Attributes:
        name: Name of the scenario or recording.
        seed: Seed of the source.
        objective: Mean of HOTA and group_F1, or the one of them that is known; nan if both are unknown.
        scores: Scores by key of the catalogue, without scores that are nan.
        frames: Number of frames played.
        seconds_tracking: Time spent in the tracker and in checks of its tracks, s, without reading frames.
        left_out: "" if the scene was played; else why not, namely how its script did not come true.
    """

    name: str
    seed: int
    objective: float
    scores: dict[str, float]
    frames: int
    seconds_tracking: float
    left_out: str = ""


def play(
    tracker: AnyTracker,
    source: Source,
    config: Params = None,
    *,
    detections: DetectionMode | None = None,
    tracker_seed: int = 0,
    cache: SourceCache | None = None,
    every_score: bool = False,
    similarity: Similarity | None = None,
) -> Episode:
    """Plays one episode; its objective equals `tracking.evaluate` of the tracks of `tracking.track`.

    A simulated source is drawn as pictures only if `detections` is "image" or the tracker takes neither boxes nor
    points.

    Args:
        tracker: Name, file.py:Class, module:Class, class or TimeLimited.
        source: The sequence to play on: a scenario's entry with a seed, a path, or a Sequence.
        config: The tracker's parameters, as `params` of `tracking.track`; None for the defaults.
        detections: The tracker's input, "image", "file" or "truth"; None takes the first that is possible.
        tracker_seed: Seed of the tracker's random numbers.
        cache: Where the opened source is kept for later episodes; None keeps nothing.
        every_score: True computes all scores of the catalogue, False only objective, HOTA and group_F1.
        similarity: How people are compared, as in `tracking.evaluate`; None chooses by the data.

    Raises:
        InputError: An argument is wrong, tracker and source do not fit, the source has no labels, or the tracks lack
            the boxes or positions to compare.
        WorkError: The tracker fails.
    """
    rollout = Rollout(
        tracker, source, config, detections=detections, tracker_seed=tracker_seed, cache=cache, similarity=similarity
    )
    for _ in rollout.advance():
        pass
    return rollout.episode(rollout.scores(every_score))


@dataclass(eq=False)
class Rollout:
    """An episode that is played frame by frame; the arguments are those of `play`.

    State: the prepared tracker; tracks, one `Tracks` per frame so far; seconds spent on tracking.
    """

    tracker: AnyTracker
    source: Source
    config: Params = None
    _: KW_ONLY
    detections: DetectionMode | None = None
    tracker_seed: int = 0
    cache: SourceCache | None = None
    similarity: Similarity | None = None

    def __post_init__(self) -> None:
        streams = streams_for(self.tracker, self.detections)
        open_source = OpenedSource if self.cache is None else self.cache.open
        self.opened: OpenedSource = open_source(self.source, streams)
        _ = self.truth  # a source without labels cannot be played
        self.prepared = prepare(
            self.tracker, self.sequence, params=self.config, detections=self.detections, seed=self.tracker_seed,
            inputs=self.opened.input_frames,
        )  # fmt: skip
        self.tracks: list[Tracks] = []
        start = time.perf_counter()
        self.prepared.reset(self.tracker_seed)
        self.seconds_tracking = time.perf_counter() - start
        self._completion, self._completed = self.prepared.completion(objective=True), list[Tracks]()
        self._standing = list[Tracks]()  # `_completed` on the ground, as far as this was needed
        self._fed = 0
        self._frames: Iterator[Frame] | None = None
        self._next: Frame | None = None

    def __getstate__(self) -> dict[str, Any]:
        # An iterator that draws or reads pictures cannot be copied: a copy begins one at its own next frame.
        return {**self.__dict__, "_frames": None}

    @property
    def sequence(self) -> Sequence:
        """The opened sequence that is played."""
        return self.opened.sequence

    @property
    def truth(self) -> Truth:
        """The labels of the sequence."""
        return self.opened.truth

    @property
    def length(self) -> int:
        """Number of frames of the whole sequence, played or not."""
        return self.truth.length

    def advance(self, upto: int | None = None) -> Iterator[tuple[Frame, Tracks]]:
        """Plays up to and with frame number `upto` (from 1; None: the last); yields each frame and its `Tracks`. A
        frame is played only when the iterator is asked for it. After an error, a new call repeats the same frame."""
        last = self.length if upto is None else min(upto, self.length)
        while len(self.tracks) < last:
            if self._frames is None:
                done = len(self.tracks) + (self._next is not None)
                self._frames = islice(self.prepared.frames(), done, None)
            self._next = frame = self._next or next(self._frames, None)
            if frame is None:
                return
            start = time.perf_counter()
            tracks = self.prepared.step(frame)
            self.seconds_tracking += time.perf_counter() - start
            self.tracks.append(tracks)
            self._next = None
            yield frame, tracks

    def episode(self, scores: dict[str, float]) -> Episode:
        """Returns the result of the frames played so far. scores: those of `scores`."""
        objective, source = scores.get("objective", float("nan")), self.source
        return Episode(source.name, source.seed, objective, scores, len(self.tracks), self.seconds_tracking)

    def scores(self, every: bool = False) -> dict[str, float]:
        """Returns the scores of the frames so far by key, without those that are nan: objective, HOTA and group_F1, or
        if `every` is True all. Raises InputError if tracks and labels cannot be compared."""
        return self._scores(self._whole(every), range(1, len(self.tracks) + 1), every)

    def window_objective(self, first: int) -> float:
        """Returns the objective of the frames `first` to the last one played, nan if it is unknown. Groups are those
        that the tracks from frame 1 on show; what has to wait for the scale or the ground is grouped by what is known
        so far."""
        tracks = self._grouped()
        if len(tracks) < len(self.tracks):
            tracks = self._whole(every=False)
        first = max(first, 1)
        window = tracks[first - 1 :]
        if any(t.groups is None for t in window):
            window = tracks  # groups are derived from earlier frames, too
        elif tracks is self._completed:
            window = self._placed(first)
        return self._scores(window, range(first, len(self.tracks) + 1), every=False).get("objective", float("nan"))

    def _grouped(self) -> SequenceOf[Tracks]:
        self._completed += self._completion.add(self.tracks[self._fed :])
        self._fed = len(self.tracks)
        return self._completed

    def _placed(self, first: int) -> SequenceOf[Tracks]:
        """Returns the completed tracks from the frame `first` on, where they stand if they are compared there. Windows
        overlap by their margins, and to find where boxes stand takes most of the time that it takes to score them."""
        from tracking.grouping.foot_points import standing
        from tracking.scoring.ground_or_image import stands

        window, truth = self._completed[first - 1 :], self.opened.scorer.truth
        if not stands(truth, window, self.prepared.input, self.similarity):
            return window
        assert truth.camera is not None
        self._standing += standing(self._completed[len(self._standing) :], truth.camera, truth.scene)
        return self._standing[first - 1 :]

    def _whole(self, every: bool) -> SequenceOf[Tracks]:
        from tracking.grouping.foot_points import completed

        if not every and self._fed and len(self._grouped()) == len(self.tracks):
            return self._completed
        known = self.prepared.context
        return completed(
            self.tracks, known.fps, self.prepared.px_per_m(self.tracks), camera=known.camera, scene=known.scene,
            image_size=known.image_size, objective=not every,
        )[0]  # fmt: skip

    def _scores(self, tracks: SequenceOf[Tracks], frames: range, every: bool) -> dict[str, float]:
        from tracking.running.run import TrackingRun
        from tracking.scoring.people import IncomparableError

        try:
            run = TrackingRun(tuple(tracks), {"input": self.prepared.input})
            (compared,) = self.opened.scorer.compare([run], self.similarity, frames)
            found: Mapping[str, float] = compared.scores("hull") if every else compared.objective_scores()
        except IncomparableError as error:
            expected, remedy = "what tracks and labels have", "choose another similarity, or other detections"
            raise InputError(
                file=self.source.name, place="similarity", got=str(error), expected=expected, remedy=remedy
            ) from None
        return {key: value for key, value in found.items() if value == value}


def streams_for(tracker: AnyTracker, detections: DetectionMode | None) -> tuple[str, ...]:
    """Returns the pictures to draw of a simulated sequence for this tracker and input: some of "left", "right" and
    "background", or () if it gets boxes or points."""
    from tracking.running.tracker_registry import find

    needs = set((find(tracker) if isinstance(tracker, str) else tracker).needs)
    if detections in ("file", "truth") or (detections is None and needs & {"boxes", "points"}):
        return ()
    return ("left", "right", "background") if "stereo" in needs else ("left", "background")
