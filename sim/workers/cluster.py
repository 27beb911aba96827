"""Runs a function over items on the workers of a dask.distributed cluster.

The scheduler is given bytes only, so it needs none of our code. A worker refuses an item unless it has the same
versions and sources as this process, because its results could differ in their bytes otherwise
(sim.hashing.runtime). If a worker dies, the scheduler gives its item to another worker.
"""

from __future__ import annotations

import logging
import os
import pickle
import re
import sys
import threading
import time
import uuid
import warnings
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from itertools import islice
from typing import Any

from scenarios.errors import InputError, WorkError, extra_needed
from sim.hashing import runtime
from sim.workers.calls import THREAD_VARIABLES, OnLoss, R, RunItems, T, WorkResult, run_pickled, worker_loss

ADDRESS = r"[a-z]+://([^\s/:\[\]]+|\[[0-9a-fA-F:.]+\]):[0-9]+/?"
SAME = "install the same on all (pip install -c constraints.txt) and restart the workers"
CONNECT_TIMEOUT = 10.0  # s to reach a scheduler
NO_WORKERS_WARNING = 20.0  # s without any worker before a warning
COUNT_INTERVAL = 1.0  # s between two counts of the cluster's workers
REMEDY = "run the same command again: what is complete is kept"
# earlier Pythons may deadlock in sys._current_frames, which dask's profiler calls (gh-106883)
PROFILE_SAFE = (3, 11, 9)


@contextmanager
def cluster_workers(address: str, workers: int = 1) -> Iterator[RunItems]:
    """Yields the RunItems of the dask cluster at `address` ("tcp://HOST:PORT"); the cluster keeps running.

    The number of items under way is that of the cluster's threads, at least `workers`, plus the `ahead` of the call.
    """
    client = _connect(address)

    def run(
        function: Callable[[T], R], items: Iterable[T], *, ahead: int = 0, on_loss: OnLoss[T, R] = None
    ) -> Iterator[tuple[T, R]]:
        from distributed import as_completed

        finished = as_completed(loop=client.loop, with_results=True, raise_errors=False)
        waiting, under_way, threads, counted = iter(items), dict[Any, T](), 0, float("-inf")
        empty_since = time.monotonic()
        while True:
            now = time.monotonic()
            if now - counted >= COUNT_INTERVAL:
                threads, counted = _count_threads(client, address), now
                if threads:
                    empty_since = now
                elif now - empty_since >= NO_WORKERS_WARNING:
                    empty_since = float("inf")  # one warning
                    warnings.warn(f"{address} has no workers: waiting for some to come", stacklevel=2)
            for item in islice(waiting, max(0, max(workers, threads) + ahead - len(under_way))):
                future = _submit(client, function, item)
                under_way[future] = item
                finished.add(future)
            if not under_way:
                return
            with finished.thread_condition:
                finished.thread_condition.wait_for(finished.has_ready, COUNT_INTERVAL)
            for future, answer in finished.next_batch(block=False):
                item = under_way.pop(future)
                yield item, _result(answer, item, address, on_loss)

    try:
        yield run
    finally:
        with suppress(OSError):
            client.close(timeout=CONNECT_TIMEOUT)


def _connect(address: str) -> Any:
    if not re.fullmatch(ADDRESS, address):
        expected, remedy = "tcp://HOST:PORT", "give the address that `dask scheduler` prints"
        raise InputError(place="--cluster", got=repr(address), expected=expected, remedy=remedy)
    with extra_needed("cluster", "--cluster"):
        from distributed import Client
    logging.getLogger("distributed").setLevel(logging.CRITICAL)  # our errors say the same in one line
    try:
        return Client(address, timeout=CONNECT_TIMEOUT, set_as_default=False, name="flockscope")
    except (OSError, ValueError) as error:
        raise WorkError(
            place="--cluster", got=f"no answer from {address} ({error})", expected="a dask scheduler there",
            remedy="check that it runs and can be reached from here",
        ) from None  # fmt: skip


def _count_threads(client: Any, address: str) -> int:
    """Returns the number of the cluster's threads, each of which runs one item at a time."""
    if client.status not in ("running", "connecting"):
        raise lost_connection(address)
    with suppress(OSError):  # a scheduler that is lost just now shows in its futures
        return sum(client.nthreads().values())
    return 0


def lost_connection(address: str) -> WorkError:
    """Returns the error for a scheduler at `address` that can no longer be reached."""
    got = f"a lost connection to {address}"
    return WorkError(place="--cluster", got=got, expected="a scheduler that stays reachable", remedy=REMEDY)


# The result of the future is a pickled WorkResult.
def _submit(client: Any, function: Callable[[Any], Any], item: Any) -> Any:
    name = getattr(getattr(function, "func", function), "__name__", "work").strip("_")
    body = pickle.dumps(ClusterCall(pickle.dumps((function, item)), tuple(runtime().items())))
    return client.submit(pickle.loads, body, key=f"{name}-{uuid.uuid4().hex}", pure=False)


@dataclass(frozen=True)
class ClusterCall:
    """A call that runs when it is unpickled: unpickling gives the pickled WorkResult."""

    call: bytes
    required: tuple[tuple[str, str], ...]

    def __reduce__(self) -> tuple[Any, ...]:
        # The scheduler only forwards these bytes, so it needs none of our code.
        return run_on_worker, (self.call, self.required)


def run_on_worker(call: bytes, required: tuple[tuple[str, str], ...]) -> bytes:
    """Runs a pickled (function, item) on the dask worker that this process is; returns a pickled WorkResult.

    Raises WorkError if the worker has several threads, or its runtime differs from the `required` pairs.
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
    profile = worker.periodic_callbacks.get("profile")
    if profile is not None and profile.is_running():
        # The profiler inspects the stack of each thread a hundred times a second.
        worker.loop.add_callback(profile.stop)
        stopped = threading.Event()
        worker.loop.add_callback(stopped.set)
        stopped.wait(CONNECT_TIMEOUT)


def _result(answer: Any, item: T, address: str, on_loss: OnLoss[T, R]) -> R:
    """Returns the result of a call; answer: bytes, an exception, or its type, itself and its traceback."""
    from distributed import CancelledError, KilledWorker

    if isinstance(answer, bytes):
        outcome: WorkResult = pickle.loads(answer)
        result: R = outcome.result()
        return result
    error = answer[1] if isinstance(answer, tuple) else answer
    if isinstance(error, KilledWorker):
        loss = worker_loss(error.allowed_failures + 1, f"the loss of {error.last_worker.address}")
        if on_loss is None:
            raise loss
        return on_loss(item, loss)
    if isinstance(error, CancelledError | OSError):
        raise lost_connection(address) from error
    if isinstance(error, ImportError | AttributeError):
        raise WorkError(
            place="--cluster", got=f"a worker that cannot import flockscope ({error})",
            expected="flockscope as it is installed here", remedy=SAME,
        )  # fmt: skip
    raise error
