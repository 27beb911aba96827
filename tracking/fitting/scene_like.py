"""`scene_like`: a scenario in which people walk as in a recording, seen by a camera and a detector like its own (ours).

Without labels, the tracks of `blob` on the recording's detections stand for the people: those that last, smoothed over
time and completed where they were not detected. The detector's profile is fitted to them as to labels
(`tracking.fitting.sensor`). People who are found so are fewer than the real ones. How many fewer follows from simulated
detections of the people found, in which the same procedure again finds fewer (indirect inference, Gouriéroux, Monfort
and Renault 1993). Whoever is never detected for seconds is missed all the same, so that a detector with long gaps seems
better than it is.

The camera is the one on whose ground the boxes agree best (`tracking.grouping.ground_of_boxes`). Each walk becomes a
way on this ground with its speed, walked as often as keeps as many people in view as in the recording, at other times
for each seed.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from scenarios.errors import InputError, counted
from scenarios.loading.toml_files import dump
from scenarios.schema.groups import FASTEST
from scenarios.schema.scenario import Scenario
from scenarios.schema.sensor import Sensor
from sim.detector.sense import sense
from sim.geometry.boxes import centres
from sim.scene.camera import foot_points, scale_of_all_boxes
from sim.scene.visibility import image_size_of_boxes
from sim.sequence import simulate
from sim.types import Array, Camera, Detections, Frame, Ints, Tracks, Truth
from sim.types import Sequence as Recording
from tracking.fitting.detection_matching import match_detections, match_sequence
from tracking.fitting.sensor import fit_matched
from tracking.grouping.ground_of_boxes import fit_ground
from tracking.running.run import track

LEAST, LASTING = 5, 1.5  # frames of a person who is seen; s of a track that counts as a person
SMOOTH = 1.0  # s over which boxes are smoothed
SEEDS = range(30_000, 30_004)  # of the simulated detections
TRIES = 2  # of how often ways are walked
LARGEST = 2.0  # factor by which people may be more than those found
DURATION, WARMUP = 20.0, 20.0  # s of the scenario, and at most of its time before frame 1
STANDS, SLOWEST, RUNS = 0.25, 0.3, 3.0  # m/s: who is slower stands; least speed of a way; who is faster is doubted
BEYOND = 1.5  # s for which people walk before and after they were seen
HALF = 0.5  # truncation of a person who counts as in view
ASIDE = 0.5  # m by which ways are moved aside, at most
MARGIN = 2.0  # m of ground beyond all ways
FARTHEST = 60.0  # m from the camera


@dataclass(frozen=True)
class Walk:
    """One person's walk: frame (n,), successive frames from the first to the last detected one; box (n, 4): left, top,
    width, height, px, smoothed; group: -1 for alone."""

    frame: Ints
    box: Array
    group: int


@dataclass(frozen=True)
class Likeness:
    """A recording as a scenario, with the profile of its detector; people: mean number of people in view. measured:
    whether the recording has detections; else the detector is the default."""

    scenario: Scenario
    people: float
    measured: bool

    def to_toml(self) -> str:
        """Returns the text of the scenario's file."""
        return dump(self.scenario, defaults=False)

    def as_dict(self) -> dict[str, Any]:
        """Returns what was found, by name."""
        camera, sensor = self.scenario.camera, self.scenario.sensor
        return {
            "people": round(self.people, 1), "ways": len(self.scenario.group), "fps": camera.fps,
            "tilt_deg": camera.tilt_deg, "height": camera.height, "detect_prob": sensor.detect_prob,
            "clutter_rate": sensor.clutter_rate,
        }  # fmt: skip

    def text(self) -> str:
        """Returns what was found as a line."""
        found = self.as_dict()
        of = "" if self.measured else " by the default detector, as there are no detections"
        return (
            f"{found['people']} people in view on {found['ways']} ways; camera {found['height']} m high, looks "
            f"{found['tilt_deg']}° down, {found['fps']:g} frames/s; {found['detect_prob']:.0%} of people in full view "
            f"detected, {found['clutter_rate']:.2f} false alarms per frame{of}"
        )


