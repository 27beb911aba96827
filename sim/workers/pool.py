"""Who does the work: this process, spawned processes of one thread each, or the workers of a cluster; one call for all.

The work of a worker that dies is done again, so a function should find what it has done before, or do it anew.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Generator, Iterable, Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass
from typing import Any, Generic, Protocol, TypeVar

from scenarios.errors import InputError, WorkError
from sim.workers.process import Hand

THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS", "OPENCV_FOR_THREADS_NUM")
TRIES = 3  # workers that an item may cost
T = TypeVar("T")
R = TypeVar("R")


class Run(Protocol):
    """Pairs (item, result) as they come, in any order.

    Items are taken from their iterable when there is somebody to do them, and `ahead` more where that helps: a
    generator of items sees the results so far. The function is pickled by its name; an exception of it ends all and is
    raised here. An item that costs TRIES workers their life is a WorkError, or has the result that lost(item, error)
    gives.
    """

    def __call__(
        self,
        function: Callable[[T], R],
        items: Iterable[T],
        *,
        ahead: int = 0,
        lost: Callable[[T, WorkError], R] | None = None,
    ) -> Iterator[tuple[T, R]]:
        """Do function(item) of all items."""


def crew(workers: int = 1, cluster: str | None = None) -> AbstractContextManager[Run]:
    """The run of this process (one worker), of so many processes, or of the cluster whose scheduler has that address.

    On a cluster as many items are under way as it has workers, `workers` at least.
    """
    if workers < 1:
        raise InputError(place="workers", got=workers, expected="1 or more", remedy="correct --workers")
    if cluster is not None:
        from sim.workers.cluster import connected

        return connected(cluster, workers)
    return pool(workers) if workers > 1 else alone()


def in_order(run: Run, function: Callable[[T], R], items: Sequence[T]) -> Generator[R, None, None]:
    """The results in the order of the items, no two of which are the same object.

    Once the taker stops nothing more is begun; what is under way is waited for, so that no worker is lost.
    """
    wanted, found = True, dict[int, R]()
    coming = run(function, (item for item in items if wanted))
    try:
        for item in items:
            while id(item) not in found:
                done, result = next(coming)
                found[id(done)] = result
            yield found.pop(id(item))
    finally:
        wanted = False
        for _ in coming:
            pass


@contextmanager
def alone() -> Iterator[Run]:
    """The run of this process."""

    def run(
        function: Callable[[T], R], items: Iterable[T], *, ahead: int = 0, lost: Any = None
    ) -> Iterator[tuple[T, R]]:
        for item in items:
            yield item, function(item)

    yield run


@contextmanager
def pool(workers: int) -> Iterator[Run]:
    """The run of so many spawned processes, which end with the block, whatever they are at."""
    before = {name: os.environ.get(name) for name in THREADS}
    os.environ.update(dict.fromkeys(THREADS, "1"))
    hands = [Hand() for _ in range(workers)]

    def run(
        function: Callable[[T], R],
        items: Iterable[T],
        *,
        ahead: int = 0,
        lost: Callable[[T, WorkError], R] | None = None,
    ) -> Iterator[tuple[T, R]]:
        return _shared_out(hands, function, items, lost)

    try:
        yield run
    finally:
        for hand in hands:
            hand.end()
        for hand in hands:
            hand.join()
        for name, value in before.items():
            os.environ.pop(name, None) if value is None else os.environ.update({name: value})


@dataclass
class _Task(Generic[T]):
    """An item and how many workers it has cost."""

    item: T
    deaths: int = 0


def _shared_out(
    hands: list[Hand], function: Callable[[T], R], items: Iterable[T], lost: Callable[[T, WorkError], R] | None
) -> Iterator[tuple[T, R]]:
    """One item at a time to each hand, so that a death is about that item alone."""
    from multiprocessing.connection import wait

    coming, again, idle = map(_Task, items), list[_Task[T]](), list(hands)
    busy: dict[Any, tuple[Hand, _Task[T]]] = {}
    since = 0  # deaths since a hand has answered
    try:
        while True:
            while idle and (task := again.pop() if again else next(coming, None)) is not None:
                hand = idle.pop()
                busy[hand.begin(function, task.item)] = hand, task
            if not busy:
                return
            hand, task = busy.pop(wait(list(busy))[0])
            idle.append(hand)
            answer = hand.answer()
            if answer is not None:
                since = 0
                yield task.item, answer.result()
                continue
            task.deaths, since = task.deaths + 1, since + 1
            if task.deaths < TRIES:
                again.append(task)
            elif lost is None or since > TRIES * (len(hands) + 1):
                raise died(TRIES, hand.ended)
            else:
                yield task.item, lost(task.item, died(TRIES, hand.ended))
    finally:
        for hand, _ in busy.values():
            hand.end()
            hand.join()


def died(workers: int, how: str) -> WorkError:
    """The error of an item that has cost so many workers."""
    return WorkError(
        got=f"{workers} workers that died at it, the last by {how}",
        expected="workers that finish",
        remedy="run again, with fewer workers if memory is short",
    )
