"""Trackers while pictures or boxes come in: `Live` takes them one by one, and tells at once who is there.

A run over a recording (`tracking.track`) is the same, played from a file: `RunningTracker` is the loop of both, and
nothing in it looks ahead. What is unknown is learned from the first frames:
- The background, from pictures that are spread over the first seconds. Nobody is tracked in these frames.
- The scale of the image, from the first boxes. The frames until then are tracked once it is known.
- The ground under boxes, if there is no camera, from the first tracks. Until then people are told, but no groups.
"""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from collections.abc import Sequence as SequenceOf
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from scenarios.errors import InputError, shortened
from scenarios.limits import FRAME_RATES, FRAMES, SCALES, is_number
from sim.arrays import no_ids
from sim.pictures.background_sample import BackgroundChoice, GivenSample, parse_choice
from sim.scene.camera import BOXES
from sim.types import (
    Array,
    Bools,
    Camera,
    DetectionMode,
    Detections,
    Frame,
    GroupEvent,
    Groups,
    Image,
    Ints,
    Scene,
    Sequence,
    Tracker,
    Tracks,
)
from tracking.grouping.ground_of_boxes import LONGEST
from tracking.grouping.grouping_choice import Grouping, default_grouping, grouping_of
from tracking.running import image_scale, tracker_registry
from tracking.running.counted_region import Mask, counted_region, detections_inside, inside_region
from tracking.running.detection_mode import BOTH, Given, as_needed
from tracking.running.prepare import PICTURED, Params, PreparedTracker, prepare, resolved_params
from tracking.running.run_info import run_info
from tracking.running.time_limit import TimeLimited

GAP = 15.0  # s without frames, after which a warning says so
MILLISECONDS = 1e11  # times above are no seconds since 1970
LEARNED = 10.0  # s from which a background is learned, if nothing else is said


class RunningTracker:
    """A prepared tracker with the groups and events of its tracks, frame by frame.

    prepared: from which nothing was reset yet. grouping: how groups are derived. seed: of the tracker.

    State: completion, of the tracks; idle, the frames before the first that is tracked.
    """

    def __init__(self, prepared: PreparedTracker, grouping: Grouping, seed: int) -> None:
        prepared.reset(seed)
        self.prepared, self.completion, self.idle = prepared, prepared.completion(grouping), list[Frame]()

    def step(self, frame: Frame) -> list[Tracks]:
        """Returns the tracks that the tracker reports for the next frame. They are none as long as a background is
        learned; the first ones follow those of the frames before, which are empty."""
        if frame.index <= self.prepared.untracked:
            self.idle.append(Frame(frame.index, frame.t))
            return []
        tracks, idle = self.prepared.step(frame), self.idle
        if self.completion.moving is None and getattr(self.prepared.tracker, "camera_moves", False):
            self.completion.moving = frame.index
        self.idle = []
        nobody = np.zeros(len(tracks.id), bool)
        empty = tracks.replace(groups=None, events=()).keep(nobody) if idle else tracks
        return [*(empty.replace(index=f.index, t=f.t) for f in idle), tracks]


@dataclass(frozen=True)
class Now:
    """What is known after a frame.

    index, t: of the frame, from 1, and its time, s. tracks: of the frame; None while what comes before is learned.
    completed: the tracks, with groups and events, of all frames that are completed now: of this frame, of earlier ones,
    too, if they had to wait, or of none. learns: what is being learned: "background", "scale", "ground", or "".
    """

    index: int
    t: float
    tracks: Tracks | None
    completed: tuple[Tracks, ...] = ()
    learns: str = ""

    @property
    def people(self) -> Ints:
        """The ids (N,) of the people who are there; of groups for a tracker of groups alone."""
        return no_ids() if self.tracks is None else self.tracks.id

    @property
    def groups(self) -> Groups:
        """The groups of the frame; none as long as it is not completed."""
        last = self.completed[-1].groups if self.completed else None
        return Groups.none() if last is None else last

    @property
    def events(self) -> tuple[GroupEvent, ...]:
        """The events that are reported now."""
        return tuple(event for tracks in self.completed for event in tracks.events)

    @property
    def counts(self) -> dict[str, int]:
        """How many people, and groups, are there now. Of a tracker of groups alone people are unknown and left out."""
        groups = {"groups": len(self.groups.id)}
        if self.tracks is None or self.tracks.unit == "group":
            return groups
        return {"people": len(self.tracks.id), **groups}


