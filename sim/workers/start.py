"""Starts the workers that a command asks for: this process, local processes, or a dask cluster.

All three are used in the same way, as a function that runs another function over items.
"""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterable, Iterator, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass

from scenarios.errors import InputError
from sim.workers.calls import OnLoss, R, RunItems, T


@dataclass(frozen=True)
class WorkerOptions:
    """Which workers to use."""

    # number of workers, 1 or more (checked by `start_workers`); 1 without a cluster means this process. With a cluster
    # it is the least number of items under way.
    count: int = 1
    cluster: str | None = None  # address of a dask scheduler ("tcp://HOST:PORT"), None for local workers


def start_workers(workers: int = 1, cluster: str | None = None) -> AbstractContextManager[RunItems]:
    """Returns a context manager that starts workers, gives their RunItems, and ends them (a cluster keeps running).

    Args:
        workers: Number of processes; 1 is this process. With a cluster the least number of items under way.
        cluster: Address of a dask scheduler ("tcp://HOST:PORT"), None for this machine.

    Raises:
        InputError: `workers` is below 1.
    """
    if workers < 1:
        raise InputError(place="workers", got=workers, expected="1 or more", remedy="correct --workers")
    if cluster is not None:
        from sim.workers.cluster import cluster_workers

        return cluster_workers(cluster, workers)
    if workers == 1:
        return nullcontext(_run_here)
    from sim.workers.pool import process_pool

    return process_pool(workers)


def _run_here(
    function: Callable[[T], R], items: Iterable[T], *, ahead: int = 0, on_loss: OnLoss[T, R] = None
) -> Iterator[tuple[T, R]]:
    for item in items:
        yield item, function(item)


def results_in_order(
    run: RunItems, function: Callable[[T], R], items: Sequence[T], on_loss: OnLoss[T, R] = None
) -> Generator[R, None, None]:
    """Yields function(item), run by `run`, in the order of `items`, which must be distinct objects. on_loss: as of
    `RunItems`."""
    wanted, found = True, dict[int, R]()
    arriving = run(function, (item for item in items if wanted), on_loss=on_loss)
    try:
        for item in items:
            while id(item) not in found:
                done, result = next(arriving)
                found[id(done)] = result
            yield found.pop(id(item))
    finally:
        wanted = False
        # Items under way are waited for; no further one is started.
        for _ in arriving:
            pass