def scene_like(recording: Recording, *, labels: bool = False) -> Likeness:
    """Returns a scenario like a recording with a detector's boxes.

    labels: True takes people and errors of the detector from the recording's labels, False looks at detections alone.
    Labels without detections give the detector of a scenario without keys.
    Raises InputError without boxes, with fewer than 2 people who are seen for 1.5 s, or if their boxes show no ground.
    """
    recording = _checked(recording, labels)
    run = track("blob", recording, detections="truth" if labels else "file")
    walks = _walks(run, recording.fps, 0.0 if labels else LASTING)
    if len(walks) < 2:
        got = f"{len(walks)} people seen for {LASTING:g} s" if not labels else f"{len(walks)} labelled people"
        raise InputError(
            file=recording.name, got=got, expected="2 or more",
            remedy="give a longer recording, or more frames per second",
        )  # fmt: skip
    size = recording.image_size or image_size_of_boxes(*[walk.box for walk in walks])
    people = _truth(walks, recording)
    if labels:
        known = recording.has_detections
        sensor, factor = fit_matched([match_sequence(recording)]) if known else Sensor(), 1.0
    else:
        found = [frame.detections for frame in recording.without_pictures() if frame.detections is not None]
        sensor = fit_matched([match_detections(people, found, size)])
        factor = _unseen(sensor, people, recording, size)
    wanted = factor * len(people.id) / people.length
    place = _place(walks, recording, size)
    scenario = place.scenario(sensor, factor)
    for _ in range(TRIES):
        factor *= wanted / max(_in_view(scenario), 0.1)
        scenario = place.scenario(sensor, factor)
    return Likeness(scenario, wanted, recording.has_detections)


def _checked(recording: Recording, labels: bool) -> Recording:
    """Returns the recording, with its length known. Raises InputError if it has no boxes."""
    if labels and recording.truth is not None and recording.truth.box is not None:
        return recording
    frames = list(recording.without_pictures())
    if not any(f.detections.box is not None and len(f.detections.box) for f in frames if f.detections is not None):
        raise InputError(
            file=recording.name, got="no detected boxes", expected="a recording with the boxes of a detector",
            remedy="add det/det.txt, give a MOT text of detections, or with labelled boxes --labels",
        )  # fmt: skip
    return recording if recording.length is not None else _recording(recording, frames)


def _recording(like: Recording, frames: Sequence[Frame]) -> Recording:
    """Returns a recording of detections alone."""
    size, scale = like.image_size, like.px_per_m
    return Recording(
        like.name, like.fps, len(frames), lambda: iter(frames), image_size=size, px_per_m=scale, has_detections=True
    )


def _walks(run: Sequence[Tracks], fps: float, lasting: float = LASTING) -> list[Walk]:
    """Returns the walks of tracks that last so many s, in the order of their ids."""
    from scipy.signal import savgol_filter

    rows = [(t.measured, t.id, t.group, t.box, np.full(len(t.id), t.index)) for t in run if t.box is not None]
    if not rows:
        return []
    measured, id, group, box, frame = (np.concatenate(column) for column in zip(*rows, strict=True))
    found = []
    for each in np.unique(id[measured]):
        mine = measured & (id == each)
        at, seen = frame[mine], box[mine]
        if np.ptp(at) < lasting * fps or len(at) < LEAST or not (seen[:, 2:] > 0).all():
            continue
        every = np.arange(at[0], at[-1] + 1)
        shape = np.column_stack([centres(seen)[:, 0], seen[:, 1] + seen[:, 3], np.log(seen[:, 2]), np.log(seen[:, 3])])
        shape = np.column_stack([np.interp(every, at, column) for column in shape.T])
        window = min(2 * round(SMOOTH * fps / 2) + 1, len(every) - 1 + len(every) % 2)
        shape = savgol_filter(shape, max(window, 3), 1, axis=0)
        width, height = np.exp(shape[:, 2:]).T
        smooth = np.column_stack([shape[:, 0] - width / 2, shape[:, 1] - height, width, height])
        names, counts = np.unique(group[mine], return_counts=True)
        found.append(Walk(every, smooth, int(names[counts.argmax()])))
    return found


