"""The workers of a dask.distributed cluster as a crew.

The scheduler is only given bytes. A worker must have the same sources, libraries and vector instructions as we here,
or what it makes could be other bytes: it is refused before it does anything. The work of one that dies is given to
another by the scheduler.
"""

from __future__ import annotations

import hashlib
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
from functools import cache, partial
from itertools import islice
from pathlib import Path
from typing import Any

from scenarios.errors import InputError, WorkError
from sim.workers.pool import THREADS, R, Run, T, died
from sim.workers.process import Answer, answered

ADDRESS = r"[a-z]+://([^\s/:\[\]]+|\[[0-9a-fA-F:.]+\]):\d+/?"
PATIENCE = 10.0  # s to reach a scheduler
COUNT = 1.0  # s between counts of its workers
SILENCE = 20.0  # s without any worker until the user is told
REMEDY = "run the same command again: what is complete is kept"
SOUND = (3, 11, 9)  # Python before may stand still for ever where sys._current_frames meets garbage (its issue 106883)
PACKAGES = ("scenarios", "sim", "tracking")


@contextmanager
def connected(address: str, workers: int = 1) -> Iterator[Run]:
    """The run of a cluster; InputError or WorkError where it cannot be reached."""
    client = _client(address)

    def run(
        function: Callable[[T], R],
        items: Iterable[T],
        *,
        ahead: int = 0,
        lost: Callable[[T, WorkError], R] | None = None,
    ) -> Iterator[tuple[T, R]]:
        staff = _Staff(client, address, workers)
        coming, done = iter(items), queue.SimpleQueue[str]()
        under_way: dict[str, tuple[T, Any]] = {}
        while True:
            for item in islice(coming, max(0, staff.count() + ahead - len(under_way))):
                future = _submitted(client, function, item)
                under_way[future.key] = item, future
                future.add_done_callback(lambda f: done.put(f.key))
            if not under_way:
                return
            ready = [under_way.pop(key) for key in _drained(done)]
            for (item, _), fetch in zip(ready, _fetched(client, [f for _, f in ready]), strict=True):
                yield item, _result(fetch, item, address, lost)

    try:
        yield run
    finally:
        with suppress(OSError):
            client.close(timeout=PATIENCE)


def _client(address: str) -> Any:
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
    logging.getLogger("distributed").setLevel(logging.CRITICAL)  # what it would say, our errors do
    try:
        return Client(address, timeout=PATIENCE, set_as_default=False, name="flockscope")
    except (OSError, ValueError) as error:
        raise WorkError(
            place="--cluster", got=f"no answer from {address} ({error})", expected="a dask scheduler there",
            remedy="check that it runs and can be reached from here",
        ) from None  # fmt: skip


class _Staff:
    """State: how many threads the cluster's workers had when last counted, and since when there are none."""

    def __init__(self, client: Any, address: str, least: int) -> None:
        self._client, self._address, self._least = client, address, least
        self._here, self._counted = 0, -COUNT
        self._alone_since: float | None = time.monotonic()

    def count(self) -> int:
        """How many items can be done at a time, at least as many as the user says."""
        now = time.monotonic()
        if now - self._counted >= COUNT:
            if self._client.status not in ("running", "connecting"):
                raise lost_connection(self._address)
            with suppress(OSError):  # a scheduler that is lost just now shows in its futures
                self._here, self._counted = sum(self._client.nthreads().values()), now
            self._mind(now)
        return max(self._least, self._here)

    def _mind(self, now: float) -> None:
        if self._here:
            self._alone_since = now
        elif self._alone_since is not None and now - self._alone_since >= SILENCE:
            self._alone_since = None
            warnings.warn(f"{self._address} has no workers: waiting for some to come", stacklevel=2)


def lost_connection(address: str) -> WorkError:
    """The error of a scheduler that went away."""
    got = f"a lost connection to {address}"
    return WorkError(place="--cluster", got=got, expected="a scheduler that stays", remedy=REMEDY)


def _submitted(client: Any, function: Callable[[Any], Any], item: Any) -> Any:
    """Its future: unpickling the bytes does the work, so whoever passes them on needs nothing of ours."""
    name = getattr(getattr(function, "func", function), "__name__", "work").strip("_")
    body = pickle.dumps(Order(pickle.dumps((function, item)), tuple(about().items())))
    return client.submit(pickle.loads, body, key=f"{name}-{uuid.uuid4().hex}", pure=False)


