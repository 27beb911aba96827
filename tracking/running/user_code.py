"""Calls of code that a user wrote (file, class, config and methods of a tracker): what it raises becomes an error.

A tracker that calls `sys.exit(0)` would else end the command with exit code 0 and without output, and a
KeyboardInterrupt of its own would look like Ctrl-C.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager

from scenarios.errors import FlockscopeError, WorkError
from tracking.running.interrupts import is_interruption


@contextmanager
def user_code(
    failed: Callable[[BaseException], FlockscopeError], passing: type[Exception] | tuple[()] = FlockscopeError
) -> Iterator[None]:
    """While the block runs, replaces any exception, SystemExit included, by the error `failed(it)`."""
    try:
        yield
    except BaseException as error:
        if is_interruption(error):
            raise KeyboardInterrupt from error
        if isinstance(error, passing):
            raise
        raise failed(error) from error


def what_was_raised(error: BaseException) -> str:
    """Returns the type of an exception and the first line of its message, as "SystemExit: 0"."""
    try:
        text = str(error)
    except BaseException as failed:
        text = f"a message that cannot be read: its __str__ raises {type(failed).__name__}"
    return f"{type(error).__name__}: {text}".partition("\n")[0]


def tracker_failed(tracker: str, method: str, place: str, error: BaseException) -> WorkError:
    """Returns the WorkError for an exception raised by a tracker's own code, with the first line of its message."""
    remedy = f"correct the tracker's {method}; FLOCKSCOPE_DEBUG=1 shows where"
    return WorkError(file=tracker, place=place, got=what_was_raised(error), expected="no exception", remedy=remedy)
