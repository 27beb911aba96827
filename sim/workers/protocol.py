"""What all kinds of workers share: the call that runs a function over items, and the limits that hold for each kind."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from typing import Protocol, TypeVar

from scenarios.errors import WorkError

# environment variables that are set to 1 in every worker: a worker computes in one thread
THREAD_VARIABLES = (
    "OMP_NUM_THREADS",
    "OPENBLAS_NUM_THREADS",
    "MKL_NUM_THREADS",
    "NUMBA_NUM_THREADS",
    "OPENCV_FOR_THREADS_NUM",
)

MAX_LOSSES = 3  # workers of the local pool that one item may kill before it counts as failed

T = TypeVar("T")
R = TypeVar("R")


class RunItems(Protocol):
    """Runs a function over items on some workers: this process, local processes, or a dask cluster.

    Functions, items and results are pickled. A dead worker's item is run again, so a function may run more than once.
    """

    def __call__(
        self,
        function: Callable[[T], R],
        items: Iterable[T],
        *,
        ahead: int = 0,
        on_loss: Callable[[T, WorkError], R] | None = None,
    ) -> Iterator[tuple[T, R]]:
        """Yields (item, function(item)) for every item, in the order in which the results arrive.

        Args:
            function: Importable by the workers. Its exception ends the iteration.
            items: Read lazily, one whenever a worker is free, so that a generator can react to earlier results.
            ahead: Number of items that a cluster's scheduler holds beyond one per worker.
            on_loss: Gives the result of an item that killed too many workers (3 local ones); None: WorkError.
        """


def worker_loss(losses: int, cause: str) -> WorkError:
    """Returns the error for an item that killed `losses` workers, the last by `cause` ("exit code 3")."""
    return WorkError(
        got=f"an item that killed {losses} workers, the last by {cause}",
        expected="workers that finish",
        remedy="run again, with fewer workers if memory is short",
    )
