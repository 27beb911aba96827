"""A pool of local worker processes that run a function over items, and what all kinds of workers share.

A process is spawned when it gets its first item, and again after its death. It runs one item at a time in one thread,
ignores Ctrl-C (its parent handles it), and exits when its parent does. Functions, items and results pass through a pipe
as pickles. The item of a dead process is run again, until three processes have died of it; then it is an error
(WorkError) or gets a substitute result.

Starts the workers that a command asks for: this process, local processes, or a dask cluster.

All three are used in the same way, as a function that runs another function over items.
"""

from __future__ import annotations

import os
import pickle
import signal
import threading
import traceback
from collections.abc import Callable, Generator, Iterable, Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager, nullcontext, suppress
from dataclasses import dataclass
from typing import Any, Generic, Protocol, TypeVar

from scenarios.errors import InputError, WorkError

# environment variables that are set to 1 in every worker: a worker computes in one thread
THREAD_VARIABLES = tuple(f"{name}_NUM_THREADS" for name in ("OMP", "OPENBLAS", "MKL", "NUMBA"))
THREAD_VARIABLES += ("OPENCV_FOR_THREADS_NUM",)

MAX_LOSSES = 3  # workers of the local pool that one item may kill before it counts as failed

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


EXIT_TIMEOUT = 5.0  # s that a terminated process has to exit before it is killed


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


class WorkerProcess:
    """A worker process that runs one call at a time; it is started by its first item, and again after its death.

    State: the process (None before its first item and after its end was noticed), the pipe to it, and `ended`, a text
    that says how the last process ended: "exit code 3" or "signal 9 (SIGKILL)"; "" if none has ended.
    """

    def __init__(self) -> None:
        self.ended = ""
        self._process: Any = None
        self._pipe: Any = None

    def send(self, function: Callable[[Any], Any], item: Any) -> Any:
        """Sends the call function(item); returns a connection that is readable when the call or process has ended."""
        call = pickle.dumps((function, item))
        if self._process is None or not self._process.is_alive():
            self._start()
        with suppress(OSError):  # the process died just now: receive() returns None
            self._pipe.send_bytes(call)
        return self._pipe

    def receive(self) -> WorkResult | None:
        """Returns the outcome of the call that was sent last; if the process died, sets `ended` and returns None."""
        try:
            body = self._pipe.recv_bytes()
        except (EOFError, OSError):
            self.join()
            return None
        # Some exceptions can be pickled, but not unpickled; these become a RuntimeError.
        result: WorkResult = pickle.loads(body)
        return result

    def terminate(self) -> None:
        """Asks the process to exit at once, without waiting."""
        if self._process is not None:
            self._process.terminate()

    def join(self) -> None:
        """Waits until the process has exited (kills it after 5 s), closes its pipe and sets `ended`."""
        if self._process is None:
            return
        self._process.join(EXIT_TIMEOUT)
        if self._process.is_alive():
            self._process.kill()
            self._process.join()
        self._pipe.close()
        code = self._process.exitcode
        self.ended = f"exit code {code}" if code >= 0 else f"signal {-code} ({signal.Signals(-code).name})"
        self._process = None

    def _start(self) -> None:
        from multiprocessing import get_context

        if self._process is not None:
            self.join()
        context = get_context("spawn")
        self._pipe, child_end = context.Pipe()
        self._process = context.Process(target=_serve, args=(child_end,))
        self._process.start()
        child_end.close()


def _serve(pipe: Any) -> None:
    # The parent handles Ctrl-C.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_exit_with_parent, daemon=True).start()
    with suppress(EOFError, OSError):
        while True:
            pipe.send_bytes(run_pickled(pipe.recv_bytes()))


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
    """Yields the RunItems of `workers` spawned processes; the end of the block terminates them, even during a call."""
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
    processes: list[WorkerProcess], function: Callable[[T], R], items: Iterable[T], on_loss: OnLoss[T, R]
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
    return process_pool(workers) if workers > 1 else nullcontext(_run_here)


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
