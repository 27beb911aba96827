"""Before the first frame: a tracker instance with its config, its detections and its context, ready for one sequence.

`prepare(tracker, sequence)` returns a `PreparedTracker`, whose `reset` and `step` check what goes in and what comes
out. `tracking.running.run.track` is the loop over it. The environment drives a `PreparedTracker` itself.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Mapping
from collections.abc import Sequence as SequenceOf
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any

from scenarios.errors import FlockscopeError, InputError, WorkError
from scenarios.limits import INTEGER, JSON_BYTES, is_whole
from scenarios.reading import parse_json
from sim.pictures.background_sample import untracked_frames
from sim.types import Context, DetectionMode, Detections, Frame, Ints, Sequence, Tracker, Tracks
from tracking.config import Config, file_of
from tracking.grouping.grouping_choice import Grouping
from tracking.running import image_scale, tracker_registry
from tracking.running.completion import Completion
from tracking.running.counted_region import Mask, counted_region, detections_inside, with_masked_pictures
from tracking.running.detection_mode import (
    InputKind,
    as_frames,
    as_needed,
    check_detections,
    choose_mode,
    given_detections,
    input_kind,
)
from tracking.running.image_scale import ImageScale
from tracking.running.plane_check import PlaneCheck
from tracking.running.policy import FollowedPolicy, Policy, read_policy
from tracking.running.time_limit import TimeLimited
from tracking.running.tracks_check import ReportHistory, check_tracks
from tracking.running.used_files import inside, owner_of
from tracking.user_code import tracker_failed, user_code

PICTURED = ("image", "both")  # Modes in which a tracker gets pictures.
DIAGNOSTICS = JSON_BYTES // 8  # characters; run.json has indented lines
# A config, parameter values by name, a policy, the name of a preset, the path of a TOML file, or None for the defaults.
Params = Config | Mapping[str, Any] | Policy | str | Path | None


@dataclass(frozen=True, eq=False)
class PreparedTracker:
    """A tracker instance and everything that it is given for one sequence. Call `reset` before the first `step`."""

    name: str  # as the user gave it, or of the class
    tracker: Tracker
    config: Config | None  # None if the tracker has no parameters
    context: Context
    mode: DetectionMode
    sequence: Sequence
    # with detections and without pictures; None: the sequence's own frames (mode "image"); "both": these with pictures
    frames_given: tuple[Frame, ...] | None
    given: InputFrames | None = None  # as `frames_given`, and what these were chosen from
    scale_frames: int = 0  # as of ImageScale
    untracked: int = 0  # first frames, in which a background is learned and nobody is tracked
    masked: Sequence | None = None  # `sequence` with pictures that are black outside the region that counts
    followed: FollowedPolicy | None = None  # what changes the parameters meanwhile
    history: ReportHistory = field(default_factory=ReportHistory)  # what the tracker has reported since `reset`
    planes: PlaneCheck = field(default_factory=PlaneCheck)  # the same, compared with its input

    @property
    def input(self) -> InputKind:
        """What the tracker works on."""
        return input_kind(self.tracker.needs, self.mode, self.sequence, self.frames_given or ())

    def frames(self) -> Iterator[Frame]:
        """Returns a new iterator over the frames as the tracker gets them, in order. Each call starts at frame 1."""
        sequence = self.masked or self.sequence
        if self.frames_given is None:
            return (replace(f, detections=None) for f in sequence)
        if self.mode == "both":
            pairs = zip(sequence, self.frames_given, strict=True)
            return (replace(frame, detections=given.detections) for frame, given in pairs)
        return iter(self.frames_given)

    def scale(self, tracks: SequenceOf[Tracks]) -> ImageScale:
        """Returns the image scale for deriving groups from the tracks of frames 1 to now; nan if unknown. It is the
        context's scale if that is known, else the tracker's own, else that of the tracks' boxes."""
        known = ImageScale(self.context.px_per_m, self.scale_frames)
        return image_scale.from_tracks(known, self.learned(), tracks)

    def px_per_m(self, tracks: SequenceOf[Tracks]) -> float:
        """Returns the number of px per m that `scale` finds for these tracks; nan if unknown."""
        return self.scale(tracks).px_per_m

    def completion(self, rule: Grouping | None = None, *, objective: bool = False) -> Completion:
        """Returns what fills in groups and events of the tracks that `step` returns; objective: groups alone."""
        known, context = ImageScale(self.context.px_per_m, self.scale_frames), self.context
        return Completion(
            context.fps, known, self.learned, rule, camera=context.camera, scene=context.scene,
            image_size=context.image_size, objective=objective,
        )  # fmt: skip

    def learned(self) -> float:
        """Returns the tracker's own image scale, px per m; nan if it has none."""
        with self._naming("px_per_m", self.sequence.name):
            return image_scale.learned_by(self.tracker)

    def reset(self, seed: int) -> None:
        """Resets the tracker for this sequence and forgets what it has reported."""
        self.history.clear()
        self.planes.clear()
        with self._naming("reset()", self.sequence.name):
            self.tracker.reset(self.context, seed)
        if self.followed is not None:
            self.followed.begin(self.tracker)

    def step(self, frame: Frame) -> Tracks:
        """Returns the tracker's tracks of the frame, checked; call it with the frames of `frames`, in order. Raises
        InputError if detections are not finite, WorkError if the tracker fails or returns wrong tracks."""
        detections = frame.detections
        if detections is not None:
            check_detections(detections, self.tracker.needs)
        if self.followed is not None:
            self.followed.before(self.tracker)
        with self._naming("step()", f"{self.sequence.name}, frame {frame.index}"):
            tracks = self.tracker.step(frame, detections)
        checked = check_tracks(tracks, frame.index, self.name, self.sequence.name, self.history)
        self.planes.check(checked, detections, self.context, self.name, self.sequence.name)
        if self.followed is not None:
            self.followed.after(frame, checked)
        return checked

    def diagnostics(self, place: str) -> Any:
        """Returns the tracker's attribute `diagnostics` as JSON has it, None if there is none. Raises WorkError if it
        is no JSON, or cannot be read. place: where in the run, such as "frame 3"."""
        place = f"{self.sequence.name}, {place}"
        with self._naming("diagnostics", place):
            found = getattr(self.tracker, "diagnostics", None)
        try:
            text = json.dumps({"diagnostics": found}, allow_nan=False)
            if len(text) > DIAGNOSTICS:
                raise ValueError(f"{len(text):,} characters, more than {DIAGNOSTICS:,}")
            return parse_json(text, self.name, "")["diagnostics"]
        except (TypeError, ValueError, RecursionError, InputError) as error:
            raise WorkError(
                file=self.name, place=place, got=f"diagnostics that are no JSON: {getattr(error, 'got', error)}",
                expected="dicts, lists, texts, finite numbers, True, False and None",
                remedy="convert arrays by tolist(), and write None for what is unknown",
            ) from error  # fmt: skip

    @contextmanager
    def _naming(self, part: str, place: str) -> Iterator[None]:
        try:
            with (
                user_code(lambda error: tracker_failed(self.name, part, place, error)),
                inside(owner_of(type(self.tracker).__module__)),
            ):
                yield
        except FlockscopeError as error:
            path = self.sequence.source.get("path", self.sequence.name)
            raise (error if error.file else error.replaced(file=path)) from error.__cause__


