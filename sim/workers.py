"""Processes of one thread each that begin fresh, obey Ctrl-C through their parent, and end when it does."""

from __future__ import annotations

import os
import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any, TypeVar

from scenarios.errors import WorkError

THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS", "OPENCV_FOR_THREADS_NUM")
T = TypeVar("T")
R = TypeVar("R")
Run = Callable[[Callable[[T], R], list[T]], Iterator[tuple[T, R]]]


@contextmanager
def pool(workers: int) -> Iterator[Run[Any, Any]]:
    """run(function, items): pairs (item, result) as they come, by spawned processes; an error ends all at once."""
    from concurrent.futures import ProcessPoolExecutor, as_completed
    from concurrent.futures.process import BrokenProcessPool
    from multiprocessing import get_context

    executor = ProcessPoolExecutor(workers, get_context("spawn"), _start)
    before = {name: os.environ.get(name) for name in THREADS}
    os.environ.update(dict.fromkeys(THREADS, "1"))

    def run(function: Callable[[Any], Any], items: list[Any]) -> Iterator[tuple[Any, Any]]:
        futures = {executor.submit(function, item): item for item in items}
        for future in as_completed(futures):
            try:
                yield futures[future], future.result()
            except BrokenProcessPool:
                raise WorkError(
                    got="a worker that died",
                    expected="workers that finish",
                    remedy="run again, perhaps with fewer workers",
                ) from None

    try:
        yield run
    except BaseException:
        _end(executor)
        raise
    finally:
        executor.shutdown(wait=True, cancel_futures=True)
        for name, value in before.items():
            os.environ.pop(name, None) if value is None else os.environ.update({name: value})


def _end(executor: Any) -> None:
    """Do not wait for work nobody wants any more."""
    for process in list((executor._processes or {}).values()):
        process.terminate()


def _start() -> None:
    """In each worker: leave Ctrl-C to the parent, and do not outlive it."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_follow_parent, daemon=True).start()


def _follow_parent() -> None:
    from multiprocessing import parent_process
    from multiprocessing.connection import wait

    parent = parent_process()
    if parent is not None:
        wait([parent.sentinel])
        os._exit(1)
