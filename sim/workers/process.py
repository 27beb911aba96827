"""One worker process: started when it gets its first item, started again after its death.

The process is spawned, runs one item at a time, ignores Ctrl-C (its parent handles it), and exits when its parent does.
Functions, items and results pass through a pipe as pickles.
"""

from __future__ import annotations

import os
import pickle
import signal
import threading
import traceback
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

EXIT_TIMEOUT = 5.0  # s that a terminated process has to exit before it is killed


class RemoteTraceback(Exception):
    """The text of a traceback in a worker: the cause of the call's exception when that is raised here."""

    def __str__(self) -> str:
        return f"\n{self.args[0]}"


@dataclass(frozen=True)
class WorkResult:
    """The outcome of one call in a worker."""

    value: Any = None  # the return value, None after an exception
    error: BaseException | None = None  # the exception, None after success
    trace: str = ""  # the text of the exception's traceback in the worker, "" after success

    def result(self) -> Any:
        """Returns the call's value, or raises its exception, caused by a RemoteTraceback."""
        if self.error is not None:
            raise self.error from RemoteTraceback(self.trace)
        return self.value


class WorkerProcess:
    """A worker process that runs one call at a time; it is started by its first item, and again after its death.

    State: the process (None before its first item and after its end was noticed), the pipe to it, and `ended`, a text
    that says how the last process ended: "exit code 3" or "signal 9 (SIGKILL)"; "" if none has ended.
    """

    def __init__(self) -> None:
        self.ended = ""
        self._process: Any = None
        self._pipe: Any = None

    def send(self, function: Callable[[Any], Any], item: Any) -> Any:
        """Sends the call function(item); returns the connection that is readable at its end or the process's."""
        call = pickle.dumps((function, item))
        if self._process is None or not self._process.is_alive():
            self._start()
        with suppress(OSError):  # the process died just now: receive() returns None
            self._pipe.send_bytes(call)
        return self._pipe

    def receive(self) -> WorkResult | None:
        """Returns the outcome of the call that was sent last; None if the process died, and then sets `ended`."""
        try:
            body = self._pipe.recv_bytes()
        except (EOFError, OSError):
            self.join()
            return None
        # Some exceptions can be pickled, but not unpickled; these become a RuntimeError.
        result: WorkResult = pickle.loads(body)
        return result

    def terminate(self) -> None:
        """Asks the process to exit at once, without waiting."""
        if self._process is not None:
            self._process.terminate()

    def join(self) -> None:
        """Waits until the process has exited (kills it after 5 s), closes its pipe and sets `ended`."""
        if self._process is None:
            return
        self._process.join(EXIT_TIMEOUT)
        if self._process.is_alive():
            self._process.kill()
            self._process.join()
        self._pipe.close()
        code = self._process.exitcode
        self.ended = f"exit code {code}" if code >= 0 else f"signal {-code} ({signal.Signals(-code).name})"
        self._process = None

    def _start(self) -> None:
        from multiprocessing import get_context

        if self._process is not None:
            self.join()
        context = get_context("spawn")
        self._pipe, child_end = context.Pipe()
        self._process = context.Process(target=_serve, args=(child_end,))
        self._process.start()
        child_end.close()


def _serve(pipe: Any) -> None:
    # The parent handles Ctrl-C.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_exit_with_parent, daemon=True).start()
    with suppress(EOFError, OSError):
        while True:
            pipe.send_bytes(run_pickled(pipe.recv_bytes()))


def run_pickled(call: bytes) -> bytes:
    """Runs a pickled (function, item) and returns the pickled WorkResult; never raises, not even SystemExit."""
    try:
        function, item = pickle.loads(call)
        return pickle.dumps(WorkResult(function(item)))
    except BaseException as error:
        trace = traceback.format_exc()
        with suppress(Exception):
            body = pickle.dumps(WorkResult(error=error, trace=trace))
            pickle.loads(body)
            return body
        text = type(error).__name__
        with suppress(BaseException):  # its __str__ may raise
            text += f": {error}"
        return pickle.dumps(WorkResult(error=RuntimeError(text), trace=trace))


def _exit_with_parent() -> None:
    from multiprocessing import parent_process
    from multiprocessing.connection import wait

    parent = parent_process()
    if parent is not None:
        wait([parent.sentinel])
        # A killed parent leaves no worker behind.
        os._exit(1)
