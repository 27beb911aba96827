"""Runs a function over items on the workers of a dask.distributed cluster.

The scheduler is given bytes only, so it needs none of our code. A worker refuses an item unless it has the same
versions and sources as this process, because its results could differ in their bytes otherwise
(sim.versions.runtime). If a worker dies, the scheduler gives its item to another worker.
"""

from __future__ import annotations

import logging
import os
import pickle
import queue
import re
import sys
import threading
import time
import uuid
import warnings
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from functools import partial
from itertools import islice
from typing import Any

from scenarios.errors import InputError, WorkError
from sim.versions import runtime
from sim.workers.process import WorkResult, run_pickled
from sim.workers.protocol import THREAD_VARIABLES, R, RunItems, T, worker_loss

ADDRESS = r"[a-z]+://([^\s/:\[\]]+|\[[0-9a-fA-F:.]+\]):[0-9]+/?"
SAME = "install the same on all (pip install -c constraints.txt) and restart the workers"
CONNECT_TIMEOUT = 10.0  # s to reach a scheduler
COUNT_INTERVAL = 1.0  # s between two counts of the cluster's workers
NO_WORKERS_WARNING = 20.0  # s without any worker before a warning
REMEDY = "run the same command again: what is complete is kept"
PROFILE_SAFE = (
    3,
    11,
    9,
)  # earlier Pythons may deadlock in sys._current_frames, which dask's profiler calls (gh-106883)


@contextmanager
def cluster_workers(address: str, workers: int = 1) -> Iterator[RunItems]:
    """Give the RunItems (run a function over items) of the dask cluster whose scheduler listens at `address`.

    address: "tcp://HOST:PORT". workers: least number of items under way. As many items are under way as the cluster has
    worker threads, but at least `workers`, plus the `ahead` of the call. Results come in the order in which they
    arrive. The end of the block closes the connection; the cluster itself keeps running. Side effect: dask's logger
    "distributed" is silenced up to CRITICAL.

    Entering the block raises InputError if the address is malformed or dask.distributed is not installed, and WorkError
    if no scheduler answers within CONNECT_TIMEOUT (10 s). Reading results raises the exception of the function, and
    WorkError if the connection is lost, or if a worker has other versions or sources than this
    process, has several threads, or cannot import flockscope. An item that killed too many workers raises WorkError
    unless `on_loss` is given; then on_loss(item, error) is its result. A cluster without workers causes a warning after
    20 s.
    """
    client = _connect(address)

    def run(
        function: Callable[[T], R],
        items: Iterable[T],
        *,
        ahead: int = 0,
        on_loss: Callable[[T, WorkError], R] | None = None,
    ) -> Iterator[tuple[T, R]]:
        capacity = _ClusterCapacity(client, address, workers)
        waiting, finished = iter(items), queue.SimpleQueue[str]()
        under_way: dict[str, tuple[T, Any]] = {}
        while True:
            for item in islice(waiting, max(0, capacity.count() + ahead - len(under_way))):
                future = _submit(client, function, item)
                under_way[future.key] = item, future
                future.add_done_callback(lambda f: finished.put(f.key))
            if not under_way:
                return
            ready = [under_way.pop(key) for key in _drain(finished)]
            for (item, _), fetch in zip(ready, _fetchers(client, [f for _, f in ready]), strict=True):
                yield item, _result(fetch, item, address, on_loss)

    try:
        yield run
    finally:
        with suppress(OSError):
            client.close(timeout=CONNECT_TIMEOUT)


def _connect(address: str) -> Any:
    if not re.fullmatch(ADDRESS, address):
        expected, remedy = "tcp://HOST:PORT", "give the address that `dask scheduler` prints"
        raise InputError(place="--cluster", got=repr(address), expected=expected, remedy=remedy)
    try:
        from distributed import Client
    except ImportError:
        raise InputError(
            place="--cluster", got="no dask.distributed here", expected="the extra [cluster]",
            remedy="pip install 'flockscope[cluster]'",
        ) from None  # fmt: skip
    logging.getLogger("distributed").setLevel(logging.CRITICAL)  # our errors say the same in one line
    try:
        return Client(address, timeout=CONNECT_TIMEOUT, set_as_default=False, name="flockscope")
    except (OSError, ValueError) as error:
        raise WorkError(
            place="--cluster", got=f"no answer from {address} ({error})", expected="a dask scheduler there",
            remedy="check that it runs and can be reached from here",
        ) from None  # fmt: skip


class _ClusterCapacity:
    """How many items the cluster can run at a time.

    client: the dask client. address: of the scheduler, for messages. least: the smallest capacity reported. State: the
    number of the cluster's worker threads at the last count, the time of that count, and the time of the last count
    with threads, at first of the construction; None after the warning that there are none, until there are some.
    """

    def __init__(self, client: Any, address: str, least: int) -> None:
        self._client, self._address, self._least = client, address, least
        self._threads, self._counted = 0, -COUNT_INTERVAL
        self._empty_since: float | None = time.monotonic()

    def count(self) -> int:
        """Return how many items can run at a time: the number of worker threads, but at least `least`.

        Counts the threads anew if the last count is COUNT_INTERVAL (1 s) old, else returns the last count. Warns once
        if there are no threads for NO_WORKERS_WARNING (20 s). Raises WorkError if the connection to the scheduler is
        lost.
        """
        now = time.monotonic()
        if now - self._counted >= COUNT_INTERVAL:
            if self._client.status not in ("running", "connecting"):
                raise lost_connection(self._address)
            with suppress(OSError):  # a scheduler that is lost just now shows in its futures
                self._threads, self._counted = sum(self._client.nthreads().values()), now
            self._warn_if_empty(now)
        return max(self._least, self._threads)

    def _warn_if_empty(self, now: float) -> None:
        if self._threads:
            self._empty_since = now
        elif self._empty_since is not None and now - self._empty_since >= NO_WORKERS_WARNING:
            self._empty_since = None
            warnings.warn(f"{self._address} has no workers: waiting for some to come", stacklevel=2)


