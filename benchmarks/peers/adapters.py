"""Trackers of other libraries as tracker classes with parameters, so that `track` and `tune` take them like ours.

Parameters have the names, units and defaults of the library; numbers of frames are theirs. SORT, ByteTrack, OC-SORT and
BoT-SORT (without appearance and camera motion) of roboflow `trackers` report the detected boxes as they are. norfair
and Stone Soup's JPDA report filtered boxes. What stands for a frame rate is that of the sequence.
"""

from __future__ import annotations

from dataclasses import dataclass
from datetime import datetime, timedelta
from typing import Any, ClassVar

import numpy as np

from sim.types import Array, Context, Detections, Frame, Tracks
from tracking.config import Config, param


def share(default: float, meaning: str, low: float = 0.01, high: float = 0.95) -> Any:
    return param(default, (low, high), "", meaning)


def frames(default: int, low: int, high: int, meaning: str) -> Any:
    return param(default, (low, high), "frames", meaning, "int")


def answer(frame: Frame, id: Any, box: Any, score: Any) -> Tracks:
    """Returns tracks in the image of boxes (N, 4), left, top, width, height, px."""
    box = np.asarray(box, float).reshape(-1, 4)
    n = len(box)
    pos, unknown, cov = box[:, :2] + box[:, 2:] / 2, np.full((n, 2), np.nan), np.tile(np.eye(4), (n, 1, 1))
    id, alone, score = np.asarray(id, np.int64).reshape(n), np.full(n, -1), np.asarray(score, float).reshape(n)
    return Tracks(frame.index, frame.t, "image", "person", id, alone, pos, unknown, cov, box, score)


def corners_of(box: Array) -> Array:
    """Returns left, top, right, bottom, px, of boxes (N, 4), left, top, width, height."""
    return np.c_[box[:, :2], box[:, :2] + box[:, 2:]]


def box_of(corners: Any) -> Array:
    """Returns boxes (N, 4), left, top, width, height, px, of left, top, right, bottom."""
    corners = np.asarray(corners, float).reshape(-1, 4)
    return np.c_[corners[:, :2], corners[:, 2:] - corners[:, :2]]


KEPT = "tracks", "frame_count", "_next_track_id", "_last_timestamp"  # what a tracker of theirs knows of earlier frames


class Roboflow:
    """A tracker of roboflow `trackers`. State: `tracker`, theirs; `used`, the config that it was made with.

    `config` may be replaced between two frames: a new tracker then goes on with the tracks of the old one.
    """

    needs = ("boxes",)
    kind: ClassVar[str]
    fixed: ClassVar[dict[str, Any]] = {}

    def __init__(self, config: Config) -> None:
        self.config = config

    def reset(self, context: Context, seed: int) -> None:
        """Makes a new tracker of theirs."""
        self.fps, self.used, self.tracker = context.fps, self.config, self._made(context.fps)

    def _made(self, fps: float) -> Any:
        import trackers

        return getattr(trackers, self.kind)(**self.config.as_dict(), **self.fixed, frame_rate=fps)

    def step(self, frame: Frame, detections: Detections) -> Tracks:
        """Returns the detections to which their tracker gives an id."""
        import supervision

        if self.config is not self.used:
            new, old = self._made(self.fps), vars(self.tracker)
            vars(new).update({name: old[name] for name in KEPT if name in old})
            self.used, self.tracker = self.config, new
        corners = corners_of(detections.box)
        given = supervision.Detections(
            xyxy=corners, confidence=detections.score.copy(), class_id=np.zeros(len(corners), int)
        )
        found = self.tracker.update(given)
        known = found.tracker_id >= 0
        return answer(frame, found.tracker_id[known], box_of(found.xyxy[known]), found.confidence[known])


@dataclass(frozen=True)
class SortConfig(Config):
    """Parameters of trackers.SORTTracker."""

    tracker: ClassVar[str] = "sort"
    lost_track_buffer: int = frames(30, 1, 150, "time that a lost track waits, in frames of 1/30 s")
    track_activation_threshold: float = share(0.25, "least score of a new track", 0.0)
    minimum_consecutive_frames: int = frames(3, 1, 6, "detections before a track has an id")
    minimum_iou_threshold: float = share(0.3, "least IoU of a match")


@dataclass(frozen=True)
class ByteTrackConfig(SortConfig):
    """Parameters of trackers.ByteTrackTracker."""

    tracker: ClassVar[str] = "bytetrack"
    track_activation_threshold: float = share(0.7, "least score of a new track", 0.0)
    minimum_consecutive_frames: int = frames(2, 1, 6, "detections before a track has an id")
    minimum_iou_threshold: float = share(0.1, "least IoU of a match")
    high_conf_det_threshold: float = share(0.6, "least score of a detection of the first matching", 0.0)


