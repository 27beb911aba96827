"""Runs a function over the sequences of a source, in this process or in several; results come in order either way."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterator
from collections.abc import Sequence as SequenceOf
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any, TypeVar

from scenarios.errors import FlockscopeError, WorkError
from sim.types import Sequence
from tracking.app.progress import ProgressMeter
from tracking.recordings.source import open_source

J = TypeVar("J")
R = TypeVar("R")

# Options of commands that `open_source` has, too.
OPTIONS = ("fps", "px_per_m", "camera", "background", "person_class", "box_scale", "min_score", "boxes")


@dataclass(frozen=True)
class OpenedAs:
    """A source with the options of `open_source`, so that another process can open it again."""

    path: Path
    options: tuple[tuple[str, Any], ...] = ()

    def open(self) -> list[Sequence]:
        """Returns the sequences of the source. Raises InputError if it cannot be opened, as `open_source` does."""
        return open_source(self.path, **dict(self.options))


def source_of(options: Any, path: Path, images: bool = False, without: str = "") -> OpenedAs:
    """Returns the source at `path` with all options of a command that `open_source` takes, too. images: True reads
    pictures. without: name of an option that is left out, as it has another meaning in the command."""
    given = [(name, value) for name, value in vars(options).items() if name in OPTIONS and name != without]
    return OpenedAs(path, (("images", images), *given))


_Task = tuple[OpenedAs, int, Callable[[Sequence, Any], Any], Any]  # source, index of the sequence, function, job
_Outcome = tuple[Any, FlockscopeError | None, list[str]]  # the value of a task, or its error, and its warnings


def over_sequences(
    what: str,
    function: Callable[[Sequence, J], R],
    sequences: SequenceOf[Sequence],
    jobs: SequenceOf[J],
    source: OpenedAs,
    workers: int,
) -> Iterator[R]:
    """Yields function(sequence, job) for each sequence and its job, in order, and shows the progress. what: word shown
    with the progress. source: from which other processes open the sequences. workers: greatest number of processes."""
    count, tasks = min(workers, len(sequences)), [(source, k, function, job) for k, job in enumerate(jobs)]
    found = _in_processes(tasks, sequences, count) if count > 1 else map(function, sequences, jobs)
    with ProgressMeter(what, len(sequences)) as meter:
        for sequence, result in zip(sequences, found, strict=True):
            meter.step(sequence.name)
            yield result


def _in_processes(tasks: list[_Task], sequences: SequenceOf[Sequence], workers: int) -> Iterator[Any]:
    from sim.workers.start import results_in_order, start_workers

    def lost(task: _Task, error: WorkError) -> _Outcome:
        return None, error.replaced(place=sequences[task[1]].name), []

    with start_workers(workers) as run:
        for value, error, texts in results_in_order(run, _outcome, tasks, lost):
            for text in texts:
                warnings.warn(text, stacklevel=2)
            if error is not None:
                raise error
            yield value


def _outcome(task: _Task) -> _Outcome:
    source, index, function, job = task
    value, error = None, None
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", UserWarning)
        try:
            value = function(_opened(source)[index], job)
        except FlockscopeError as failure:
            error = failure
    return value, error, [str(w.message) for w in caught if issubclass(w.category, UserWarning)]


@cache
def _opened(source: OpenedAs) -> list[Sequence]:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # the first process has given them
        return source.open()
