"""What all kinds of workers share: the call that runs a function over items, and the limits that hold for each kind."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from typing import Protocol, TypeVar

from scenarios.errors import WorkError

THREAD_VARIABLES = (
    "OMP_NUM_THREADS",
    "OPENBLAS_NUM_THREADS",
    "MKL_NUM_THREADS",
    "NUMBA_NUM_THREADS",
    "OPENCV_FOR_THREADS_NUM",
)
"""Environment variables that are set to 1 in every worker: a worker computes in one thread."""

MAX_LOSSES = 3
"""Workers of the local pool that one item may kill before it counts as failed."""

T = TypeVar("T")
R = TypeVar("R")


class RunItems(Protocol):
    """A callable that runs a function over items on some workers: this process, local processes, or a dask cluster.

    Workers other than this process get the function pickled by name, so they must be able to import it; items and
    results are pickled too. A dead worker's item is run again by another worker, so the function may run more than once
    for one item.
    """

    def __call__(
        self,
        function: Callable[[T], R],
        items: Iterable[T],
        *,
        ahead: int = 0,
        on_loss: Callable[[T, WorkError], R] | None = None,
    ) -> Iterator[tuple[T, R]]:
        """Yield (item, function(item)) for every item, in the order in which the results arrive; nothing without items.

        items: read lazily, one whenever a worker is free. A generator can therefore react to earlier results. ahead:
        number of items that a cluster's scheduler holds beyond one per worker. Local workers and this process ignore
        it. on_loss: called with the item and the error if an item killed too many workers (3 local ones); its return
        value becomes the item's result. This process ignores it.

        Raises the exception of the function, which ends the iteration, and the pickling error of a function or item for
        other processes. Raises WorkError in three cases: an item killed too many workers and `on_loss` is None; local
        workers die again and again without any result in between, also with `on_loss`; a cluster is lost or a worker of
        it cannot take part.
        """


def worker_loss(losses: int, cause: str) -> WorkError:
    """Return (not raise) the WorkError for an item that killed `losses` workers.

    cause: how the last worker ended, as "exit code 3" or "signal 9 (SIGKILL)".
    """
    return WorkError(
        got=f"an item that killed {losses} workers, the last by {cause}",
        expected="workers that finish",
        remedy="run again, with fewer workers if memory is short",
    )
