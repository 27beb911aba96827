"""`flockscope track` on a camera, stream, pipe or growing file, or on boxes from standard input: while they come in."""

from __future__ import annotations

import json
import math
import signal
import sys
import threading
import time
import warnings
from collections import deque
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, closing, contextmanager, nullcontext, suppress
from typing import Any

import numpy as np

from scenarios.errors import FlockscopeError, InputError, counted, printable, reject
from scenarios.limits import FRAMES
from sim.store.atomic import lock_folder
from sim.store.tables import plain
from sim.store.track_parts import TrackParts
from sim.types import Groups, Tracks
from tracking.app.command_options import TrackOptions
from tracking.app.command_result import INTERRUPTED, CommandResult
from tracking.app.stored_tracks import check_place
from tracking.app.tracker_setup import TrackerSetup
from tracking.recordings.live_source import STDIN, LivePictures, hidden, lines_of_boxes
from tracking.recordings.video import DEFAULT_FPS
from tracking.running.live import Live

FILES_ALONE = ("boxes", "person_class", "box_scale", "min_score", "detections")
LIVE_ALONE = ("follow", "stream", "when_slow")
Given = tuple[dict[str, Any], float]  # the arguments of Live.step for a frame, and when it came
LATENCIES = 10_000  # frames whose latency is kept


def refuse_live_options(options: TrackOptions) -> None:
    """Raises InputError if options are given that have an effect on live sources only."""
    for name in LIVE_ALONE:
        if getattr(options, name):
            expected, remedy = "a camera, address or pipe; with --follow a video file", f"leave {_flag(name)} out"
            raise InputError(place=_flag(name), got=options.source, expected=expected, remedy=remedy)


def _flag(name: str) -> str:
    return f"--{name.replace('_', '-')}"


def track_live(setup: TrackerSetup, options: TrackOptions) -> CommandResult:
    """Tracks what comes in until it ends, or until Ctrl-C, and returns a line for it. All that was tracked is stored,
    also if the source is lost."""
    for name in FILES_ALONE:
        place = _flag(name)
        reject(getattr(options, name) is not None, "", options.source, "a recording", f"leave {place} out", place)
    for name in ("follow", "when_slow") if options.source == STDIN else ():
        place = _flag(name)
        reject(getattr(options, name) is not None, "", options.source, "pictures", f"leave {place} out", place)
    with ExitStack() as stack:
        stack.enter_context(lock_folder(options.out))
        check_place(options.out, setup.tracker)
        stack.enter_context(setup.limited or nullcontext())
        stop = stack.enter_context(_stopped_by_signals())
        pictures = None
        if options.source != STDIN:
            with stop.waiting():
                pictures = LivePictures(options.source, options.fps, options.when_slow, options.follow)
        run = _LiveRun(setup, options, options.fps or _usual_rate() if pictures is None else pictures.fps, pictures)
        error = None
        try:
            for number, (given, at) in enumerate(stop.before_end(_given(pictures)), 1):
                with _naming("stdin" if pictures is None else "", number):
                    run.step(given, at)
        except FlockscopeError as lost:
            error = lost
        row = run.finish("stopped" if stop.found else "ended" if error is None else "lost")
    if error is not None:
        if row["frames"]:
            kept = f"{counted(row['frames'], 'frame')} that were tracked before are in {options.out}"
            warnings.warn(kept, UserWarning, stacklevel=2)
        raise error
    code = INTERRUPTED if stop.found else 0
    return CommandResult({"tracker": setup.tracker, "runs": [row]}, "" if options.stream else _line(row), code)


def _given(pictures: LivePictures | None) -> Iterator[Given]:
    """Yields the arguments of `Live.step` for each frame, and when it came, by the monotonic clock."""
    if pictures is None:
        for line in lines_of_boxes(sys.stdin.buffer):
            yield line, time.monotonic()
        return
    with closing(iter(pictures)) as found:  # type: ignore[type-var]
        for picture in found:
            yield {"image": picture.image, "t": picture.t}, picture.at


@contextmanager
def _naming(file: str, line: int) -> Iterator[None]:
    """Names the line of standard input in an error about what it holds."""
    try:
        yield
    except InputError as error:
        raise (error if error.file or not file else error.replaced(file=f"{file}, line {line}")) from error.__cause__


def _usual_rate() -> float:
    text = f"standard input: no frame rate is given, so it is taken as {DEFAULT_FPS:g}; --fps sets it"
    warnings.warn(text, UserWarning, stacklevel=2)
    return DEFAULT_FPS


class _Stop:
    """The handler of the signals that end a run. A wait for the source is broken off, a step of the tracker is not.

    State: found, True once there was a signal; waits, True while a signal raises KeyboardInterrupt.
    """

    def __init__(self) -> None:
        self.found = self.waits = False

    def __call__(self, *_: Any) -> None:
        self.found = True
        if self.waits:
            self.waits = False
            raise KeyboardInterrupt

    @contextmanager
    def waiting(self) -> Iterator[None]:
        """Lets a signal break off the block."""
        self.waits = True
        try:
            if self.found:
                raise KeyboardInterrupt
            yield
        finally:
            self.waits = False

    def before_end(self, items: Iterator[Given]) -> Iterator[Given]:
        """Yields the items until there is a signal."""
        with suppress(KeyboardInterrupt):
            while True:
                with self.waiting():
                    item = next(items, None)
                if item is None:
                    return
                yield item


