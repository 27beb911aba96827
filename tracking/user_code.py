"""Calls of code that a user wrote (file, class, config and methods of a tracker), and Ctrl-C that cannot get lost.

What the user's code raises becomes an error. A tracker that calls `sys.exit(0)` would else end the command with exit
code 0 and without output, and a KeyboardInterrupt of its own would look like Ctrl-C.

SIGINT is recorded before KeyboardInterrupt is raised, as Python drops an exception that is raised inside a destructor
or a callback of a C library, KeyboardInterrupt included. A command records SIGINT here, and its loops ask
`raise_if_interrupted` between two items. The record also tells a KeyboardInterrupt of the user from one that a
tracker's own code raises (`is_interruption`). A tracker that calls `_thread.interrupt_main` or sends itself SIGINT
interrupts the command as Ctrl-C does.
"""

from __future__ import annotations

import signal
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType

from scenarios.errors import FlockscopeError, WorkError

ONCE = 0.5  # s in which SIGINT that comes again, to a process and to its group, is one Ctrl-C

_received = threading.Event()
_at = [0.0]  # when SIGINT came last


@contextmanager
def recorded_interrupts() -> Iterator[None]:
    """Records SIGINT (Ctrl-C) while the block runs, and raises KeyboardInterrupt for it, as Python does.

    It has no effect outside the main thread, or if SIGINT has another handler than Python's default, such as inside
    another such block.
    """
    own = threading.current_thread() is threading.main_thread()
    if not own or signal.getsignal(signal.SIGINT) is not signal.default_int_handler:
        yield
        return
    _received.clear()
    signal.signal(signal.SIGINT, _record)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, signal.default_int_handler)
        _received.clear()


def _record(number: int, frame: FrameType | None) -> None:
    now, before = time.monotonic(), _at[0]
    _at[0] = now
    if _received.is_set() and now - before < ONCE:
        return
    _received.set()
    signal.default_int_handler(number, frame)


def raise_if_interrupted() -> None:
    """Raises KeyboardInterrupt if SIGINT was recorded since the current `recorded_interrupts` block began."""
    if _received.is_set():
        raise KeyboardInterrupt


def is_interruption(error: BaseException) -> bool:
    """Returns True if an exception comes from Ctrl-C, False if the code that raised it did so on its own. It is True
    for every exception if SIGINT was recorded in the current block."""
    if _received.is_set():
        return True
    return isinstance(error, KeyboardInterrupt) and signal.getsignal(signal.SIGINT) not in (_record, signal.SIG_IGN)


@contextmanager
def user_code(
    failed: Callable[[BaseException], FlockscopeError], passing: type[Exception] | tuple[()] = FlockscopeError
) -> Iterator[None]:
    """Replaces an exception that the block raises, SystemExit included, by the error that `failed` returns for it.
    Exceptions of the class `passing` are raised unchanged. Ctrl-C becomes KeyboardInterrupt."""
    try:
        yield
    except BaseException as error:
        if is_interruption(error):
            raise KeyboardInterrupt from error
        if isinstance(error, passing):
            raise
        raise failed(error) from error


def what_was_raised(error: BaseException) -> str:
    """Returns the type of an exception and the first line of its message, such as "SystemExit: 0"."""
    from tracking.running.user_modules import PRIVATE

    try:
        text = str(error)
    except BaseException as failed:
        text = f"a message that cannot be read: its __str__ raises {type(failed).__name__}"
    return f"{type(error).__name__}: {PRIVATE.sub('', text)}".partition("\n")[0]


def tracker_failed(tracker: str, method: str, place: str, error: BaseException) -> WorkError:
    """Returns the WorkError for an exception that a tracker's own code raised, with the first line of its message.
    tracker: its name; method: the method that failed; place: where in the input, such as "frame 3"."""
    remedy = f"correct the tracker's {method}; FLOCKSCOPE_DEBUG=1 shows where"
    return WorkError(file=tracker, place=place, got=what_was_raised(error), expected="no exception", remedy=remedy)
