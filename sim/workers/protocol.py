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
    """A call that runs a function over items on some workers.

    The function is pickled by name, so a worker must be able to import it. A dead worker's item is run again by
    another worker, so the function may run more than once for one item.
    """

    def __call__(
        self,
        function: Callable[[T], R],
        items: Iterable[T],
        *,
        ahead: int = 0,
        on_loss: Callable[[T, WorkError], R] | None = None,
    ) -> Iterator[tuple[T, R]]:
        """Yield (item, function(item)) for every item, in the order in which the results arrive.

        items: read lazily, one whenever a worker is free. A generator can therefore react to earlier results.
        ahead: items that a cluster's scheduler holds beyond one per worker. Local workers ignore it.
        on_loss: its return value becomes the result of an item that killed too many workers. This process ignores it.

        Raises the exception of the function, which ends the iteration. Raises WorkError if an item killed too many
        workers and `on_loss` is None, and if the workers cannot be reached any more.
        """


def worker_loss(losses: int, cause: str) -> WorkError:
    """Return the error for an item that killed `losses` workers; `cause` says how the last worker ended."""
    return WorkError(
        got=f"an item that killed {losses} workers, the last by {cause}",
        expected="workers that finish",
        remedy="run again, with fewer workers if memory is short",
    )
