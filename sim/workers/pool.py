"""A pool of local worker processes that run a function over items.

Each process belongs to an executor of its own, so that it is known which item a process died of. A process is spawned
when it gets its first item, and again after its death. It runs one item at a time in one thread, ignores Ctrl-C (its
parent handles it), and exits when its parent does. The item of a dead process is run again, until three processes have
died of it; then it is an error (WorkError) or gets a substitute result.
"""

from __future__ import annotations

import os
import pickle
import signal
import threading
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Generic

from sim.workers.calls import THREAD_VARIABLES, OnLoss, R, RunItems, T, WorkResult, run_pickled, worker_loss

if TYPE_CHECKING:
    from concurrent.futures import Future, ProcessPoolExecutor
    from multiprocessing.process import BaseProcess

MAX_LOSSES = 3  # workers of the local pool that one item may kill before it counts as failed


class WorkerProcess:
    """A worker process that runs one call at a time; it is started by its first item, and again after its death.

    State: the executor and its process, None before the first item and after the process ended, and `ended`, a text
    that says how the last process ended: "exit code 3" or "signal 9 (SIGKILL)"; "" if none has ended.
    """

    def __init__(self) -> None:
        self.ended = ""
        self._executor: ProcessPoolExecutor | None = None
        self._process: BaseProcess | None = None

    def submit(self, function: Callable[[Any], Any], item: Any) -> Future[bytes]:
        """Sends the call function(item); returns the future of the pickled `WorkResult`, which `outcome` takes."""
        from concurrent.futures.process import BrokenProcessPool

        call = pickle.dumps((function, item))
        try:
            return self._start().submit(run_pickled, call)
        except BrokenProcessPool:  # it died between two calls
            self.close()
            return self._start().submit(run_pickled, call)

    def outcome(self, future: Future[bytes], timeout: float | None = None) -> WorkResult | None:
        """Returns the outcome of a call; if the process died, sets `ended` and returns None. Raises TimeoutError if
        there is none after `timeout` s."""
        from concurrent.futures.process import BrokenProcessPool

        try:
            # Some exceptions can be pickled, but not unpickled; these become a RuntimeError.
            result: WorkResult = pickle.loads(future.result(timeout))
        except BrokenProcessPool:
            self.close()
            return None
        return result

    def close(self) -> None:
        """Ends the process, even during a call, and sets `ended`."""
        if self._executor is None or self._process is None:
            return
        self._process.kill()
        self._executor.shutdown(cancel_futures=True)
        self._process.join()
        code = self._process.exitcode or 0
        self.ended = f"exit code {code}" if code >= 0 else f"signal {-code} ({signal.Signals(-code).name})"
        self._executor = self._process = None

    def _start(self) -> ProcessPoolExecutor:
        if self._executor is None:
            from concurrent.futures import ProcessPoolExecutor
            from multiprocessing import active_children, get_context

            others = active_children()
            self._executor = ProcessPoolExecutor(1, get_context("spawn"), _begin)
            self._executor.submit(os.getpid)  # starts the process
            self._process = next(process for process in active_children() if process not in others)
        return self._executor


def _begin() -> None:
    # The parent handles Ctrl-C.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_exit_with_parent, daemon=True).start()


def _exit_with_parent() -> None:
    from multiprocessing import parent_process
    from multiprocessing.connection import wait

    parent = parent_process()
    if parent is not None:
        wait([parent.sentinel])
        # A killed parent leaves no worker behind.
        os._exit(1)


@contextmanager
def process_pool(workers: int) -> Iterator[RunItems]:
    """Yields the RunItems of `workers` spawned processes; the end of the block ends them, even during a call."""
    before = {name: os.environ.get(name) for name in THREAD_VARIABLES}
    # The processes inherit the variables.
    os.environ.update(dict.fromkeys(THREAD_VARIABLES, "1"))
    processes = [WorkerProcess() for _ in range(workers)]

    def run(
        function: Callable[[T], R], items: Iterable[T], *, ahead: int = 0, on_loss: OnLoss[T, R] = None
    ) -> Iterator[tuple[T, R]]:
        return _run_items(processes, function, items, on_loss)

    try:
        yield run
    finally:
        for process in processes:
            process.close()
        for name, value in before.items():
            os.environ.pop(name, None) if value is None else os.environ.update({name: value})


@dataclass
class _PendingItem(Generic[T]):
    """An item without result, and how many processes have died of it."""

    item: T
    losses: int = 0


def _run_items(
    processes: list[WorkerProcess], function: Callable[[T], R], items: Iterable[T], on_loss: OnLoss[T, R]
) -> Iterator[tuple[T, R]]:
    from concurrent.futures import FIRST_COMPLETED, wait

    waiting, to_repeat, idle = map(_PendingItem, items), list[_PendingItem[T]](), list(processes)
    busy: dict[Future[bytes], tuple[WorkerProcess, _PendingItem[T]]] = {}
    losses_in_a_row = 0  # deaths since the last result
    try:
        while True:
            # Items are read one by one, so that a generator can react to earlier results.
            while idle and (pending := to_repeat.pop() if to_repeat else next(waiting, None)) is not None:
                process = idle.pop()
                busy[process.submit(function, pending.item)] = process, pending
            if not busy:
                return
            future = wait(busy, return_when=FIRST_COMPLETED).done.pop()
            process, pending = busy.pop(future)
            idle.append(process)
            result = process.outcome(future)
            if result is not None:
                losses_in_a_row = 0
                yield pending.item, result.result()
                continue
            pending.losses, losses_in_a_row = pending.losses + 1, losses_in_a_row + 1
            if pending.losses < MAX_LOSSES:
                to_repeat.append(pending)
            # If all die without a result in between, the fault is not the item's.
            elif on_loss is None or losses_in_a_row > MAX_LOSSES * (len(processes) + 1):
                raise worker_loss(MAX_LOSSES, process.ended)
            else:
                yield pending.item, on_loss(pending.item, worker_loss(MAX_LOSSES, process.ended))
    finally:
        for process, _ in busy.values():
            process.close()