@dataclass(frozen=True)
class Order:
    """Pickled work and what a worker must be like; unpickled, it is the Answer's bytes."""

    work: bytes
    like: tuple[tuple[str, str], ...]

    def __reduce__(self) -> tuple[Any, ...]:
        return carry_out, (self.work, self.like)


def carry_out(work: bytes, like: tuple[tuple[str, str], ...]) -> bytes:
    """On a worker: the pickled Answer; WorkError if it is not like that."""
    from distributed import get_worker

    for name in THREADS:
        os.environ.setdefault(name, "1")
    worker = get_worker()
    if sys.version_info < SOUND:
        _stop_profile(worker)
    if worker.state.nthreads != 1:
        raise WorkError(
            file=worker.address, got=f"a worker of {worker.state.nthreads} threads", expected="one thread per worker",
            remedy="start `dask worker` with --nthreads 1 --nworkers N (a deployment: processes=cores)",
        )  # fmt: skip
    here = about()
    other = [name for name, value in like if here.get(name) != value]
    if other:
        wanted = dict(like)
        raise WorkError(
            file=worker.address, got="a worker with " + ", ".join(f"{k} {here.get(k)}" for k in other),
            expected=", ".join(f"{k} {wanted[k]}" for k in other) + " as here", remedy=_remedy(other),
        )  # fmt: skip
    return answered(work)


def _stop_profile(worker: Any) -> None:
    """Dask's profile asks a hundred times a second what each thread is at."""
    profile = worker.periodic_callbacks.get("profile")
    if profile is not None and profile.is_running():
        worker.loop.add_callback(profile.stop)
        stopped = threading.Event()
        worker.loop.add_callback(stopped.set)
        stopped.wait(PATIENCE)


def _remedy(other: list[str]) -> str:
    if other == ["cpu"]:
        return "use machines of one kind, or give all the same NPY_DISABLE_CPU_FEATURES"
    return "install the same on all (pip install -c constraints.txt) and start the workers anew"


@cache
def about() -> dict[str, str]:
    """What the bytes depend on, in this process: versions, sources of ours, instructions."""
    from sim.hashing import cpu_level
    from sim.io.store.manifest import versions

    root = Path(__file__).resolve().parents[2]
    return {**versions(drawn=True), "sources": sources(root), "cpu": cpu_level()}


def sources(root: Path) -> str:
    """A short hash over our packages in a folder."""
    h = hashlib.sha256()
    for package in PACKAGES:
        for path in sorted((root / package).rglob("*")):
            if path.suffix in (".py", ".toml"):
                h.update(f"{path.relative_to(root).as_posix()}\0".encode() + path.read_bytes() + b"\0")
    return h.hexdigest()[:12]


def _drained(done: queue.SimpleQueue[str]) -> Iterator[str]:
    """All that is there, after waiting a moment for the first."""
    with suppress(queue.Empty):
        yield done.get(timeout=COUNT)
        while True:
            yield done.get_nowait()


def _fetched(client: Any, futures: list[Any]) -> list[Callable[[], bytes]]:
    """What gives, or raises, the results of futures; those of many that went well are fetched at once."""
    if len(futures) > 1:
        with suppress(Exception):  # whose it is, its own result() says
            return [partial(bytes, body) for body in client.gather(futures)]
    return [future.result for future in futures]


def _result(fetch: Callable[[], bytes], item: T, address: str, lost: Callable[[T, WorkError], R] | None) -> R:
    from distributed import CancelledError, KilledWorker

    try:
        answer: Answer = pickle.loads(fetch())
    except KilledWorker as error:
        told = died(error.allowed_failures + 1, f"the loss of {error.last_worker.address}")
        if lost is None:
            raise told from None
        return lost(item, told)
    except (CancelledError, OSError) as error:
        raise lost_connection(address) from error
    except (ImportError, AttributeError) as error:
        raise WorkError(
            place="--cluster", got=f"a worker that cannot begin ({error})", expected="flockscope as it is here",
            remedy=_remedy([]),
        ) from None  # fmt: skip
    result: R = answer.result()
    return result
