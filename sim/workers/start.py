"""Starts the workers that a command asks for: this process, local processes, or a dask cluster.

All three are used in the same way, as a function that runs another function over items.
"""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterable, Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass
from typing import Any

from scenarios.errors import InputError
from sim.workers.cluster import cluster_workers
from sim.workers.pool import process_pool
from sim.workers.protocol import R, RunItems, T


@dataclass(frozen=True)
class WorkerOptions:
    """Which workers to use.

    count: number of workers, 1 or more (checked by `start_workers`); 1 without a cluster means this process. With a
    cluster it is the least number of items under way. cluster: address of a dask scheduler ("tcp://HOST:PORT"), None
    for local workers.
    """

    count: int = 1
    cluster: str | None = None


def start_workers(workers: int = 1, cluster: str | None = None) -> AbstractContextManager[RunItems]:
    """Return a context manager that starts workers, gives a RunItems (runs a function over items), and ends them.

    cluster None: this process for one worker, else `workers` spawned processes. Otherwise the address of a dask
    scheduler, "tcp://HOST:PORT"; its workers are used, and `workers` is then the least number of items under way.

    Raises InputError at once if `workers` is below 1. Entering the block raises InputError if the address is malformed
    or dask.distributed is not installed, and WorkError if no scheduler answers. Reading results raises the exception of
    the function, and WorkError if workers die again and again, the cluster is lost, or one of its workers does not fit.
    """
    if workers < 1:
        raise InputError(place="workers", got=workers, expected="1 or more", remedy="correct --workers")
    if cluster is not None:
        return cluster_workers(cluster, workers)
    return process_pool(workers) if workers > 1 else this_process()


def results_in_order(run: RunItems, function: Callable[[T], R], items: Sequence[T]) -> Generator[R, None, None]:
    """Yield function(item) in the order of `items`, with `run` (a RunItems) doing the work.

    Items are told apart by identity, so no object may stand twice among them. Results that arrive early are kept in
    memory until their turn. When the caller closes the generator, or an exception ends it, no further item is started,
    and items under way are waited for. Raises what `run` raises: the exception of the function, or WorkError for lost
    workers.
    """
    wanted, found = True, dict[int, R]()
    arriving = run(function, (item for item in items if wanted))
    try:
        for item in items:
            while id(item) not in found:
                done, result = next(arriving)
                found[id(done)] = result
            yield found.pop(id(item))
    finally:
        wanted = False
        for _ in arriving:
            pass


@contextmanager
def this_process() -> Iterator[RunItems]:
    """Give a RunItems that calls the function in this process, one item after another, in the order of the items.

    It reads an item when the result before it has been taken. It ignores `ahead` and `on_loss`; the function's
    exceptions are raised unchanged.
    """

    def run(
        function: Callable[[T], R], items: Iterable[T], *, ahead: int = 0, on_loss: Any = None
    ) -> Iterator[tuple[T, R]]:
        for item in items:
            yield item, function(item)

    yield run
