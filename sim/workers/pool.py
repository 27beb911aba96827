"""A pool of local worker processes that run a function over items.

Processes are spawned, use one thread each, and are replaced when they die. The item of a dead process is run again,
until three processes have died of it; then it is an error (WorkError) or gets a substitute result.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any, Generic

from scenarios.errors import WorkError
from sim.workers.process import WorkerProcess
from sim.workers.protocol import MAX_LOSSES, THREAD_VARIABLES, R, RunItems, T, worker_loss


@contextmanager
def process_pool(workers: int) -> Iterator[RunItems]:
    """Yields the RunItems of `workers` spawned processes; the end of the block terminates them, also in a call."""
    before = {name: os.environ.get(name) for name in THREAD_VARIABLES}
    # The processes inherit the variables.
    os.environ.update(dict.fromkeys(THREAD_VARIABLES, "1"))
    processes = [WorkerProcess() for _ in range(workers)]

    def run(
        function: Callable[[T], R],
        items: Iterable[T],
        *,
        ahead: int = 0,
        on_loss: Callable[[T, WorkError], R] | None = None,
    ) -> Iterator[tuple[T, R]]:
        return _run_items(processes, function, items, on_loss)

    try:
        yield run
    finally:
        for process in processes:
            process.terminate()
        for process in processes:
            process.join()
        for name, value in before.items():
            os.environ.pop(name, None) if value is None else os.environ.update({name: value})


@dataclass
class _PendingItem(Generic[T]):
    """An item without result, and how many processes have died of it."""

    item: T
    losses: int = 0


def _run_items(
    processes: list[WorkerProcess],
    function: Callable[[T], R],
    items: Iterable[T],
    on_loss: Callable[[T, WorkError], R] | None,
) -> Iterator[tuple[T, R]]:
    from multiprocessing.connection import wait

    waiting, to_repeat, idle = map(_PendingItem, items), list[_PendingItem[T]](), list(processes)
    busy: dict[Any, tuple[WorkerProcess, _PendingItem[T]]] = {}
    losses_in_a_row = 0  # deaths since the last result
    try:
        while True:
            # Items are read one by one, so that a generator can react to earlier results.
            while idle and (pending := to_repeat.pop() if to_repeat else next(waiting, None)) is not None:
                process = idle.pop()
                busy[process.send(function, pending.item)] = process, pending
            if not busy:
                return
            process, pending = busy.pop(wait(list(busy))[0])
            idle.append(process)
            result = process.receive()
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
            process.terminate()
            process.join()