def _truth(walks: Sequence[Walk], recording: Recording) -> Truth:
    """Returns the walks as labels."""
    frame = np.concatenate([walk.frame for walk in walks])
    id = np.repeat(np.arange(len(walks)), [len(walk.frame) for walk in walks])
    order, box = np.lexsort([id, frame]), np.concatenate([walk.box for walk in walks])
    rows, length = len(id), recording.length or 0
    return Truth(
        recording.name, recording.fps, length, recording.px_per_m, frame[order], id[order], np.full(rows, -1), None,
        None, box[order], np.ones(rows),
    )  # fmt: skip


def _unseen(sensor: Sensor, people: Truth, recording: Recording, size: tuple[int, int]) -> float:
    """Returns the factor by which people are more than those who are found in their simulated detections."""
    rows = 0
    for seed in SEEDS:
        found = _frames(sense(people, sensor, seed, None, size))
        rows += sum(len(w.frame) for w in _walks(track("blob", _recording(recording, found)), recording.fps))
    return min(len(people.id) * len(SEEDS) / max(rows, 1), LARGEST)


def _frames(found: Sequence[Detections]) -> list[Frame]:
    return [Frame(d.index, d.t, detections=d) for d in found]


def _in_view(scenario: Scenario) -> float:
    """Returns the mean number of people who are in view with half of their body or more."""
    counts = []
    for seed in SEEDS:
        truth = simulate(scenario, seed, streams=()).truth
        assert truth is not None
        assert truth.truncation is not None
        counts.append((truth.truncation <= HALF).sum() / truth.length)
    return float(np.mean(counts))


@dataclass(frozen=True)
class Way:
    """A way on the ground. points (3, 2): first, middle and last place, m. seconds: for which it was seen. count:
    number of people who walked it together."""

    points: Array
    seconds: float
    count: int

    @property
    def speed(self) -> float:
        """Along the way, m/s."""
        return float(np.linalg.norm(np.diff(self.points, axis=0), axis=1).sum()) / self.seconds

    @property
    def stands(self) -> bool:
        """Whether people stood rather than walked."""
        return self.speed < STANDS

    def often(self, seconds: float) -> float:
        """Returns how often it is walked in the scenario, if once in a recording of so many seconds."""
        return min(self.seconds / seconds, 1.0) if self.stands else (DURATION + self.seconds) / seconds

    def group(self, name: str, count: int, low: Array, high: Array, warmup: float) -> dict[str, Any]:
        """Returns the table of groups that walk it; low, high: places of the world's corners, m."""
        first, middle, last = self.points - low
        if self.stands:
            here = {"start": _near(middle), "goal": middle.round(2).tolist(), "enter": -warmup}
            return {"id": name, "size": self.count, "repeat": count, **here}
        pace = self.speed * BEYOND
        start, goal = first - _direction(middle - first) * pace, last + _direction(last - middle) * pace
        start, goal = (np.clip(end, MARGIN / 2, high - low - MARGIN / 2) for end in (start, goal))
        return {
            "id": name, "size": self.count, "start": _near(start), "via": [_near(middle)], "goal": _near(goal),
            "speed": round(min(max(self.speed, SLOWEST), FASTEST), 2), "at_goal": "leave", "repeat": count,
            "enter": {"uniform": [-min(round(self.seconds, 1), warmup), DURATION - 1.0]},
        }  # fmt: skip


def _near(place: Array) -> list[Any]:
    return [{"uniform": [round(float(v) - ASIDE, 2), round(float(v) + ASIDE, 2)]} for v in place]