class Live:
    """A tracker that is given pictures, boxes or points one after another, and tells people, groups and events at once.

    It can be pickled, and goes on after that. Memory does not grow with time.

    Args:
        tracker: As in `tracking.track`.
        fps: Frames per second. Times are rounded to frames.
        px_per_m: Image scale, px per m; None: by the camera, else learned.
        params: As in `tracking.track`.
        camera: The calibration, or the path of its file.
        scene: Walls and stairs of the place.
        image_size: Width and height, px, of the pictures on which boxes were found; None if it is unknown.
        background: Frames from which a background is learned: "learn:N", the first N; or pictures (K, H, W, 3), BGR, of
            the place. None: the first 10 s.
        grouping: As in `tracking.track`.
        mask: As in `tracking.track`.
        seed: As in `tracking.track`.
        name: Of the run, in messages.

    Raises:
        InputError: An argument is wrong.

    Example:
        live = tracking.Live("blob", fps=25, px_per_m=40)
        for picture in pictures:
            now = live.step(picture)
            print(now.t, now.counts, [event.kind for event in now.events])
    """

    def __init__(
        self, tracker: str | type[Tracker] | Tracker | TimeLimited, *, fps: float, px_per_m: float | None = None,
        params: Params = None, camera: Camera | str | Path | None = None, scene: Scene | None = None,
        image_size: tuple[int, int] | None = None, background: str | Image | None = None,
        grouping: Grouping | str | Path | None = None, mask: Mask | None = None, seed: int = 0, name: str = "live",
    ) -> None:  # fmt: skip
        for option, value, (low, high) in (("fps", fps, FRAME_RATES), ("px_per_m", px_per_m, SCALES)):
            if value is not None and not is_number(value, low, high):
                expected = f"a number from {low:g} to {high:g}"
                raise InputError(place=option, got=repr(value), expected=expected, remedy=f"correct {option}")
        if isinstance(camera, str | Path):
            from tracking.recordings.calibration import read_calibration

            camera = read_calibration(Path(camera))
        self.tracker, self.params, self.seed = tracker, resolved_params(tracker, params), seed
        self.grouping = grouping_of(grouping) if isinstance(grouping, str | Path) else grouping or default_grouping()
        self.pictures = None if background is None or isinstance(background, str) else background
        self.choice = _choice(background if isinstance(background, str) else None, fps)
        scale = float("nan") if px_per_m is None else float(px_per_m)
        self.sequence = Sequence(
            name, float(fps), None, _no_frames, image_size=image_size, camera=camera, scene=scene, px_per_m=scale,
            source={"kind": "live", "path": name},
        )  # fmt: skip
        self.mask = mask
        self.region: Bools | None = None
        self.index = self.frames = self.boxes = 0
        self.unobserved: list[tuple[int, int]] = []
        self.zero = 0.0
        self.reported: Tracks | None = None
        self.last: Tracks | None = None
        self.mode: DetectionMode | None = None
        self.running: RunningTracker | None = None
        self.waiting, self.sample = list[Frame](), list[Image]()

    def step(
        self, image: Image | None = None, *, right: Image | None = None, boxes: Any = None, points: Any = None,
        scores: Any = None, t: float | None = None,
    ) -> Now:  # fmt: skip
        """Takes the next frame, and returns what is known after it.

        Args:
            image: The picture (H, W, 3), BGR, uint8.
            right: That of the right camera of a stereo pair.
            boxes: The detector's boxes (M, 4): left, top, width, height, px; or (M, 5) with scores.
            points: Positions on the ground (M, 2), m, beside boxes or in place of them.
            scores: Scores (M,) of boxes or points, from 0 to 1.
            t: Time, s, from 0 or since 1970; None: one frame later than the last. Frames in between are taken as lost.

        Returns:
            `Now`.

        Raises:
            InputError: The frame does not come after the last one, or cannot be what the tracker works on.
            WorkError: As in `tracking.track`.
        """
        index = self.index + 1 if t is None else self._index(t)
        lost = [Frame(k, (k - 1) / self.sequence.fps) for k in range(self.index + 1, index)]
        frame = self._frame(index, image, right, boxes, points, scores)
        if len(lost) > GAP * self.sequence.fps:
            words = (
                f"no frames for {len(lost) / self.sequence.fps:g} s before t = {frame.t:g} s; t is in seconds from 0"
            )
            warnings.warn(f"{self.sequence.name}: {words}", UserWarning, stacklevel=2)
        if lost:
            self.unobserved.append((lost[0].index, lost[-1].index))
        completed = [tracks for each in (*lost, frame) for tracks in self._take(each)]
        self.index = index
        return self._now(completed)

    def finish(self) -> Now:
        """Ends the recording, and returns what is known then: the tracks of frames that waited still, and the last
        frame again if events are reported because the recording ends."""
        completed = self._begin() if self.running is None and self.waiting and self.mode == "file" else []
        if self.running is None:
            return self._now(completed)
        completed += self._counted(self.running.completion.rest())
        last = completed[-1] if completed else self.last
        if last is not None:
            ended = self.running.completion.with_events_at_end(last)
            completed = [*completed[:-1], *([ended] if completed or len(ended.events) > len(last.events) else [])]
        return self._now(completed)

    def info(self) -> dict[str, Any]:
        """Returns what run.json says of the run so far; {} before a frame is tracked."""
        if self.running is None or self.last is None:
            return {}
        prepared, completion = self.running.prepared, self.running.completion
        info = run_info(prepared, [self.last], self.seed, {}, completion.scale, completion.ground, (0.0, 0.0))
        return {**info, "live": True, "frames": self.frames, "grouping": self.grouping.as_dict()}

    def _index(self, t: float) -> int:
        fps, after = self.sequence.fps, self.index / self.sequence.fps
        if is_number(t) and t > MILLISECONDS:
            got, remedy = f"{t:g}, of the year 5138 or later", "divide milliseconds by 1000"
            raise InputError(place="t", got=got, expected="seconds", remedy=remedy)
        if is_number(t) and not self.index and t > FRAMES / fps:
            self.zero = t  # of a clock that does not begin with the recording
        t = t - self.zero if is_number(t) else t
        if not is_number(t, 0.0, FRAMES / fps):
            raise InputError(
                place="t", got=repr(t), expected="seconds since the first frame", remedy="subtract its time"
            )
        index = round(t * fps) + 1
        if index <= self.index < t * fps + 1:
            index = self.index + 1  # times are not exact: a frame after the last one, but early, is the next
        if index <= self.index:
            got = f"{t:g} s, frame {index}"
            remedy = "give frames in the order of their times, at most one in each 1/fps"
            raise InputError(place="t", got=got, expected=f"{after:g} s or later", remedy=remedy)
        return index

    def _frame(self, index: int, image: Any, right: Any, boxes: Any, points: Any, scores: Any) -> Frame:
        t = (index - 1) / self.sequence.fps
        found = _detections(index, t, boxes, points, scores)
        if image is not None and (np.ndim(image) != 3 or np.shape(image)[2] != 3 or image.dtype != np.uint8):
            got = f"{np.shape(image)}, {getattr(image, 'dtype', type(image).__name__)}"
            raise InputError(place="image", got=got, expected="(height, width, 3) BGR, uint8", remedy="convert it")
        if self.mode is None:
            if image is None and found is None:
                remedy = "give one; boxes=[] if nobody was found"
                raise InputError(place="step", got="nothing", expected="a picture, boxes or points", remedy=remedy)
            self.mode = self._mode(image is not None, found is not None)
            size = self.sequence.image_size or (None if image is None else image.shape[1::-1])
            self.sequence = replace(
                self.sequence, image_size=size, has_images=image is not None, has_right=right is not None,
                has_detections=found is not None,
            )  # fmt: skip
        if self.mode == "file" and image is not None and not self.sequence.has_images:
            remedy = "give pictures from the first frame on, or never"
            raise InputError(place=f"frame {index}", got="a picture", expected="boxes or points", remedy=remedy)
        if self.mode == "file":
            image = right = None  # as of a recording: the tracker does not look at them
        if self.mask is None:
            return Frame(index, t, image, right, found)
        if self.region is None:
            self.region = counted_region(self.mask, self.sequence.image_size)
        above = self.sequence.camera is not None and self.sequence.camera.kind == "top"
        found = None if found is None else detections_inside(found, self.region, above)
        return Frame(index, t, inside_region(image, self.region), inside_region(right, self.region), found)

    def _mode(self, pictures: bool, detections: bool) -> DetectionMode:
        given: Any = self.tracker.tracker if isinstance(self.tracker, TimeLimited) else self.tracker
        needs = (tracker_registry.find(given) if isinstance(given, str | type) else given).needs
        if pictures and detections and BOTH in needs:
            return "both"
        return "image" if pictures and not {"pixels", "stereo"}.isdisjoint(needs) else "file" if detections else "image"

    def _take(self, frame: Frame) -> list[Tracks]:
        """Returns the tracks, of this frame or of earlier ones, too, that are completed now."""
        if self.running is None and self.pictures is not None and self.mode in PICTURED:
            self._begin()
        if self.running is None:
            self.waiting.append(frame if self.mode == "file" else frame.replace(image=None, right=None))
            return self._begin() if self._learned(frame) else []
        return self._step(frame)

    def _step(self, frame: Frame) -> list[Tracks]:
        assert self.running is not None
        needs, found = self.running.prepared.tracker.needs, frame.detections
        if self.mode != "image":
            found = as_needed(Given([found]), needs, self.mode or "file", self.sequence).detections[0]
        frame = frame.replace(detections=None if self.mode == "image" else found)
        reported = self.running.step(frame)
        self.reported = reported[-1] if reported else None
        return self._counted(self.running.completion.add(reported))

    def _counted(self, completed: list[Tracks]) -> list[Tracks]:
        self.frames += len(completed)
        self.last = completed[-1] if completed else self.last
        return completed

    def _learned(self, frame: Frame) -> bool:
        """Returns whether the tracker can begin, after a frame."""
        if self.mode in PICTURED:
            if frame.image is not None and frame.index in self.choice.indices(self.choice.count):
                self.sample.append(frame.image.copy())
            return frame.index >= self.choice.count
        known = image_scale.before_frames(self.sequence)
        if np.isfinite(known.px_per_m) or frame.detections is None:
            return bool(np.isfinite(known.px_per_m))
        if frame.detections.box is None:
            return True
        self.boxes += len(frame.detections.box)
        first = next(f.t for f in self.waiting if f.detections is not None)
        return self.boxes > BOXES or frame.t > first + LONGEST

    def _begin(self) -> list[Tracks]:
        """Makes the tracker, and returns the tracks of the frames that waited."""
        waiting, self.waiting = self.waiting, []
        if self.mode in PICTURED:
            pictures = self.pictures if self.pictures is not None else np.array(self.sample)
            choice = self.choice if self.pictures is None else None
            source = {
                **self.sequence.source,
                "background": f"{len(pictures)} pictures" if choice is None else str(choice),
            }
            load = GivenSample(choice, pictures)
            self.sequence = replace(self.sequence, load_background=load, source=source)
            self.sample = []
        if self.mode != "image":
            self.sequence = replace(self.sequence, frames=_Frames(waiting))
        prepared = prepare(self.tracker, self.sequence, params=self.params, detections=self.mode, seed=self.seed)
        self.sequence = replace(self.sequence, frames=_no_frames, load_background=None)
        prepared = replace(prepared, sequence=self.sequence, given=None)
        self.running = RunningTracker(prepared, self.grouping, self.seed)
        return [tracks for frame in waiting for tracks in self._step(frame)]

    def _now(self, completed: list[Tracks]) -> Now:
        learns = ""
        if self.running is None:
            learns = "background" if self.mode in PICTURED else "scale"
        elif not self.running.completion.settled and self.running.completion.waiting:
            learns = "ground"
        t = max(self.index - 1, 0) / self.sequence.fps
        return Now(self.index, t, self.reported, tuple(completed), learns)


