"""Run a tracker over a sequence: choose the detections, build what it may know, loop, check its answers.

`track(...)` is the whole; `prepare(...)` is its first half, for those who drive the loop themselves.
"""

from __future__ import annotations

import time
import warnings
from collections.abc import Callable, Iterator, Mapping
from collections.abc import Sequence as SequenceOf
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, cast, overload

import numpy as np

from scenarios.errors import FlockscopeError, InputError, WorkError
from sim.types import Context, DetectionMode, Detections, Frame, Sequence, Tracker, Tracks
from tracking import scale, tracker_registry
from tracking.config import Config
from tracking.grouping.link_rule import Grouping
from tracking.provenance import Speed, describe

Params = Config | Mapping[str, Any] | str | Path | None


@dataclass(frozen=True, eq=False)
class Run(SequenceOf[Tracks]):
    """A tracker's answers, one per frame in order, and how they came about (`info`, what run.json holds)."""

    tracks: tuple[Tracks, ...]
    info: dict[str, Any] = field(default_factory=dict)

    @overload
    def __getitem__(self, index: int) -> Tracks: ...
    @overload
    def __getitem__(self, index: slice) -> tuple[Tracks, ...]: ...
    def __getitem__(self, index: int | slice) -> Tracks | tuple[Tracks, ...]:
        return self.tracks[index]

    def __len__(self) -> int:
        return len(self.tracks)


@dataclass(frozen=True, eq=False)
class Prepared:
    """A tracker that has not been reset, and all it will be given: frames() may be called more than once."""

    name: str
    tracker: Tracker
    config: Config | None
    context: Context
    mode: DetectionMode
    sequence: Sequence
    feed: tuple[Frame, ...] | None
    history: tracker_registry.History = field(default_factory=tracker_registry.History)

    def frames(self) -> Iterator[Frame]:
        """The frames as the tracker gets them: from pixels without the detections that came with them."""
        return iter(self.feed) if self.feed is not None else (replace(f, detections=None) for f in self.sequence)

    def px_per_m(self, answers: SequenceOf[Tracks]) -> float:
        """The scale by which groups are derived: what was given, learned, or follows from the boxes answered."""
        return scale.of_answers(self.context.px_per_m, getattr(self.tracker, "px_per_m", None), answers)

    def reset(self, seed: int) -> None:
        """Reset the tracker for this sequence."""
        self.history.forget()
        try:
            self.tracker.reset(self.context, seed)
        except FlockscopeError as error:
            raise _named(error, self.sequence) from error.__cause__
        except Exception as error:
            raise _raised(self.name, "reset", self.sequence.name, error) from error

    def answer(self, frame: Frame) -> Tracks:
        """One step, its input and output checked."""
        detections = frame.detections
        if detections is not None:
            tracker_registry.check_detections(detections, self.tracker.needs)
        try:
            said = self.tracker.step(frame, detections)
        except FlockscopeError as error:
            raise _named(error, self.sequence) from error.__cause__
        except Exception as error:
            raise _raised(self.name, "step", f"{self.sequence.name}, frame {frame.index}", error) from error
        return tracker_registry.check_tracks(said, frame.index, self.name, self.history)


def _named(error: FlockscopeError, sequence: Sequence) -> FlockscopeError:
    """An error that names no file, with the recording it is about."""
    about = sequence.source.get("path", sequence.name)
    return error if error.file else type(error)(**{**error.as_dict(), "file": about})


def _raised(tracker: str, method: str, place: str, error: Exception) -> WorkError:
    """An exception out of a tracker's own code, in one line."""
    got = f"{type(error).__name__}: {error}".partition("\n")[0]
    remedy = f"correct the tracker's {method}(); FLOCKSCOPE_DEBUG=1 shows where"
    return WorkError(file=tracker, place=place, got=got, expected="no exception", remedy=remedy)


def track(
    tracker: str | type[Tracker] | Tracker,
    sequence: Sequence,
    *,
    params: Params = None,
    detections: DetectionMode | None = None,
    sensor: Mapping[str, Any] | None = None,
    seed: int = 0,
    grouping: Grouping | str | Path | None = None,
    progress: Callable[[int], None] | None = None,
) -> Run:
    """Track a sequence with a registered tracker, "file.py:Class", "module:Class", a class or an instance.

    params: its config, values by name or a TOML file. detections: "image", "file" or "truth"; by default the first that
    can work. sensor: overrides that degrade "truth" (misses, clutter, noise, hiding). grouping: the rule by which
    people get groups where the tracker names none, or its TOML file. progress: called with the number of each frame
    that is done. InputError where tracker and source do not fit, before a frame is read; WorkError where
    the tracker's answer is no Tracks.
    """
    from tracking.grouping.derive import names_groups, with_groups

    rule = Grouping.from_toml(grouping) if isinstance(grouping, str | Path) else grouping
    ready = prepare(tracker, sequence, params=params, detections=detections, sensor=sensor, seed=seed)
    ready.reset(seed)
    made, spent, begun = [], 0.0, time.perf_counter()
    for frame in ready.frames():
        start = time.perf_counter()
        made.append(ready.answer(frame))
        spent += time.perf_counter() - start
        if progress is not None:
            progress(frame.index)
    whole = time.perf_counter() - begun
    px_per_m = ready.px_per_m(made)
    answers = with_groups(made, ready.context.fps, px_per_m, rule)
    if rule is not None and names_groups(made):
        warnings.warn(f"{ready.name} names groups itself: --grouping has no effect", UserWarning, stacklevel=2)
    speed = Speed(len(made) / spent, len(made) / whole) if made else Speed()
    info = describe(ready, answers, seed, sensor or {}, px_per_m, speed)
    return Run(answers, info if rule is None else {**info, "grouping": rule.as_dict()})