@dataclass(frozen=True)
class OcSortConfig(Config):
    """Parameters of trackers.OCSORTTracker."""

    tracker: ClassVar[str] = "ocsort"
    lost_track_buffer: int = frames(30, 1, 150, "time that a lost track waits, in frames of 1/30 s")
    minimum_consecutive_frames: int = frames(3, 1, 6, "detections before a track has an id")
    minimum_iou_threshold: float = share(0.3, "least IoU of a match")
    direction_consistency_weight: float = share(0.2, "weight of the direction in a match", 0.0)
    high_conf_det_threshold: float = share(0.6, "least score of a detection", 0.0)
    delta_t: int = frames(3, 1, 6, "frames over which a direction is measured")


@dataclass(frozen=True)
class BotSortConfig(Config):
    """Parameters of trackers.BoTSORTTracker."""

    tracker: ClassVar[str] = "botsort"
    lost_track_buffer: int = frames(30, 1, 150, "time that a lost track waits, in frames of 1/30 s")
    track_activation_threshold: float = share(0.7, "least score of a new track", 0.0)
    minimum_consecutive_frames: int = frames(2, 1, 6, "detections before a track has an id")
    minimum_iou_threshold_first_assoc: float = share(0.2, "least IoU of a match, first matching")
    minimum_iou_threshold_second_assoc: float = share(0.5, "least IoU of a match, second matching")
    minimum_iou_threshold_unconfirmed_assoc: float = share(0.3, "least IoU of a match of a new track")
    high_conf_det_threshold: float = share(0.6, "least score of a detection of the first matching", 0.0)


class Sort(Roboflow):
    """SORT (Bewley et al. 2016)."""

    kind, config_class = "SORTTracker", SortConfig


class ByteTrack(Roboflow):
    """ByteTrack (Zhang et al. 2022)."""

    kind, config_class = "ByteTrackTracker", ByteTrackConfig


class OcSort(Roboflow):
    """OC-SORT (Cao et al. 2023)."""

    kind, config_class = "OCSORTTracker", OcSortConfig


class BotSort(Roboflow):
    """BoT-SORT (Aharon et al. 2022) without appearance and camera motion."""

    kind, config_class, fixed = "BoTSORTTracker", BotSortConfig, {"enable_cmc": False}


@dataclass(frozen=True)
class NorfairConfig(Config):
    """Parameters of norfair.Tracker with the distance "iou", and of its Kalman filter."""

    tracker: ClassVar[str] = "norfair"
    distance_threshold: float = share(0.7, "greatest 1 - IoU of a match; norfair has no default")
    hit_counter_max: int = frames(15, 2, 60, "frames that a lost track waits")
    initialization_delay: int = frames(7, 0, 14, "detections before a track is reported; less than hit_counter_max")
    detection_threshold: float = share(0.0, "least score of a detection", 0.0)
    R: float = param(4.0, (0.1, 100.0), "px²", "measurement noise, variance", "log")
    Q: float = param(0.1, (0.001, 10.0), "px²", "process noise, variance", "log")


class Norfair:
    """A norfair.Tracker. State: `tracker`, theirs."""

    needs = ("boxes",)
    config_class = NorfairConfig

    def __init__(self, config: NorfairConfig) -> None:
        self.config = config

    def reset(self, context: Context, seed: int) -> None:
        """Makes a new tracker of theirs."""
        import norfair

        values = self.config.as_dict()
        kalman = norfair.OptimizedKalmanFilterFactory(R=values.pop("R"), Q=values.pop("Q"))
        values["initialization_delay"] = min(values["initialization_delay"], values["hit_counter_max"] - 1)
        self.tracker = norfair.Tracker(distance_function="iou", filter_factory=kalman, **values)

    def step(self, frame: Frame, detections: Detections) -> Tracks:
        """Returns their tracks but for those that wait."""
        from norfair import Detection

        pairs = zip(corners_of(detections.box), detections.score, strict=True)
        given = [Detection(points=corners.reshape(2, 2), scores=np.full(2, score)) for corners, score in pairs]
        found = [one for one in self.tracker.update(given) if one.live_points.any()]
        score = [one.last_detection.scores[0] for one in found]
        return answer(frame, [one.id for one in found], box_of([one.estimate.ravel() for one in found]), score)