def _choice(background: str | None, fps: float) -> BackgroundChoice:
    choice = BackgroundChoice("learn", max(1, round(LEARNED * fps))) if background is None else parse_choice(background)
    if choice.how != "learn":
        expected, remedy = "learn:N, or pictures", "live, later frames are unknown: take learn:N"
        raise InputError(place="background", got=background or "", expected=expected, remedy=remedy)
    return choice


def _no_frames() -> Iterator[Frame]:
    return iter(())


@dataclass(frozen=True)
class _Frames:
    frames: SequenceOf[Frame]

    def __call__(self) -> Iterator[Frame]:
        return iter(self.frames)


def _detections(index: int, t: float, boxes: Any, points: Any, scores: Any) -> Detections | None:
    """Returns the detections of a frame, None if neither boxes nor points are given."""
    if boxes is None and points is None:
        return None
    box, pos = _rows("boxes", boxes, 4), _rows("points", points, 2)
    score = np.zeros(0) if scores is None else _rows("scores", np.asarray(scores)[:, None], 1)[:, 0]
    if boxes is not None and scores is None and box.shape[1] == 5:
        box, score = box[:, :4], box[:, 4]
    given = [len(a) for a, known in ((box, boxes), (pos, points)) if known is not None]
    if len({*given, *([len(score)] if len(score) else [])}) > 1:
        got, expected = f"{len(box)} boxes, {len(pos)} points, {len(score)} scores", "as many of each"
        raise InputError(place=f"frame {index}", got=got, expected=expected, remedy="give one row for each detection")
    if (box[:, 2:] < 0).any():
        got, remedy = "a negative width or height", "give left, top, width, height"
        raise InputError(place=f"frame {index}", got=got, expected="boxes of 0 px or more", remedy=remedy)
    if points is not None:
        return Detections(index, t, "ground", pos, None, None if boxes is None else box, score)
    return Detections(index, t, "image", box[:, :2] + box[:, 2:] / 2, None, box, score)


def _rows(name: str, values: Any, columns: int) -> Array:
    """Returns values as rows (M, columns) of numbers, of boxes with a score (M, 5), too; no rows for None."""
    try:
        rows = np.zeros((0, columns)) if values is None else np.asarray(values, float)
    except (TypeError, ValueError):
        rows = np.zeros(0, object)
    rows = rows if rows.size or rows.dtype == object else np.zeros((0, columns))
    if rows.ndim != 2 or rows.shape[1] not in ((4, 5) if name == "boxes" else (columns,)):
        got, expected = f"{shortened(repr(values), 60)}", f"rows of {columns} numbers"
        raise InputError(place=name, got=got, expected=expected, remedy="give one row for each detection")
    return rows