def _direction(step: Array) -> Array:
    return np.asarray(step / max(float(np.linalg.norm(step)), 1e-9))


@dataclass(frozen=True)
class Place:
    """Where a recording was made: its ways, camera, fps, and length in seconds."""

    ways: Sequence[Way]
    camera: Camera
    fps: float
    seconds: float

    def scenario(self, sensor: Sensor, factor: float) -> Scenario:
        """Returns the scenario; factor: of how often each way is walked."""
        often = factor * np.array([way.often(self.seconds) for way in self.ways])
        counts = np.diff(np.floor(np.concatenate([[0.0], np.cumsum(often)]) + 0.5)).astype(int)
        chosen = [(way, int(n)) for way, n in zip(self.ways, counts, strict=True) if n] or [(self.ways[0], 1)]
        points = np.concatenate([way.points for way, _ in chosen])
        low, high = points.min(axis=0) - MARGIN, points.max(axis=0) + MARGIN
        warmup = min(math.ceil(max(way.seconds for way, _ in chosen)), WARMUP)
        groups = [way.group(f"way-{k + 1}", n, low, high, warmup) for k, (way, n) in enumerate(chosen)]
        camera = {
            "kind": "pinhole", "image": list(self.camera.image), "fps": self.fps, "crop": True, "yaw_deg": 0.0,
            "focal_px": round(float(self.camera.focal_px[0]), 1),
            "tilt_deg": round(math.degrees(math.asin(-float(self.camera.rotation[2, 2]))), 1),
            "height": round(float(self.camera.position[2]), 2),
            "position": np.round(self.camera.position[:2] - low, 2).tolist(),
        }  # fmt: skip
        return Scenario.model_validate(
            {
                "schema": 1, "about": "people who walk as in a recording", "duration": DURATION, "warmup": warmup,
                "world": {"size": np.round(high - low, 2).tolist()}, "camera": camera, "sensor": sensor,
                "group": groups,
            }
        )  # fmt: skip


def _place(walks: Sequence[Walk], recording: Recording, size: tuple[int, int]) -> Place:
    box = np.concatenate([walk.box for walk in walks])
    fit = fit_ground(box, scale_of_all_boxes(box[:, 3]), size)
    ways = [] if fit is None else _ways(walks, fit.camera, recording.fps)
    if fit is None or not ways:
        raise InputError(
            file=recording.name, got="boxes that stand on no ground", expected="boxes of people who stand and walk",
            remedy="check that boxes hold whole people; a camera straight above shows no ground",
        )  # fmt: skip
    fast = [way.speed for way in ways if way.speed > RUNS]
    if fast:
        words = f"{recording.name}: {len(fast)} of {counted(len(ways), 'way')} at {np.median(fast):.1f} m/s"
        warnings.warn(f"{words}: are {recording.fps:g} frames/s right? (--fps says otherwise)", stacklevel=4)
    return Place(ways, fit.camera, recording.fps, (recording.length or 0) / recording.fps)


def _ways(walks: Sequence[Walk], camera: Camera, fps: float) -> list[Way]:
    """Returns the ways of walks; people of one group who walk at the same time share one."""
    found: dict[tuple[int, int], list[Way]] = {}
    for k, walk in enumerate(walks):
        place = foot_points(walk.box, np.zeros(len(walk.box)), camera)
        if not np.isfinite(place).all() or np.abs(place).max() > FARTHEST:
            continue
        part = max(len(place) // 5, 1)
        middle = (len(place) - part) // 2
        points = np.array([np.median(place[first : first + part], axis=0) for first in (0, middle, len(place) - part)])
        key = (walk.group, 0) if walk.group >= 0 else (-1, k)
        found.setdefault(key, []).append(Way(points, len(place) / fps, 1))
    return [
        Way(np.mean([w.points for w in each], axis=0), float(np.mean([w.seconds for w in each])), len(each))
        for each in found.values()
    ]
