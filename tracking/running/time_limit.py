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
        """Calls "create", "reset" or "step" of the tracker with this number in the process; returns the result.

        "create" has no time limit and returns None. "reset" and "step" return the method's result, the tracker's
        px_per_m, and what is new of that which it has used. Raises TimeoutError if the limit is exceeded,
        ChildProcessError if the process has ended, or what the tracker raised.
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
    """Stands for a tracker in the process of a TimeLimited, with its attributes needs, config and px_per_m."""

    def __init__(self, host: TimeLimited, number: int, config: Config | None) -> None:
        self.needs, self.config = host.needs, config
        self.px_per_m = float("nan")
        self._host, self._number = host, number

    def create(self) -> None:
        """Makes the tracker in the process, unless the process holds it already."""
        values = None if self.config is None else self.config.as_dict()
        self._host.call(self._number, "create", self._host.tracker, values)

    def reset(self, context: Context, seed: int) -> None:
        """Resets the tracker; if its process has ended, the tracker is made again before."""
        self.create()
        self._call("reset", context, seed)

    def step(self, frame: Frame, detections: Detections | None) -> Tracks:
        """Returns the tracker's tracks of the frame, with these detections."""
        return self._call("step", frame, detections)  # type: ignore[no-any-return]

    def _call(self, method: str, *arguments: Any) -> Any:
        result, self.px_per_m, used = self._host.call(self._number, method, *arguments)
        if used:
            used_files.note(tracker_registry.find(self._host.tracker), used)
        return result


_sent = (-1, 0)  # In the process: what was known when `used` was sent last.
_made: dict[int, Tracker] = {}  # In the process: the tracker by its number; at most one.


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
        return None
    if number not in _made:
        raise RuntimeError("the process of this tracker was started again since its reset")
    faulthandler.dump_traceback_later(limit, exit=True)  # ends the process, also in compiled code
    tracker = type(_made[number])
    try:
        with inside(owner_of(tracker.__module__)):
            result, learned = getattr(_made[number], method)(*given), learned_by(_made[number])
    finally:
        faulthandler.cancel_dump_traceback_later()
    before, _sent = _sent, (number, used_files.opened())
    return result, learned, {} if _sent == before else used_files.used(tracker)