@dataclass(frozen=True, eq=False)
class InputFrames:
    """What a tracker gets of a sequence in one mode: the frames (None in the mode "image"), by frame the owners of the
    detections (None if unknown), the image scale, and the detections before the tracker's needs chose from them."""

    frames: tuple[Frame, ...] | None
    owners: SequenceOf[Ints] | None
    scale: ImageScale
    detections: SequenceOf[Detections | None] = ()


def input_frames(
    mode: DetectionMode, needs: tuple[str, ...], sequence: Sequence, sensor: Mapping[str, Any], seed: int,
    *, owned: bool = False,
) -> InputFrames:  # fmt: skip
    """Returns the frames with the detections of the mode "file", "both" or "truth", as a tracker with these needs gets
    them. The other arguments are as of `given_detections`."""
    given = given_detections(mode, sequence, sensor, seed, owned=owned)
    seen = as_needed(given, needs, mode, sequence)
    scale = image_scale.of_sequence(sequence, given)
    return InputFrames(as_frames(seen.detections, sequence.fps), seen.owners, scale, given.detections)


def prepare(
    tracker: str | type[Tracker] | Tracker | TimeLimited,
    sequence: Sequence,
    *,
    params: Params = None,
    detections: DetectionMode | None = None,
    sensor: Mapping[str, Any] | None = None,
    seed: int = 0,
    mask: Mask | None = None,
    inputs: Callable[[DetectionMode, tuple[str, ...], int], InputFrames] | None = None,
) -> PreparedTracker:
    """Returns the tracker with all that it needs for the sequence; the arguments are as in `tracking.track`. inputs:
    returns `input_frames` of this sequence without sensor settings, by mode, needs and seed; None makes them. Raises
    InputError if an argument is wrong or tracker and sequence do not fit."""
    if not isinstance(sequence, Sequence):
        remedy = "open it: tracking.recordings.source.open_source(path), or sim.simulate(scenario, seed)"
        raise InputError(place="sequence", got=type(sequence).__name__, expected="a Sequence", remedy=remedy)
    if not is_whole(seed, 0, INTEGER):
        expected, remedy = f"a whole number from 0 to {INTEGER}", "give a smaller one, such as 0"
        raise InputError(place="--seed", got=repr(seed), expected=expected, remedy=remedy)
    params = resolved_params(tracker, params)
    policy = params if isinstance(params, Policy) else None
    name, instance, config = _make(tracker, params if policy is None else policy.base)
    mode = choose_mode(instance.needs, sequence, detections)
    if sensor and mode != "truth":
        remedy = "add --detections truth, or leave out the sensor settings"
        place, got = "--sensor, --set sensor", f"--detections {mode}"
        raise InputError(place=place, got=got, expected="--detections truth", remedy=remedy)
    if mode == "image":
        given = InputFrames(None, None, image_scale.of_sequence(sequence, None))
    elif inputs is None:
        given = input_frames(mode, instance.needs, sequence, sensor or {}, seed)
    else:
        given = inputs(mode, instance.needs, seed)
    frames, scale = given.frames, given.scale
    masked: Sequence | None = None
    if mask is not None:
        region = counted_region(mask, sequence.image_size)
        above = sequence.camera is not None and sequence.camera.kind == "top"
        if mode in PICTURED:
            masked = with_masked_pictures(sequence, region)
        if frames is not None:
            frames = tuple(
                f if f.detections is None else replace(f, detections=detections_inside(f.detections, region, above))
                for f in frames
            )
    background = (masked or sequence).background() if mode in PICTURED else None
    context = Context(sequence.fps, scale.px_per_m, sequence.camera, sequence.scene, sequence.image_size, background)
    untracked = untracked_frames(sequence.load_background) if mode in PICTURED else 0
    return PreparedTracker(
        name, instance, config, context, mode, sequence, frames, given, scale.frames, untracked, masked,
        None if policy is None else FollowedPolicy(policy, sequence.fps, scale.px_per_m),
    )  # fmt: skip


