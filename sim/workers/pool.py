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
    """Give the RunItems (run a function over items) of `workers` local worker processes for the length of the block.

    workers: 1 or more; with 0 no item is run. A process is spawned when it gets its first item, and again after its
    death. The block sets THREAD_VARIABLES (OMP_NUM_THREADS and others) to 1 in this process's environment, so that the
    workers inherit them, and restores them at its end. The end of the block terminates the processes, also in the
    middle of a call. Reading results raises the exception of the function, the pickling error of an item, and WorkError
    for an item of which three processes died unless `on_loss` is given. `ahead` is ignored.
    """
    before = {name: os.environ.get(name) for name in THREAD_VARIABLES}
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
    """An item that has no result yet.

    item: the argument for the function. losses: number of worker processes that have died while running it, 0 at first.
    """

    item: T
    losses: int = 0


def _run_items(
    processes: list[WorkerProcess],
    function: Callable[[T], R],
    items: Iterable[T],
    on_loss: Callable[[T, WorkError], R] | None,
) -> Iterator[tuple[T, R]]:
    """Yield (item, function(item)) for every item, in the order in which the results arrive.

    items: read one whenever a process is idle; items to repeat come first. Each of `processes` runs one item at a time,
    so the death of a process is the loss of one item. The item is run again until MAX_LOSSES (3) processes have died of
    it. Then on_loss(item, error) becomes its result; if `on_loss` is None, the WorkError is raised. It is raised in
    spite of `on_loss` after more than MAX_LOSSES × (number of processes + 1) deaths without a result in between. Raises
    the exception of the function, and the pickling error of a function or item. When the iteration ends early, busy
    processes are terminated.
    """
    from multiprocessing.connection import wait

    waiting, to_repeat, idle = map(_PendingItem, items), list[_PendingItem[T]](), list(processes)
    busy: dict[Any, tuple[WorkerProcess, _PendingItem[T]]] = {}
    losses_in_a_row = 0  # deaths since the last result
    try:
        while True:
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
            elif on_loss is None or losses_in_a_row > MAX_LOSSES * (len(processes) + 1):
                raise worker_loss(MAX_LOSSES, process.ended)
            else:
                yield pending.item, on_loss(pending.item, worker_loss(MAX_LOSSES, process.ended))
    finally:
        for process, _ in busy.values():
            process.terminate()
            process.join()
