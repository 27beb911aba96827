"""Many sequences at once: every entry with every seed, stored as a dataset, by as many workers as wanted.

A sequence is whole or not there, so an interrupted run goes on where it was, and what a dead worker was at is made by
another; what is stored depends on scenario, seed and versions alone, never on who makes it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import replace
from pathlib import Path
from uuid import uuid4

from scenarios.errors import FlockscopeError, InputError, WorkError
from scenarios.loading.resolve import Entry
from sim.dataset.seed_ranges import split_of
from sim.dataset.sequence_job import Job, attempt, begun, given_up, plan
from sim.io.files.atomic import PARTIAL, sweep, write_file
from sim.io.files.lock import alone
from sim.io.store.manifest import MANIFEST
from sim.io.store.streams import chosen
from sim.workers.pool import crew

AHEAD = 100  # jobs that wait at a scheduler, beside one for each worker
Progress = Callable[[int, int, str], None]


def generate(
    entries: Iterable[Entry | str],
    seeds: range,
    out: str | Path,
    *,
    set: Iterable[str] = (),
    workers: int = 1,
    progress: Progress | None = None,
    streams: Iterable[str] = ("left",),
    images: str = "jpg",
    cluster: str | None = None,
) -> list[Path]:
    """Make OUT/flockscope-<split>/<name>-s<seed>/ of every entry (or name of one) and seed, and OUT/seqmaps.

    Sequences that are complete and of the same scenario and seed are kept. progress(done, all, name) is called after
    each. streams, images: the pictures to store (sim.io.store.streams.STREAMS, () none), and as what. cluster: the
    address
    of a dask scheduler whose workers make them, in a folder that all machines share. InputError before anything is
    made where names clash, the range is wrong, or a folder holds another scenario's sequence; WorkError at the end, the
    others kept, where a sequence failed; at once where nothing can be written any more.
    """
    if workers < 1:
        raise InputError(place="workers", got=workers, expected="1 or more", remedy="correct --workers")
    split, root = split_of(seeds), Path(out) if cluster is None else Path(out).absolute()
    folder = root / f"flockscope-{split}"
    pictures = chosen(streams, images)
    jobs = [replace(job, streams=pictures, images=images) for job in plan(_resolved(entries, set), seeds, folder)]
    with alone(root):
        sweep(root, folder, root / "seqmaps")
        for job in jobs:
            begun(job)
        try:
            errors = _run(jobs, workers, cluster, _counted(progress, len(jobs)))
        finally:
            sweep(root, folder)
        try:
            there = write_seqmap(root, split)
        except FlockscopeError as error:
            errors["seqmaps"] = error
    errors = errors or {job.name: _unseen(job) for job in jobs if job.name not in there}
    if errors:
        raise _summary(errors, len(jobs))
    return [job.folder for job in jobs]


def _resolved(entries: Iterable[Entry | str], set: Iterable[str]) -> list[Entry]:
    from scenarios.loading.resolve import resolve

    settings = tuple(set)
    return [e for entry in entries for e in (resolve(entry, settings) if isinstance(entry, str) else [entry])]


def _run(jobs: list[Job], workers: int, cluster: str | None, done: Callable[[Job], None]) -> dict[str, FlockscopeError]:
    """Make all, as long as something can be written; the errors by sequence, in the order of the jobs."""
    errors: dict[str, FlockscopeError] = {}
    with crew(min(workers, max(1, len(jobs))), cluster) as run:
        marked = jobs if cluster is None else _marked(jobs)
        for job, outcome in run(attempt, marked, ahead=AHEAD, lost=given_up):
            if outcome.error is not None:
                errors[job.name] = outcome.error
            if outcome.hopeless:
                break
            done(job)
    return {job.name: errors[job.name] for job in jobs if job.name in errors}


def _marked(jobs: list[Job]) -> list[Job]:
    """Jobs for whoever sees the folder that we see; the mark goes away with what else is left over."""
    mark = jobs[0].folder.parents[1] / f"{PARTIAL}{uuid4().hex}"
    write_file(mark, b"")
    return [replace(job, mark=mark) for job in jobs]


def _counted(progress: Progress | None, total: int) -> Callable[[Job], None]:
    count = 0

    def done(job: Job) -> None:
        nonlocal count
        count += 1
        if progress is not None:
            progress(count, total, job.name)

    return done


def _unseen(job: Job) -> WorkError:
    return WorkError(
        file=job.folder, got="nothing, though a worker has made it", expected="a folder that all machines share",
        remedy="run again, or choose another --out",
    )  # fmt: skip


def write_seqmap(root: Path, split: str) -> set[str]:
    """seqmaps/flockscope-<split>.txt: every complete sequence of the split, sorted, for TrackEval. Their names."""
    folder = root / f"flockscope-{split}"
    complete = sorted(p.parent.name for p in folder.glob(f"*/{MANIFEST}") if not p.parent.name.startswith("."))
    if complete:
        write_file(root / "seqmaps" / f"flockscope-{split}.txt", "\n".join(["name", *complete, ""]).encode())
    return {*complete}


def _summary(errors: dict[str, FlockscopeError], total: int) -> FlockscopeError:
    """The first error, and which other sequences failed; a single one as it is."""
    first, *_ = errors.values()
    if len(errors) == 1:
        return first
    others = ", ".join(list(errors)[1:6]) + (", …" if len(errors) > 6 else "")
    kind = type(first) if len({type(e) for e in errors.values()}) == 1 else WorkError
    return kind(
        file=first.file, place=first.place, got=f"{first.got} (and {len(errors) - 1} more of {total}: {others})",
        expected=first.expected, remedy=first.remedy + ("" if len(errors) == total else "; the others are kept"),
    )  # fmt: skip
