"""Clocks of the benchmarks: the best CPU or wall time of several runs, the load of the machine, and a time limit."""

from __future__ import annotations

import os
import signal
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager

import numpy as np


def machine_load() -> str:
    """Returns the load average of the last minute and the number of cores, for the head of a table."""
    return f"load {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores"


@contextmanager
def stopped_after(seconds: float, error: BaseException) -> Iterator[None]:
    """Raises an error in what is done inside after so many CPU seconds of this process."""

    def ring(*_: object) -> None:
        raise error

    before = signal.signal(signal.SIGPROF, ring)
    signal.setitimer(signal.ITIMER_PROF, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0)
        signal.signal(signal.SIGPROF, before)


def best_times(work: Callable[[], object], rounds: int) -> tuple[float, float]:
    """Returns the least CPU seconds of this process and the least wall seconds of `rounds` runs."""
    cpu, wall = np.inf, np.inf
    for _ in range(rounds):
        begun = time.process_time(), time.perf_counter()
        work()
        cpu, wall = min(cpu, time.process_time() - begun[0]), min(wall, time.perf_counter() - begun[1])
    return cpu, wall


def best_in_turn(works: Mapping[str, Callable[[], object]], rounds: int) -> dict[str, float]:
    """Returns the least wall seconds of each piece of work; every round runs all of them in turn."""
    best = dict.fromkeys(works, np.inf)
    for _ in range(rounds):
        for name, work in works.items():
            best[name] = min(best[name], best_times(work, 1)[1])
    return best
