"""Runs a tracker in a process of its own, so that a step that hangs, or ends the process, is an error and no more.

Neither a signal nor a thread can stop a call in this process that hangs in compiled code. A process can be ended from
outside. Contexts, frames and tracks pass through a pipe as pickles.
"""

from __future__ import annotations

import faulthandler
import itertools
from typing import Any, Self

from scenarios.errors import InputError
from scenarios.limits import is_number
from sim.types import Context, Detections, Frame, Tracker, Tracks
from tracking.config import Config
from tracking.running import tracker_registry, used_files
from tracking.running.image_scale import learned_by
from tracking.running.used_files import inside, owner_of

GRACE = 5.0  # s after the limit at which a process ends itself, should its parent be gone.

# s: greatest limit, 11 days. The timer of a pipe counts milliseconds in 32 bits, some 2.1 million s.
LONGEST = 1_000_000


class TimeLimited:
    """A tracker that runs in another process, where each `reset` and each `step` must end within a time limit.

    It is given to `tracking.track` as the tracker, and is a context manager that ends the process. State: the process,
    which holds one tracker at a time. It is started when the first tracker is made, and again if it has ended.

    Args:
        tracker: A registered name, "file.py:Class" or "module:Class".
        seconds: The time limit of each call, s, above 0, at most 1,000,000.

    Raises:
        InputError: The tracker is not given by name, or the limit is out of range.
    """

    def __init__(self, tracker: str | type[Tracker], seconds: float) -> None:
        from sim.workers.pool import WorkerProcess

        if not isinstance(tracker, str):
            expected, remedy = "a name that another process can look up", "give file.py:Class or module:Class"
            raise InputError(place="--step-timeout", got="no name of a tracker", expected=expected, remedy=remedy)
        if not (is_number(seconds, 0.0, LONGEST) and seconds > 0):
            expected, remedy = f"seconds, above 0, at most {LONGEST:,}", "correct it, or leave it out"
            raise InputError(place="--step-timeout", got=seconds, expected=expected, remedy=remedy)
        self.tracker, self.seconds = tracker, seconds
        self._process = WorkerProcess()
        self._numbers = itertools.count()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    @property
    def needs(self) -> tuple[str, ...]:
        """The inputs that the tracker can work with, as its class states them."""
        return tuple(tracker_registry.find(self.tracker).needs)

    def close(self) -> None:
        """Ends the process; if a tracker is made later, a new process is started."""
        self._process.close()

    def make(self, config: Config | None) -> RemoteTracker:
        """Makes the tracker in the process with this config, and returns a `RemoteTracker` that calls it. config: None
        for a tracker without parameters."""
        made = RemoteTracker(self, next(self._numbers), config)
        made.create()
        return made

    def call(self, number: int, method: str, *arguments: Any) -> Any:
        """Makes the tracker with this number in the process ("create"), replaces its config ("configure"), asks for an
        attribute ("getattr"), or calls its "reset" or "step"; returns the result.

        "create" has no time limit and returns whether the tracker keeps a config. The others return the result, the
        tracker's px_per_m, whether it says that the camera moves, and what is new of that which it has used. Raises
        TimeoutError if the limit is exceeded, ChildProcessError if the process has ended, or what the tracker raised.
        """
        from sim.workers.calls import RemoteTraceback

        future = self._process.submit(_call, (number, method, arguments, self.seconds + GRACE))
        try:
            result = self._process.outcome(future, None if method == "create" else self.seconds)
        except TimeoutError:
            self.close()
            raise TimeoutError(f"no answer within {self.seconds:g} s (--step-timeout)") from None
        if result is None:
            raise ChildProcessError(f"its process ended with {self._process.ended}")
        if isinstance(result.error, KeyboardInterrupt):  # the process ignores Ctrl-C: it is the tracker's own
            raise RuntimeError("KeyboardInterrupt") from RemoteTraceback(result.trace)
        return result.result()


class RemoteTracker:
    """Stands for a tracker in the process of a TimeLimited, with its attributes needs, config, px_per_m and
    camera_moves; others are asked for there, as long as the process holds the tracker.

    State: the config, and that which the tracker is still to be given, None if it has it; whether it keeps one; its
    px_per_m and camera_moves after the last call.
    """

    def __init__(self, host: TimeLimited, number: int, config: Config | None) -> None:
        self.needs, self._config, self._keeps = host.needs, config, False
        self._waiting: Config | None = None
        self.px_per_m, self.camera_moves = float("nan"), False
        self._host, self._number = host, number

    def create(self) -> None:
        """Makes the tracker in the process, unless the process holds it already."""
        values = None if self._config is None else self._config.as_dict()
        self._keeps = self._host.call(self._number, "create", self._host.tracker, values)

    @property
    def config(self) -> Config | None:
        """The tracker's config, which may be replaced between two steps. Raises AttributeError if it keeps none."""
        if not self._keeps:
            raise AttributeError("config")
        return self._config

    @config.setter
    def config(self, config: Config) -> None:
        self._config = self._waiting = config

    def __getattr__(self, name: str) -> Any:
        if name.startswith("_"):
            raise AttributeError(name)
        return self._call("getattr", name)

    def reset(self, context: Context, seed: int) -> None:
        """Resets the tracker; if its process has ended, the tracker is made again before."""
        self.create()
        self._send_config()
        self._call("reset", context, seed)

    def step(self, frame: Frame, detections: Detections | None) -> Tracks:
        """Returns the tracker's tracks of the frame, with these detections."""
        self._send_config()
        return self._call("step", frame, detections)  # type: ignore[no-any-return]

    def _send_config(self) -> None:
        if self._waiting is not None:
            self._call("configure", self._waiting.as_dict())
            self._waiting = None

    def _call(self, method: str, *arguments: Any) -> Any:
        result, self.px_per_m, self.camera_moves, used = self._host.call(self._number, method, *arguments)
        if used:
            used_files.note(tracker_registry.find(self._host.tracker), used)
        return result


_sent = (-1, 0)  # In the process: what was known when `used` was sent last.
_made: dict[int, Any] = {}  # In the process: the tracker by its number; at most one.


def _call(request: tuple[int, str, tuple[Any, ...], float]) -> Any:
    global _sent
    number, method, given, limit = request
    if method == "create":
        if number not in _made:
            spec, values = given
            found: Any = tracker_registry.find(spec)
            with inside(owner_of(found.__module__)):
                made = found() if values is None else found(found.config_class.from_dict(values))
            _made.clear()
            _made[number] = made
        return hasattr(_made[number], "config")
    if number not in _made:
        if method == "getattr":
            raise AttributeError(*given)
        raise RuntimeError("the process of this tracker was started again since its reset")
    faulthandler.dump_traceback_later(limit, exit=True)  # ends the process, also in compiled code
    made = _made[number]
    tracker, result = type(made), None
    try:
        with inside(owner_of(tracker.__module__)):
            if method == "configure":
                made.config = tracker.config_class.from_dict(*given)
            elif method == "getattr":
                result = getattr(made, *given)
            else:
                result = getattr(made, method)(*given)
            told = learned_by(made), bool(getattr(made, "camera_moves", False))
    finally:
        faulthandler.cancel_dump_traceback_later()
    before, _sent = _sent, (number, used_files.opened())
    return result, *told, {} if _sent == before else used_files.used(tracker)