@contextmanager
def _stopped_by_signals() -> Iterator[_Stop]:
    """Yields what says whether the process was told to end (Ctrl-C, SIGTERM)."""
    stop = _Stop()
    kinds = (signal.SIGINT, signal.SIGTERM)
    if threading.current_thread() is not threading.main_thread():
        yield stop
        return
    before = [signal.signal(kind, stop) for kind in kinds]
    try:
        yield stop
    finally:
        for kind, handler in zip(kinds, before, strict=True):
            signal.signal(kind, handler)


class _LiveRun:
    """A live run on its way to the disk. State: live; parts; latency, ms, of each of the last frames; stored, the last
    frame that is; said, what was said to be learned."""

    def __init__(self, setup: TrackerSetup, options: TrackOptions, fps: float, pictures: LivePictures | None) -> None:
        self.pictures, self.options = pictures, options
        self.live = Live(
            setup.limited or setup.tracker, fps=fps, px_per_m=options.px_per_m, params=setup.config,
            camera=options.camera, background=options.background, grouping=setup.grouping, seed=setup.seed,
            mask=options.mask, name="standard input" if pictures is None else hidden(options.source),
        )  # fmt: skip
        self.parts = TrackParts(options.out, fps, self.live.sequence.camera)
        self.latency, self.stored, self.said = deque[float](maxlen=LATENCIES), 0, set[str]()

    def step(self, given: dict[str, Any], at: float) -> None:
        """Tracks a frame that came at a moment of the monotonic clock, and stores what is completed."""
        frame = given.pop("frame", None)
        if frame is not None:
            reject("t" in given, "", "t and frame", "one of both", "leave one out")
            good = isinstance(frame, int) and not isinstance(frame, bool) and 1 <= frame <= FRAMES
            reject(not good, "", frame, f"a frame from 1 to {FRAMES}", "count frames from 1", "frame")
            given["t"] = (frame - 1) / self.live.sequence.fps
        now = self.live.step(**given)
        self._say_what_is_learned(now.learns)
        self._keep(now.completed)
        self.latency.append(1000 * (time.monotonic() - at))

    def _say_what_is_learned(self, learns: str) -> None:
        if self.options.stream and learns and learns not in self.said:
            self.said.add(learns)
            words = f"{self.live.sequence.name}: the {learns} is learned first; frames are printed when it is known"
            warnings.warn(words, UserWarning, stacklevel=2)

    def finish(self, ended: str) -> dict[str, Any]:
        """Stores the run as a whole, and returns its row for the command's result."""
        now = self.live.finish()
        self._keep([t for t in now.completed if t.index > self.stored])
        info = {**self._info(), "ended": ended, "unobserved": self.live.unobserved}
        last = now.completed[-1] if now.completed else None
        if self.stored:
            self.parts.finish(info, last)
        return {**info, "frames": self.stored, "folder": self.options.out}

    def _keep(self, completed: Sequence[Tracks]) -> None:
        if not completed:
            return
        self.stored = completed[-1].index
        self.parts.add(completed, self._info())
        if self.options.stream:
            for tracks in completed:
                print(json.dumps(plain(row_of(tracks)), allow_nan=False), flush=True)

    def _info(self) -> dict[str, Any]:
        more: dict[str, Any] = {"lost_frames": sum(last - first + 1 for first, last in self.live.unobserved)}
        if self.pictures is not None:
            more |= {"dropped_pictures": self.pictures.dropped, "reconnects": self.pictures.reconnects}
        if self.latency:
            median, high = np.percentile(self.latency, [50, 99]).tolist()
            more["latency_ms"] = {"median": median, "99 %": high, "frames": len(self.latency)}
        return {**self.live.info(), **more}


def row_of(t: Tracks) -> dict[str, Any]:
    """Returns the tracks of a frame as `--stream` prints them: people, groups, events and counts."""
    unit = "px" if t.plane == "image" else "m"
    groups = Groups.none() if t.groups is None else t.groups
    rows = zip(t.id.tolist(), t.group.tolist(), t.pos.tolist(), t.vel.tolist(), t.measured.tolist(), strict=True)
    known = [None] * len(t.id) if t.box is None else t.box.tolist()
    people = [
        {"id": id, "group": group, "pos": pos, "vel": _or_none(vel), "box": box, "seen": seen}
        for (id, group, pos, vel, seen), box in zip(rows, known, strict=True)
    ]
    members = [m.tolist() for m in groups.members] or [[] for _ in groups.id]
    columns = zip(groups.id.tolist(), members, groups.pos.tolist(), groups.size.tolist(), strict=True)
    together = [{"id": id, "members": who, "pos": pos, "size": _or_none([n])[0]} for id, who, pos, n in columns]
    return {
        "frame": t.index, "t": t.t, "unit": unit, "people": people if t.unit == "person" else [], "groups": together,
        "events": [plain(e) for e in t.events],
        "counts": {"people": len(t.id) if t.unit == "person" else None, "groups": len(groups.id)},
    }  # fmt: skip


def _or_none(values: list[float]) -> list[float | None]:
    return [value if math.isfinite(value) else None for value in values]


def _line(row: dict[str, Any]) -> str:
    if not row["frames"]:
        return f"{row.get('sequence', 'live')}: nothing was tracked"
    late, lost = row.get("latency_ms"), row["lost_frames"]
    words = [counted(row["frames"], "frame"), f"{lost} lost"]
    words += [] if late is None else [f"latency {late['median']:.0f} ms (99 %: {late['99 %']:.0f} ms)"]
    return printable(f"{row['sequence']}: {', '.join(words)} → {row['folder']}")