@dataclass(frozen=True)
class StoneSoupConfig(Config):
    """Parameters of the JPDA; lengths are shares of a person's height in px, noises are standard deviations."""

    tracker: ClassVar[str] = "stonesoup"
    acceleration: float = param(0.3, (0.02, 3.0), "heights/s^1.5", "process noise of the box's middle", "log")
    resizing: float = param(0.1, (0.01, 1.0), "heights/s^0.5", "process noise of width and height", "log")
    noise: float = param(0.06, (0.01, 0.3), "heights", "measurement noise of middle, width and height", "log")
    prob_detect: float = share(0.9, "probability of detection", 0.3, 0.99)
    clutter: float = param(0.01, (1e-4, 10.0), "heights^-4", "density of false alarms", "log")
    wait: float = param(1.0, (0.1, 5.0), "s", "time after which a track without detection ends")
    least: int = frames(3, 1, 6, "detections before a track is reported")
    least_score: float = share(0.5, "least score of a detection", 0.0)


class StoneSoupJpda:
    """Stone Soup's JPDA with loopy belief propagation. State: `tracker`, theirs; ids and counts of their tracks.

    A track's state is x, vx, y, vy, width, height of the box's middle, in heights of a person.
    """

    needs = ("boxes",)
    config_class = StoneSoupConfig
    start = datetime(2000, 1, 1)

    def __init__(self, config: StoneSoupConfig) -> None:
        self.config = config

    def reset(self, context: Context, seed: int) -> None:
        """Makes a new tracker of theirs."""
        from stonesoup.dataassociator.probability import JPDAwithLBP
        from stonesoup.deleter.time import UpdateTimeDeleter
        from stonesoup.hypothesiser.probability import PDAHypothesiser
        from stonesoup.initiator.simple import SimpleMeasurementInitiator
        from stonesoup.models.measurement.linear import LinearGaussian
        from stonesoup.models.transition.linear import (
            CombinedLinearGaussianTransitionModel,
            ConstantVelocity,
            RandomWalk,
        )
        from stonesoup.predictor.kalman import KalmanPredictor
        from stonesoup.tracker.simple import MultiTargetMixtureTracker
        from stonesoup.types.state import GaussianState
        from stonesoup.updater.kalman import KalmanUpdater

        c, self.ids, self.context = self.config, dict[str, int](), context
        moves = [ConstantVelocity(c.acceleration**2)] * 2 + [RandomWalk(c.resizing**2)] * 2
        self.model = LinearGaussian(6, (0, 2, 4, 5), np.eye(4) * c.noise**2)
        predictor, updater = KalmanPredictor(CombinedLinearGaussianTransitionModel(moves)), KalmanUpdater(self.model)
        nearby = PDAHypothesiser(predictor, updater, c.clutter, prob_detect=c.prob_detect, prob_gate=0.99)
        prior = GaussianState([[0.0]] * 6, np.diag([1.0, 0.5, 1.0, 0.5, 1.0, 1.0]))
        self.tracker = MultiTargetMixtureTracker(
            SimpleMeasurementInitiator(prior, self.model), UpdateTimeDeleter(timedelta(seconds=c.wait)), self,
            JPDAwithLBP(nearby), updater,
        )  # fmt: skip
        iter(self.tracker)

    def __iter__(self) -> StoneSoupJpda:
        return self

    def __next__(self) -> tuple[datetime, set[Any]]:
        return self.given

    def step(self, frame: Frame, detections: Detections) -> Tracks:
        """Returns their tracks that have been detected often enough and are detected now."""
        from stonesoup.types.detection import Detection
        from stonesoup.types.update import Update

        now, height = self.start + timedelta(seconds=frame.t), 1.7 * self.context.px_per_m
        box = detections.box[detections.score >= self.config.least_score] / height
        given = np.c_[box[:, :2] + box[:, 2:] / 2, box[:, 2:]]
        self.given = now, {Detection(z[:, None], timestamp=now, measurement_model=self.model) for z in given}
        every = sorted(next(self.tracker)[1], key=lambda one: one.states[0].timestamp)
        found = [
            one for one in every
            if isinstance(one.state, Update) and sum(isinstance(s, Update) for s in one.states) >= self.config.least
        ]  # fmt: skip
        id = [self.ids.setdefault(one.id, len(self.ids)) for one in found]
        x = np.array([one.state_vector for one in found], float).reshape(-1, 6) * height
        return answer(frame, id, np.c_[x[:, [0, 2]] - x[:, 4:] / 2, x[:, 4:]], np.ones(len(found)))


PEERS: dict[str, tuple[str, type]] = {
    "SORT": ("roboflow", Sort),
    "ByteTrack": ("roboflow", ByteTrack),
    "OC-SORT": ("roboflow", OcSort),
    "BoT-SORT": ("roboflow", BotSort),
    "norfair": ("norfair", Norfair),
    "Stone Soup JPDA": ("stonesoup", StoneSoupJpda),
}  # library and adapter by the name in tables
