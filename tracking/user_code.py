"""Calls of code that a user wrote (file, class, config and methods of a tracker): what it raises becomes an error.

A tracker that calls `sys.exit(0)` would else end the command with exit code 0 and without output, and a
KeyboardInterrupt of its own would look like Ctrl-C.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager

from scenarios.errors import FlockscopeError, WorkError
from tracking.interrupts import is_interruption


@contextmanager
def user_code(
    failed: Callable[[BaseException], FlockscopeError], passing: type[Exception] | tuple[()] = FlockscopeError
) -> Iterator[None]:
    """While the block runs, replace any exception, SystemExit and GeneratorExit included, by the error `failed(it)`.

    Exceptions of the class `passing` pass unchanged; () for none. Ctrl-C stays a KeyboardInterrupt, also if the code
    has made another exception of it. A KeyboardInterrupt that the code raises itself is replaced where the two can be
    told apart (tracking.interrupts).
    """
    try:
        yield
    except BaseException as error:
        if is_interruption(error):
            raise KeyboardInterrupt from error
        if isinstance(error, passing):
            raise
        raise failed(error) from error


def what_was_raised(error: BaseException) -> str:
    """Return the type of an exception and the first line of its message, as "SystemExit: 0".

    The message of an exception whose own `__str__` fails says so.
    """
    try:
        text = str(error)
    except BaseException as failed:
        text = f"a message that cannot be read: its __str__ raises {type(failed).__name__}"
    return f"{type(error).__name__}: {text}".partition("\n")[0]


def tracker_failed(tracker: str, method: str, place: str, error: BaseException) -> WorkError:
    """Return the WorkError for an exception raised by a tracker's own code, with the first line of its message.

    tracker: its name. method: "reset", "step", "__init__" or another part of the class. place: sequence and frame, in
    words.
    """
    remedy = f"correct the tracker's {method}; FLOCKSCOPE_DEBUG=1 shows where"
    return WorkError(file=tracker, place=place, got=what_was_raised(error), expected="no exception", remedy=remedy)
