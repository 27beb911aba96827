"""Work that other processes are sent to do in tests."""

from __future__ import annotations

import os
import signal
import threading
import time
from pathlib import Path


def root_of(number: float) -> float:
    """Something short."""
    return number**0.5


def process(_: object) -> int:
    """Whose work it is."""
    return os.getpid()


def fall_at_first(marker: Path) -> str:
    """Dies as by kill -9, but only the first time."""
    if not marker.exists():
        marker.write_text("")
        os.kill(os.getpid(), signal.SIGKILL)
    return marker.name


def fall(number: int) -> int:
    """Dies at odd numbers."""
    if number % 2:
        os._exit(number)
    return number


def refuse(number: int) -> int:
    """Raises at negative numbers, after the others have begun."""
    if number < 0:
        raise ValueError(f"{number} is negative")
    return number


def hide(_: object) -> object:
    """Something that cannot be sent back."""
    return threading.Lock()


class Awkward(Exception):
    """Can be pickled and not unpickled."""

    def __init__(self, one: str, two: str) -> None:
        super().__init__(one + two)


def complain(_: object) -> None:
    """Raises what cannot be sent back."""
    raise Awkward("a", "b")


def profiled(_: object) -> bool:
    """Whether dask looks at what the threads of its worker are at."""
    from distributed import get_worker

    return any(
        name == "profile" and callback.is_running() for name, callback in get_worker().periodic_callbacks.items()
    )


def told(item: tuple[Path, float]) -> str:
    """Says that it has begun, takes its time, says that it is done."""
    marker, seconds = item
    marker.write_text("begun")
    time.sleep(seconds)
    marker.write_text("done")
    return marker.name