def lost_connection(address: str) -> WorkError:
    """Return (not raise) the WorkError for a scheduler at `address` that can no longer be reached."""
    got = f"a lost connection to {address}"
    return WorkError(place="--cluster", got=got, expected="a scheduler that stays reachable", remedy=REMEDY)


def _submit(client: Any, function: Callable[[Any], Any], item: Any) -> Any:
    """Submit the call function(item) to the cluster; returns its dask future, whose result is a pickled WorkResult.

    The worker runs the call by unpickling the bytes of a ClusterCall. Raises the pickling error of a function or item
    that cannot be pickled.
    """
    name = getattr(getattr(function, "func", function), "__name__", "work").strip("_")
    body = pickle.dumps(ClusterCall(pickle.dumps((function, item)), tuple(runtime().items())))
    return client.submit(pickle.loads, body, key=f"{name}-{uuid.uuid4().hex}", pure=False)


@dataclass(frozen=True)
class ClusterCall:
    """A call for a worker of a cluster: unpickling the pickle of a ClusterCall runs it and gives a pickled WorkResult.

    call: a pickled (function, item). required: (name, value) pairs of the runtime that the worker must have
    (sim.versions.runtime). `__reduce__` makes unpickling run the call, so a scheduler that only forwards the bytes
    needs none of our code. Unpickling raises WorkError as `run_on_worker`.
    """

    call: bytes
    required: tuple[tuple[str, str], ...]

    def __reduce__(self) -> tuple[Any, ...]:
        return run_on_worker, (self.call, self.required)


def run_on_worker(call: bytes, required: tuple[tuple[str, str], ...]) -> bytes:
    """Run a call on the dask worker that this process is; returns a pickled WorkResult.

    It holds the call's value or exception, so an exception of the function itself is not raised. call: a pickled
    (function, item). required: (name, value) pairs of the runtime that the worker must have, as ("numpy", "2.1.0").
    Sets each of THREAD_VARIABLES (OMP_NUM_THREADS and others) to 1 in this process unless it is set already. Before
    Python 3.11.9 it stops dask's profiler.

    Raises WorkError if the worker has more than one thread, or if its runtime differs from `required`; ValueError if
    this process is no dask worker.
    """
    from distributed import get_worker

    for name in THREAD_VARIABLES:
        os.environ.setdefault(name, "1")
    worker = get_worker()
    if sys.version_info < PROFILE_SAFE:
        _stop_profiler(worker)
    if worker.state.nthreads != 1:
        raise WorkError(
            file=worker.address, got=f"a worker of {worker.state.nthreads} threads", expected="one thread per worker",
            remedy="start `dask worker` with --nthreads 1 --nworkers N (a deployment: processes=cores)",
        )  # fmt: skip
    here = runtime()
    different = [name for name, value in required if here.get(name) != value]
    if different:
        wanted = dict(required)
        raise WorkError(
            file=worker.address, got="a worker with " + ", ".join(f"{k} {here.get(k)}" for k in different),
            expected=", ".join(f"{k} {wanted[k]}" for k in different) + " as here", remedy=SAME,
        )  # fmt: skip
    return run_pickled(call)


def _stop_profiler(worker: Any) -> None:
    """Stop the profiler of a dask `worker`, which inspects the stack of each thread a hundred times a second.

    Waits at most CONNECT_TIMEOUT (10 s) until it has stopped. Does nothing if no profiler is running.
    """
    profile = worker.periodic_callbacks.get("profile")
    if profile is not None and profile.is_running():
        worker.loop.add_callback(profile.stop)
        stopped = threading.Event()
        worker.loop.add_callback(stopped.set)
        stopped.wait(CONNECT_TIMEOUT)


def _drain(finished: queue.SimpleQueue[str]) -> Iterator[str]:
    """Yield the keys of all finished futures in the queue; waits at most COUNT_INTERVAL (1 s) for the first, else
    yields none.
    """
    with suppress(queue.Empty):
        yield finished.get(timeout=COUNT_INTERVAL)
        while True:
            yield finished.get_nowait()


def _fetchers(client: Any, futures: list[Any]) -> list[Callable[[], bytes]]:
    """Return for each finished future, in order, a call that returns the future's bytes or raises its error.

    Several futures are gathered in one request, at once. If one of them failed, each call fetches its own future
    instead. A single future is fetched when its call is made. client: the dask client.
    """
    if len(futures) > 1:
        with suppress(Exception):  # one of them failed: its own result() raises the error
            return [partial(bytes, body) for body in client.gather(futures)]
    return [future.result for future in futures]


def _result(fetch: Callable[[], bytes], item: T, address: str, on_loss: Callable[[T, WorkError], R] | None) -> R:
    from distributed import CancelledError, KilledWorker

    try:
        outcome: WorkResult = pickle.loads(fetch())
    except KilledWorker as error:
        loss = worker_loss(error.allowed_failures + 1, f"the loss of {error.last_worker.address}")
        if on_loss is None:
            raise loss from None
        return on_loss(item, loss)
    except (CancelledError, OSError) as error:
        raise lost_connection(address) from error
    except (ImportError, AttributeError) as error:
        raise WorkError(
            place="--cluster", got=f"a worker that cannot import flockscope ({error})",
            expected="flockscope as it is installed here", remedy=SAME,
        ) from None  # fmt: skip
    result: R = outcome.result()
    return result