def params_in(kind: type[Config], source: str | Path) -> Config | Policy:
    """Returns the config or the policy in a TOML file, or the preset of this name. Raises InputError as `Config.load`
    and `read_policy` do."""
    return read_policy(kind, file_of(kind.tracker, source)) or kind.load(source)


def resolved_params(tracker: str | type[Tracker] | Tracker | TimeLimited, params: Params) -> Params:
    """Returns the policy or the config that `params` stand for; what they are if the tracker has no parameters, or is
    an instance. Raises InputError if they are wrong."""
    given = tracker.tracker if isinstance(tracker, TimeLimited) else tracker
    if params is None or isinstance(params, Policy) or not isinstance(given, str | type):
        return params
    kind: type[Config] | None = getattr(tracker_registry.find(given), "config_class", None)
    if kind is None:
        return params
    return params_in(kind, params) if isinstance(params, str | Path) else config_of(kind, params)


def _make(tracker: str | type[Tracker] | Tracker | TimeLimited, params: Params) -> tuple[str, Tracker, Config | None]:
    limited = tracker if isinstance(tracker, TimeLimited) else None
    tracker = tracker.tracker if isinstance(tracker, TimeLimited) else tracker
    if not isinstance(tracker, str | type):
        if params is not None:
            got = f"an instance of {type(tracker).__name__}"
            raise InputError(place="params", got=got, expected="a class or a name", remedy="configure the instance")
        return type(tracker).__name__, tracker, getattr(tracker, "config", None)
    name = tracker if isinstance(tracker, str) else tracker.__name__
    found: Any = tracker_registry.find(tracker)
    kind: type[Config] | None = getattr(found, "config_class", None)
    if kind is None and params is not None:
        remedy = "leave the parameters out, or give the class a config_class (docs/guides/your-own-tracker.md)"
        raise InputError(place="params", got=name, expected="a tracker with parameters", remedy=remedy)
    config = None if kind is None else config_of(kind, params)
    failed = partial(tracker_failed, name, "__init__()", "before the first frame")
    with user_code(failed), inside("" if limited else owner_of(found.__module__)):
        if limited is not None:
            return name, limited.make(config), config
        return name, found() if config is None else found(config), config


def config_of(kind: type[Config], params: Params) -> Config:
    """Returns `params` as a config of the class `kind`; None gives the default config. Raises InputError if values are
    wrong or `params` is a config of another class."""
    if params is None:
        return kind()
    if isinstance(params, str | Path):
        return kind.load(params)
    if isinstance(params, Mapping):
        return kind.from_dict(params)
    if not isinstance(params, kind):
        remedy = "give the config of this very tracker"
        raise InputError(place="params", got=type(params).__name__, expected=kind.__name__, remedy=remedy)
    return params
