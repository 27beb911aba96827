"""Runs a function over the sequences of a source, in this process or in several; results come in order either way."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterator
from collections.abc import Sequence as SequenceOf
from dataclasses import asdict, dataclass, fields
from functools import cache, partial
from pathlib import Path
from typing import Any, TypeVar

from scenarios.errors import FlockscopeError, WorkError
from sim.io.source import open_source
from sim.types import Sequence
from tracking.app.progress import ProgressMeter

J = TypeVar("J")
R = TypeVar("R")


@dataclass(frozen=True)
class OpenedAs:
    """A source with the options of `open_source`, so that another process can open it again."""

    path: Path
    fps: float | None = None
    px_per_m: float | None = None
    camera: Path | None = None
    images: bool = True
    background: str | None = None
    person_class: str | None = None
    box_scale: str | None = None
    min_score: float | None = None
    boxes: Path | None = None

    def open(self) -> list[Sequence]:
        """Returns the sequences of the source. Raises InputError as `open_source`."""
        return open_source(**asdict(self))


def source_of(options: Any, path: Path, images: bool = False, without: str = "") -> OpenedAs:
    """Returns a source with those options of a command that `open_source` has, too; without: one that means more."""
    known = {f.name for f in fields(OpenedAs)} - {"path", "images", without}
    return OpenedAs(path, images=images, **{name: value for name, value in vars(options).items() if name in known})


@dataclass(frozen=True, eq=False)
class _Task:
    source: OpenedAs
    index: int
    function: Callable[[Sequence, Any], Any]
    job: Any


# The value of a task, or its error, and its warnings.
_Outcome = tuple[Any, FlockscopeError | None, list[str]]


def results_over_sequences(
    what: str,
    function: Callable[[Sequence, J], R],
    sequences: SequenceOf[Sequence],
    jobs: SequenceOf[J],
    source: OpenedAs,
    workers: int,
) -> list[R]:
    """Returns function(sequence, job) for each sequence and its job, and shows the progress as `what`."""
    found: list[R] = []
    with ProgressMeter(what, len(sequences)) as meter:
        for result in over_sequences(function, sequences, jobs, source, workers):
            meter.step(sequences[len(found)].name)
            found.append(result)
    return found


def over_sequences(
    function: Callable[[Sequence, J], R],
    sequences: SequenceOf[Sequence],
    jobs: SequenceOf[J],
    source: OpenedAs,
    workers: int,
) -> Iterator[R]:
    """Yields function(sequence, job) for each sequence and its job, in order."""
    from sim.workers.pool import results_in_order, start_workers

    workers = min(workers, len(sequences))
    if workers <= 1:
        yield from map(function, sequences, jobs)
        return
    tasks = [_Task(source, k, function, job) for k, job in enumerate(jobs)]

    def lost(task: _Task, error: WorkError) -> _Outcome:
        return None, error.replaced(place=sequences[task.index].name), []

    with start_workers(workers) as run:
        for value, error, texts in results_in_order(partial(run, on_loss=lost), _outcome, tasks):  # type: ignore[arg-type]
            for text in texts:
                warnings.warn(text, stacklevel=2)
            if error is not None:
                raise error
            yield value


def _outcome(task: _Task) -> _Outcome:
    value, error = None, None
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", UserWarning)
        try:
            value = task.function(_opened(task.source)[task.index], task.job)
        except FlockscopeError as failure:
            error = failure
    return value, error, [str(w.message) for w in caught if issubclass(w.category, UserWarning)]


@cache
def _opened(source: OpenedAs) -> list[Sequence]:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # the first process has given them
        return source.open()
