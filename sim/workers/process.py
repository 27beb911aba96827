"""One spawned process that does one thing after another, obeys Ctrl-C through its parent, and ends when it does."""

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

PATIENCE = 5.0  # s within which a process that is told to end has ended


class Elsewhere(Exception):
    """The traceback of an error in another process, as its cause."""

    def __str__(self) -> str:
        return f"\n{self.args[0]}"


@dataclass(frozen=True)
class Answer:
    """What a function returned, or raised and where."""

    value: Any = None
    error: BaseException | None = None
    trace: str = ""

    def result(self) -> Any:
        """The value; raises the error."""
        if self.error is not None:
            raise self.error from Elsewhere(self.trace)
        return self.value


class Hand:
    """State: a process, started when there is work, anew when it has died; the pipe to it; how the last ended."""

    def __init__(self) -> None:
        self.ended = ""
        self._process: Any = None
        self._pipe: Any = None

    def begin(self, function: Callable[[Any], Any], item: Any) -> Any:
        """Give it work; the connection that can be read when there is an answer, or no hope of one."""
        work = pickle.dumps((function, item))
        if self._process is None or not self._process.is_alive():
            self._start()
        with suppress(OSError):  # it has died since: no answer will say so
            self._pipe.send_bytes(work)
        return self._pipe

    def answer(self) -> Answer | None:
        """What it says; None if it has died."""
        try:
            body = self._pipe.recv_bytes()
        except (EOFError, OSError):
            self.join()
            return None
        answer: Answer = pickle.loads(body)
        return answer

    def end(self) -> None:
        """Do not wait for work nobody wants any more."""
        if self._process is not None:
            self._process.terminate()

    def join(self) -> None:
        """Wait for its end and say how it was."""
        if self._process is None:
            return
        self._process.join(PATIENCE)
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
        self._pipe, theirs = context.Pipe()
        self._process = context.Process(target=_work, args=(theirs,))
        self._process.start()
        theirs.close()


def _work(pipe: Any) -> None:
    """In the process: leave Ctrl-C to the parent, do not outlive it, do what it says until it ends."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_follow_parent, daemon=True).start()
    with suppress(EOFError, OSError):
        while True:
            pipe.send_bytes(answered(pipe.recv_bytes()))


def answered(work: bytes) -> bytes:
    """The pickled Answer to a pickled function and item."""
    try:
        function, item = pickle.loads(work)
        return pickle.dumps(Answer(function(item)))
    except BaseException as error:
        trace = traceback.format_exc()
        with suppress(Exception):
            body = pickle.dumps(Answer(error=error, trace=trace))
            pickle.loads(body)
            return body
        return pickle.dumps(Answer(error=RuntimeError(f"{type(error).__name__}: {error}"), trace=trace))


def _follow_parent() -> None:
    from multiprocessing import parent_process
    from multiprocessing.connection import wait

    parent = parent_process()
    if parent is not None:
        wait([parent.sentinel])
        os._exit(1)
