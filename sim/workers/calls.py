"""What workers of all kinds share: how a function is run over items, and the outcome of one call.

Functions, items and results are pickled. Exceptions come back with the text of their traceback.
"""

from __future__ import annotations

import pickle
import traceback
from collections.abc import Callable, Iterable, Iterator
from contextlib import suppress
from dataclasses import dataclass
from typing import Any, Protocol, TypeVar

from scenarios.errors import WorkError

# environment variables that are set to 1 in every worker: a worker computes in one thread
THREAD_VARIABLES = tuple(f"{name}_NUM_THREADS" for name in ("OMP", "OPENBLAS", "MKL", "NUMBA"))
THREAD_VARIABLES += ("OPENCV_FOR_THREADS_NUM",)

T = TypeVar("T")
R = TypeVar("R")
OnLoss = Callable[[T, WorkError], R] | None  # gives the result of an item that killed too many workers


class RunItems(Protocol):
    """Runs a function over items on some workers: this process, local processes, or a dask cluster.

    Functions, items and results are pickled. A dead worker's item is run again, so a function may run more than once.
    """

    def __call__(
        self, function: Callable[[T], R], items: Iterable[T], *, ahead: int = 0, on_loss: OnLoss[T, R] = None
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
    got = f"an item that killed {losses} workers, the last by {cause}"
    remedy = "run again, with fewer workers if memory is short"
    return WorkError(got=got, expected="workers that finish", remedy=remedy)


class RemoteTraceback(Exception):
    """The text of a traceback in a worker: the cause of the call's exception when that is raised here."""

    def __str__(self) -> str:
        return f"\n{self.args[0]}"


@dataclass(frozen=True)
class WorkResult:
    """The outcome of one call in a worker."""

    value: Any = None  # the return value, None after an exception
    error: BaseException | None = None  # the exception, None after success
    trace: str = ""  # the text of the exception's traceback in the worker, "" after success

    def result(self) -> Any:
        """Returns the call's value, or raises its exception, caused by a RemoteTraceback."""
        if self.error is not None:
            raise self.error from RemoteTraceback(self.trace)
        return self.value


def run_pickled(call: bytes) -> bytes:
    """Runs a pickled (function, item) and returns the pickled WorkResult; exceptions are put in it, never raised."""
    try:
        function, item = pickle.loads(call)
        return pickle.dumps(WorkResult(function(item)))
    except BaseException as error:
        trace = traceback.format_exc()
        with suppress(Exception):
            body = pickle.dumps(WorkResult(error=error, trace=trace))
            pickle.loads(body)
            return body
        text = type(error).__name__
        with suppress(BaseException):  # its __str__ may raise
            text += f": {error}"
        return pickle.dumps(WorkResult(error=RuntimeError(text), trace=trace))