def prepare(
    tracker: str | type[Tracker] | Tracker,
    sequence: Sequence,
    *,
    params: Params = None,
    detections: DetectionMode | None = None,
    sensor: Mapping[str, Any] | None = None,
    seed: int = 0,
) -> Prepared:
    """Everything up to the tracker's reset; arguments as in `track`."""
    if not isinstance(sequence, Sequence):
        remedy = "open it: sim.io.source.open_source(path), or sim.simulate(scenario, seed)"
        raise InputError(place="sequence", got=type(sequence).__name__, expected="a Sequence", remedy=remedy)
    name, instance, config = _make(tracker, params)
    mode = tracker_registry.choose_mode(instance.needs, sequence, detections)
    if sensor and mode != "truth":
        remedy = "add --detections truth, or leave the sensor as it is"
        raise InputError(
            place="--sensor, --set sensor", got=f"--detections {mode}", expected="--detections truth", remedy=remedy
        )
    feed = _feed(instance.needs, mode, sequence, sensor or {}, seed)
    context = Context(
        fps=sequence.fps,
        px_per_m=_px_per_m(sequence, mode, feed),
        camera=sequence.camera,
        scene=sequence.scene,
        image_size=sequence.image_size,
        background=sequence.background() if mode == "image" else None,
    )
    return Prepared(name, instance, config, context, mode, sequence, feed)


def _make(tracker: str | type[Tracker] | Tracker, params: Params) -> tuple[str, Tracker, Config | None]:
    """The tracker's name, an instance and its config; a class takes its config from its `config_class`."""
    if not isinstance(tracker, str | type):
        if params is not None:
            got = f"an instance of {type(tracker).__name__}"
            raise InputError(place="params", got=got, expected="a class or a name", remedy="configure the instance")
        return type(tracker).__name__, tracker, getattr(tracker, "config", None)
    name = tracker if isinstance(tracker, str) else tracker.__name__
    made = cast(
        Any, tracker_registry.find(tracker) if isinstance(tracker, str) else tracker_registry.checked(tracker, name)
    )
    kind: type[Config] | None = getattr(made, "config_class", None)
    if kind is None:
        if params is not None:
            remedy = "leave the parameters out, or give the class a config_class (docs/trackers.md)"
            raise InputError(place="params", got=name, expected="a tracker with parameters", remedy=remedy)
        return name, _instance(name, made), None
    config = config_of(kind, params)
    return name, _instance(name, made, config), config


def _instance(name: str, made: Any, *arguments: Any) -> Tracker:
    try:
        return cast(Tracker, made(*arguments))
    except FlockscopeError:
        raise
    except Exception as error:
        raise _raised(name, "__init__", "before the first frame", error) from error


def config_of(kind: type[Config], params: Params) -> Config:
    """The config that was given as itself, by values or as a TOML file; the default where nothing was."""
    if params is None:
        return kind()
    if isinstance(params, str | Path):
        return kind.from_toml(params)
    if isinstance(params, Mapping):
        return kind.from_dict(params)
    if not isinstance(params, kind):
        remedy = "give the config of this very tracker"
        raise InputError(place="params", got=type(params).__name__, expected=kind.__name__, remedy=remedy)
    return params


def _feed(
    needs: tuple[str, ...], mode: DetectionMode, sequence: Sequence, sensor: Mapping[str, Any], seed: int
) -> tuple[Frame, ...] | None:
    """Frames with their detections, pictures left out; None where the sequence's own frames are to be streamed."""
    if mode == "image":
        return None
    if mode == "file":
        found: list[Detections | None] = [f.detections for f in sequence.without_pictures()]
    else:
        from tracking.truth_detections import from_truth

        found = list(from_truth(sequence, sensor, seed))
    given = [d for d in found if d is not None and len(d.pos)]
    if given and "points" not in needs and all(d.box is None for d in given):
        got, remedy = f"points alone, in {sequence.name}", "take a tracker that takes points"
        raise InputError(place=f"--detections {mode}", got=got, expected="boxes", remedy=remedy)
    return tuple(Frame(k, (k - 1) / sequence.fps, detections=d) for k, d in enumerate(found, 1))


def grouped(tracks: SequenceOf[Tracks], sequence: Sequence) -> tuple[Tracks, ...]:
    """Stored or a stranger's tracks of a sequence, with groups and events where the tracker left them empty."""
    from tracking.grouping.derive import with_groups

    truth = None if np.isfinite(sequence.px_per_m) else sequence.truth
    return with_groups(tracks, sequence.fps, sequence.px_per_m if truth is None else truth.px_per_m)


def _px_per_m(sequence: Sequence, mode: DetectionMode, feed: tuple[Frame, ...] | None) -> float:
    """px per metre: the camera's, the source's own, else the median height of the boxes given / 1.7; nan if none."""
    if sequence.camera is not None:
        from sim.scene.camera import px_per_m_at_centre

        return float(px_per_m_at_centre(sequence.camera))
    if np.isfinite(sequence.px_per_m) or mode == "image":
        return sequence.px_per_m
    return scale.of_boxes(f.detections for f in (sequence.without_pictures() if feed is None else feed))
