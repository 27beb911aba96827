"""Ctrl-C that cannot get lost: SIGINT is recorded before KeyboardInterrupt is raised.

Python drops an exception that is raised inside a destructor or a callback of a C library, KeyboardInterrupt included.
A command records SIGINT here, and its loops ask `raise_if_interrupted` between two items. The record also tells a
KeyboardInterrupt of the user from one that a tracker's own code raises, by itself or with `_thread.interrupt_main`
(`is_interruption`).
"""

from __future__ import annotations

import faulthandler
import os
import signal
import tempfile
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType
from typing import Any

_received = threading.Event()
_recorders: list[Any] = []  # The handler of the present block of `recorded_interrupts`, if there is one.


@contextmanager
def recorded_interrupts() -> Iterator[None]:
    """While the block runs, records SIGINT (Ctrl-C) and raises KeyboardInterrupt for it, as Python does."""
    own = threading.current_thread() is threading.main_thread()
    if not own or signal.getsignal(signal.SIGINT) is not signal.default_int_handler:
        yield
        return
    _received.clear()
    # faulthandler writes when the process gets a signal, and not when code calls `_thread.interrupt_main`. Python runs
    # the same handler for both.
    with tempfile.TemporaryFile() as real:

        def record(number: int, frame: FrameType | None) -> None:
            if os.fstat(real.fileno()).st_size:
                _received.set()
            signal.default_int_handler(number, frame)

        signal.signal(signal.SIGINT, record)
        faulthandler.register(signal.SIGINT, real, all_threads=False, chain=True)
        _recorders.append(record)
        try:
            yield
        finally:
            faulthandler.unregister(signal.SIGINT)
            signal.signal(signal.SIGINT, signal.default_int_handler)
            _recorders.remove(record)
            _received.clear()


def raise_if_interrupted() -> None:
    """Raises KeyboardInterrupt if SIGINT was recorded in the present block of `recorded_interrupts`."""
    if _received.is_set():
        raise KeyboardInterrupt


def is_interruption(error: BaseException) -> bool:
    """Returns True if the exception comes from Ctrl-C, False if the code that raised it did so on its own."""
    if _received.is_set():
        return True
    return isinstance(error, KeyboardInterrupt) and signal.getsignal(signal.SIGINT) not in (*_recorders, signal.SIG_IGN)
